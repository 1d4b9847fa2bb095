"""The frequency response of a system, at all frequencies at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import hessenberg

from magbear_cli.errors import NumericsError
from magbear_cli.lti.balancing import with_balanced_states
from magbear_cli.lti.state_space import StateSpace

ENTRIES_AT_ONCE = 2_000_000  # complex numbers held while eliminating: 32 MB


def frequency_response(system: StateSpace, omega_rad_s: ArrayLike) -> NDArray[np.complex128]:
    """C (jω I − A)⁻¹ B + D for every frequency.

    Parameters
    ----------
    system : StateSpace with n states, m inputs, p outputs
    omega_rad_s : (w,) array of real frequencies, or one; ±∞ is legal and gives D

    Returns
    -------
    response : (w, p, m) complex array; its entries are infinite where jω is exactly a pole

    Raises
    ------
    NumericsError
        when a frequency is not a number.

    Notes
    -----
    A is balanced and reduced once to Hessenberg form; each frequency then costs n² operations (Laub 1981), done here
    as row operations on all frequencies together, with the pivot of each chosen by size.
    """
    omega = np.asarray(omega_rad_s, dtype=float).reshape(-1)
    if np.isnan(omega).any():
        raise NumericsError("frequencies must be a list of numbers")
    response = np.repeat(system.d[None].astype(complex), omega.size, axis=0)
    finite = np.flatnonzero(np.isfinite(omega))
    if system.order == 0 or finite.size == 0:
        return response
    balanced = with_balanced_states(system)
    # Fast states first: reflections then mix small entries into large ones and not the other way round.
    fast_first = np.argsort(-np.abs(balanced.a).sum(axis=1), kind="stable")
    upper, q = hessenberg(balanced.a[np.ix_(fast_first, fast_first)], calc_q=True)
    a, b, c = np.asarray(upper, dtype=np.float64), q.T @ balanced.b[fast_first], balanced.c[:, fast_first] @ q
    chunk = max(1, ENTRIES_AT_ONCE // (system.order * (system.order + system.inputs)))
    for start in range(0, finite.size, chunk):
        index = finite[start : start + chunk]
        states = _solve_hessenberg(a, b, np.asarray(omega[index], dtype=np.float64))
        response[index] += np.einsum("pn,nmw->wpm", c, states)
    response[~np.isfinite(response)] = np.inf
    return response


def _solve_hessenberg(
    a: NDArray[np.float64], b: NDArray[np.float64], omega: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """X (n, m, w) with (jω I − A) X = B, for A in upper Hessenberg form, by elimination with row exchanges."""
    n = a.shape[0]
    matrix = np.repeat(-a[:, :, None].astype(complex), omega.size, axis=2)
    matrix[np.arange(n), np.arange(n)] += 1j * omega
    right = np.repeat(b[:, :, None].astype(complex), omega.size, axis=2)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for k in range(n - 1):
            exchange = np.abs(matrix[k + 1, k]) > np.abs(matrix[k, k])
            for rows in (matrix[:, k:], right):
                upper = np.where(exchange, rows[k + 1], rows[k])
                rows[k + 1] = np.where(exchange, rows[k], rows[k + 1])
                rows[k] = upper
            pivot = np.where(matrix[k, k] == 0.0, 1.0, matrix[k, k])  # both entries are zero then: nothing to do
            factor = matrix[k + 1, k] / pivot
            matrix[k + 1, k:] -= factor * matrix[k, k:]
            right[k + 1] -= factor * right[k]
        for k in range(n - 1, -1, -1):
            right[k] -= np.einsum("jw,jmw->mw", matrix[k, k + 1 :], right[k + 1 :])
            right[k] /= matrix[k, k]
    return right

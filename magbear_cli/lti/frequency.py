"""The frequency response of a system, at all frequencies at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.lti.balancing import with_balanced_states
from magbear_cli.lti.modal import ModalForm, modal_form
from magbear_cli.lti.state_space import StateSpace

TRUSTED = 1e-8  # of each entry, as estimated; the error is some ten times smaller, and not larger than that of solving
MANY = 40_000  # frequencies times the square of the states, from which on the modes cost less than solving
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
    For many states and frequencies the sum of first-order terms of ``modal`` is taken wherever its own estimate of its
    error is below ``TRUSTED``; for few, and at the other frequencies, A is balanced and jω I − A solved with row
    exchanges. A reduction to Hessenberg form costs less than solving, but its reflections mix states of different size:
    on a loop whose states nearly cancel, a single rounding error in A has been seen to make such a response wrong in
    its first digit.
    """
    omega = np.asarray(omega_rad_s, dtype=float).reshape(-1)
    if np.isnan(omega).any():
        raise NumericsError("frequencies must be a list of numbers")
    response = np.empty((omega.size, *system.d.shape), dtype=complex)
    response[:] = system.d
    finite = np.flatnonzero(np.isfinite(omega))
    if system.order == 0 or finite.size == 0:
        return response
    modes = modal_form(system) if finite.size * system.order**2 >= MANY else None
    response[finite] += _dynamic_part(system, modes, omega[finite])
    response[~np.isfinite(response)] = np.inf
    return response


def _dynamic_part(system: StateSpace, modes: ModalForm | None, omega: NDArray[np.float64]) -> NDArray[np.complex128]:
    """C (jω I − A)⁻¹ B, (w, p, m): of the modes where they are trusted, by solving elsewhere."""
    if modes is None:
        return _solved(system, omega)
    response, error = modes.response(omega)
    least = np.minimum.reduce(np.abs(response.reshape(omega.size, -1)).T)  # a long row for each of a few entries
    open_rows = np.flatnonzero(~(error <= TRUSTED * least))
    if open_rows.size:
        response[open_rows] = _solved(system, omega[open_rows])
    return response


def _solved(system: StateSpace, omega: NDArray[np.float64]) -> NDArray[np.complex128]:
    """C (jω I − A)⁻¹ B, (w, p, m), with the states balanced before."""
    balanced = with_balanced_states(system)
    chunk = max(1, ENTRIES_AT_ONCE // (system.order * (system.order + system.inputs)))
    parts = [balanced.c @ _states(balanced, omega[at : at + chunk]) for at in range(0, omega.size, chunk)]
    return np.asarray(np.concatenate(parts))


def _states(system: StateSpace, omega: NDArray[np.float64]) -> NDArray[np.complex128]:
    """(jω I − A)⁻¹ B, (w, n, m); not a number where a pole lies exactly there."""
    diagonal = np.arange(system.order)
    matrix = np.repeat(-system.a[None].astype(complex), omega.size, axis=0)
    matrix[:, diagonal, diagonal] += 1j * omega[:, None]
    right = np.repeat(system.b[None].astype(complex), omega.size, axis=0)
    try:
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:  # one of them is singular: all but that one have an answer
        if omega.size == 1:
            return np.full_like(right, np.nan)
        half = omega.size // 2
        return np.concatenate([_states(system, omega[:half]), _states(system, omega[half:])])

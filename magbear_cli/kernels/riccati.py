"""The stabilising solution of the continuous algebraic Riccati equation, with its residual."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve, solve_continuous_are, solve_continuous_lyapunov

from magbear_cli.errors import NumericsError

Matrix = NDArray[np.float64]

ACCEPTED_RESIDUAL = 1e-8  # relative, entry by entry; ordinary problems end near 1e-15
REFINEMENTS = 3
SWEEPS = 60  # of balancing; a handful suffice


def solve_care(a: Matrix, b: Matrix, q: Matrix, r: Matrix) -> tuple[Matrix, float]:
    """X ≥ 0 with AᵀX + X A − X B R⁻¹ Bᵀ X + Q = 0 and A − B R⁻¹ Bᵀ X stable.

    Parameters
    ----------
    a : (n, n), b : (n, m) arrays
    q : (n, n) symmetric positive semidefinite, r : (m, m) symmetric positive definite

    Returns
    -------
    x : (n, n) symmetric array
    residual : the largest entry of the equation's left side over the sum of the sizes of its terms at that entry,
        which does not depend on the units of the states

    Raises
    ------
    NumericsError
        when the data are not finite or not of the required sign, when no stabilising solution exists, or when the
        residual stays above 1e-8.

    Notes
    -----
    Schur vectors of the extended Hamiltonian pencil (Laub 1979; Van Dooren 1981), in units of state, cost and time
    that bring its entries together, refined by Newton steps, each a Lyapunov equation (Kleinman 1968), for as long as
    they lower the residual.
    """
    inverse_r_bt = _checked(a, b, q, r)
    if not q.any() and (np.linalg.eigvals(a).real < 0).all():
        return np.zeros_like(a, dtype=float), 0.0  # doing nothing costs nothing; computed, it would be relative noise
    try:
        x = _schur_solution(a, b @ np.linalg.inv(np.linalg.cholesky(r)).T, q)
    except (LinAlgError, ValueError) as error:
        raise NumericsError(
            "the Riccati equation has no stabilising solution: the control does not reach an unstable state, or the "
            "cost does not see a state on the imaginary axis"
        ) from error
    x = (x + x.T) / 2.0
    if not (np.linalg.eigvals(a - b @ inverse_r_bt @ x).real < 0).all():
        raise NumericsError("the solution found for the Riccati equation does not stabilise")
    residual = _residual(a, b @ inverse_r_bt, q, x)
    for _ in range(REFINEMENTS):
        better = _newton_step(a, b, q, r, inverse_r_bt @ x)
        new_residual = _residual(a, b @ inverse_r_bt, q, better)
        if not new_residual < residual:
            break
        x, residual = better, new_residual
    if not residual <= ACCEPTED_RESIDUAL:
        raise NumericsError(f"the Riccati equation is too badly conditioned: its residual is {residual:.1e}")
    return x, residual


def _checked(a: Matrix, b: Matrix, q: Matrix, r: Matrix) -> Matrix:
    """R⁻¹ Bᵀ, after a look at the data."""
    if not all(np.isfinite(matrix).all() for matrix in (a, b, q, r)):
        raise NumericsError("the Riccati equation was given a number that is not finite")
    if not np.allclose(q, q.T, rtol=1e-12, atol=0.0):
        raise NumericsError("the state weight Q is not symmetric")
    if np.linalg.eigvalsh(q).min(initial=0.0) < -1e-12 * np.abs(q).max(initial=0.0):
        raise NumericsError("the state weight Q is not positive semidefinite")
    try:
        factor = cho_factor(r)
    except LinAlgError as error:
        raise NumericsError("the control weight R is not positive definite") from error
    return np.asarray(cho_solve(factor, b.T), dtype=float)


def _schur_solution(a: Matrix, b: Matrix, q: Matrix) -> Matrix:
    """The solution for R = 1, which badly scaled data do not spoil."""
    scale = _symplectic_scale(np.abs(a), np.abs(b @ b.T), np.abs(q))
    a, b, q = a * scale / scale[:, None], b / scale[:, None], q * np.outer(scale, scale)
    speed = float(max(np.abs(a).max(), np.abs(b @ b.T).max(), np.abs(q).max()))
    x = solve_continuous_are(a / speed, b / np.sqrt(speed), q / speed, np.eye(b.shape[1]), balanced=False)
    return np.asarray(x / np.outer(scale, scale), dtype=float)


def _symplectic_scale(a: Matrix, control: Matrix, q: Matrix) -> Matrix:
    """Powers of two t that bring t⁻¹ A t, t⁻¹ B Bᵀ t⁻¹ and t Q t to one size: Osborne's balancing, kept symplectic."""
    scale = np.ones(a.shape[0])
    for _ in range(SWEEPS):
        before = scale.copy()
        for i in range(scale.size):
            others = np.where(np.arange(scale.size) == i, 0.0, scale)
            row = (a[i] @ others + control[i] @ (1.0 / scale)) / scale[i]
            column = (a[:, i] @ np.where(others > 0, 1.0 / scale, 0.0) + q[i] @ scale) * scale[i]
            if row > 0 and column > 0:
                scale[i] *= 2.0 ** round(0.5 * np.log2(row / column))
        if (scale == before).all():
            break
    return scale


def _newton_step(a: Matrix, b: Matrix, q: Matrix, r: Matrix, gain: Matrix) -> Matrix:
    """The cost of the feedback u = −K x, an improvement on the solution that gave K."""
    closed = a - b @ gain
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of a singular equation: the residual is the judge
        x = solve_continuous_lyapunov(closed.T, -(q + gain.T @ r @ gain))
    return np.asarray((x + x.T) / 2.0, dtype=float)


def _residual(a: Matrix, control: Matrix, q: Matrix, x: Matrix) -> float:
    """Entry by entry, relative to the sizes of the products that are added up."""
    rest = a.T @ x + x @ a - x @ control @ x + q
    sizes = np.abs(a.T) @ np.abs(x) + np.abs(x) @ np.abs(a) + np.abs(x) @ np.abs(control) @ np.abs(x) + np.abs(q)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.where(sizes > 0, np.abs(rest) / sizes, 0.0)
    return float(ratios.max(initial=0.0))

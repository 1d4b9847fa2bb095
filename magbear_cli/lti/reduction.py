"""Fewer states: Hankel singular values, balanced truncation and balanced residualisation.

Poles that are not in the open left half-plane, or no farther in it than their rounding error, are split off first and
kept exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import schur, solve_sylvester
from scipy.linalg.lapack import dtrsen

from magbear_cli.errors import NumericsError
from magbear_cli.lti.balancing import with_balanced_states, with_time_unit
from magbear_cli.lti.connection import parallel
from magbear_cli.lti.eigenvalues import eigenvalues_with_error
from magbear_cli.lti.state_space import StateSpace

NEGLIGIBLE = 1e-14  # Hankel singular values below this fraction of the largest are rounding


@dataclass(frozen=True, eq=False)
class _Balanced:
    """The stable part in balanced coordinates, its Hankel singular values, and the rest, in unit time."""

    stable: StateSpace
    values: NDArray[np.float64]
    rest: StateSpace
    unit_rad_s: float


def least_order(system: StateSpace) -> int:
    """How many poles reduction keeps: those not farther left of the axis than their rounding error, or not at all."""
    return _balance(system).rest.order


def hankel_singular_values(system: StateSpace) -> NDArray[np.float64]:
    """The Hankel singular values of the stable part, descending; they do not depend on the states chosen.

    Values below 1e-14 of the largest are states that cannot be reached or seen, and are left out.
    """
    return _balance(system).values


def balanced_truncation(system: StateSpace, order: int) -> StateSpace:
    """The system with the weakest balanced states cut off, which keeps the gain at ω = ∞.

    Parameters
    ----------
    system : StateSpace
    order : states to keep, those of the unstable part included; fewer are returned when fewer matter

    Raises
    ------
    NumericsError
        when order is less than the number of poles that are kept (``least_order``).

    Notes
    -----
    The error is at most twice the sum of the Hankel singular values cut off (Moore 1981; Enns 1984; Glover 1984).
    """
    balanced = _balance(system)
    k = _kept(balanced, order)
    part = balanced.stable
    cut = StateSpace(part.a[:k, :k], part.b[:k], part.c[:, :k], part.d)
    return with_time_unit(parallel(balanced.rest, cut), 1.0 / balanced.unit_rad_s)


def balanced_residualization(system: StateSpace, order: int) -> StateSpace:
    """The system with the weakest balanced states put at rest, which keeps the gain at ω = 0 of the stable part.

    Parameters, errors and error bound are those of ``balanced_truncation`` (Fernando and Nicholson 1982).
    """
    balanced = _balance(system)
    k = _kept(balanced, order)
    part = balanced.stable
    a22_b, a22_c = _fast_part(part, k)
    rested = StateSpace(
        part.a[:k, :k] - part.a[:k, k:] @ a22_c,
        part.b[:k] - part.a[:k, k:] @ a22_b,
        part.c[:, :k] - part.c[:, k:] @ a22_c,
        part.d - part.c[:, k:] @ a22_b,
    )
    return with_time_unit(parallel(balanced.rest, rested), 1.0 / balanced.unit_rad_s)


def _fast_part(part: StateSpace, k: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A22⁻¹ B2 and A22⁻¹ A21: where the states beyond k rest."""
    right = np.hstack([part.b[k:], part.a[k:, :k]])
    solved = np.asarray(np.linalg.solve(part.a[k:, k:], right), dtype=float)
    return solved[:, : part.inputs], solved[:, part.inputs :]


def _kept(balanced: _Balanced, order: int) -> int:
    """How many stable states remain."""
    if order < balanced.rest.order:
        raise NumericsError(
            f"{balanced.rest.order} poles are not stable, or too close to the axis to tell, and are kept; "
            f"order {order} is too low"
        )
    return min(order - balanced.rest.order, balanced.stable.order)


def _balance(system: StateSpace) -> _Balanced:
    speeds = np.abs(system.poles())
    speeds = speeds[speeds > 0]
    unit = float(np.exp(np.log(speeds).mean())) if speeds.size else 1.0
    stable, rest = _stable_and_rest(with_balanced_states(with_time_unit(system, unit)))
    reach = _gramian_factor(stable.a, stable.b)
    see = _gramian_factor(stable.a.T, stable.c.T)
    u, values, vt = np.linalg.svd(see.T @ reach)
    count = int((values[: stable.order] > NEGLIGIBLE * values.max(initial=0.0)).sum())
    root = 1.0 / np.sqrt(values[:count])
    to_states = reach @ vt[:count].T * root
    from_states = (see @ u[:, :count] * root).T
    balanced = StateSpace(from_states @ stable.a @ to_states, from_states @ stable.b, stable.c @ to_states, stable.d)
    return _Balanced(balanced, values[:count], rest, unit)


def _stable_and_rest(system: StateSpace) -> tuple[StateSpace, StateSpace]:
    """The sum of a stable system with the direct gain and one that holds all other poles.

    A pole within its rounding error of the axis counts among the others: taken as stable, an integrator that was
    rounded to −1e-13 rad/s has a Hankel singular value beside which those of all other states are lost.

    The QR algorithm rounds at the size of the largest entries, but spares small ones that stand last: with fast states
    first, slow poles keep their digits (on 33 poles over six decades it is five digits of the response at rest).
    """
    system = _fast_states_first(system)
    t, z, count = _stable_first(system.a) if system.order else (system.a, system.a, 0)
    b, c = z.T @ system.b, system.c @ z
    t11, t12, t22 = t[:count, :count], t[:count, count:], t[count:, count:]
    x = solve_sylvester(t11, -t22, -t12) if 0 < count < system.order else np.zeros_like(t12)
    stable = StateSpace(t11, b[:count] - x @ b[count:], c[:, :count], system.d)
    rest = StateSpace(t22, b[count:], c[:, :count] @ x + c[:, count:], np.zeros_like(system.d))
    return stable, rest


def _stable_first(a: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """The real Schur form T, Z with A = Z T Zᵀ and the certainly stable eigenvalues first, and how many they are."""
    t, z = schur(a)
    values, errors = eigenvalues_with_error(a)
    none = np.zeros(a.shape[0], dtype=np.int32)
    _, _, real, imaginary, *_ = dtrsen(none, t, z, job="N")  # only to read the eigenvalues off T
    nearest = np.abs(values[None, :] - (real + 1j * imaginary)[:, None]).argmin(axis=1)
    stable = (real < -errors[nearest]).astype(np.int32)
    t, z, _, _, count, *_ = dtrsen(stable, t, z, job="N")
    return t, z, int(count)


def _fast_states_first(system: StateSpace) -> StateSpace:
    order = np.argsort(-np.abs(system.a).sum(axis=1), kind="stable")
    return StateSpace(system.a[np.ix_(order, order)], system.b[order], system.c[:, order], system.d)


def _gramian_factor(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """F (n, 2n) with A F Fᵀ + F Fᵀ Aᵀ + B Bᵀ = 0 for a stable A, without forming F Fᵀ (Hammarling 1982).

    Squaring would lose every Hankel singular value below 1e-8 of the largest. In complex Schur form the last row
    gives the last column of the factor, and leaves the same equation with one state less.
    """
    n = a.shape[0]
    if n == 0:
        return np.zeros((0, 0))
    t, u = schur(a, output="complex")
    rest = u.conj().T @ b.astype(complex)
    factor = np.zeros((n, n), dtype=complex)
    for k in range(n - 1, -1, -1):
        corner = np.linalg.norm(rest[k]) / np.sqrt(-2.0 * t[k, k].real)
        factor[k, k] = corner
        if corner == 0.0:
            continue
        unit = rest[k].conj() / corner
        shifted = t[:k, :k] + t[k, k].conj() * np.eye(k)
        column = -np.linalg.solve(shifted, t[:k, k] * corner + rest[:k] @ unit)
        factor[:k, k] = column
        rest[:k] -= np.outer(column, unit.conj())
    factor = u @ factor
    return np.hstack([factor.real, factor.imag])

"""Better controllers of the same order near a given one: second-order cones in the coefficients of K = X/Y.

Write the plant as n_m/d_m on the axis. Level g holds for the mass m at ω when the disc about χ_m = Y d_m − X n_m of
radius (|W1 Y d_m| + |W3 X n_m|)/g misses 0. In 1/m both centre and radius are affine, so over the mass range the discs
fill the convex hull of the two end discs, which misses 0 exactly when a half-plane Re(e^{−jφ} ·) > 0 holds both
(Rantzer and Megretski, "A convex parameterization of robustly stabilizing controllers", IEEE TAC 1994). With the
directions φ(ω) of the present controller held, the condition is a second-order cone in (X, Y). The present controller
satisfies it at its own level, and the loop stays stable for every mass: as long as Re(e^{−jφ} χ) > 0, the winding
number of χ is that of the present controller. For complex blocks the D-scales of the present controller are held, and
the set of K S that meets a level is a disc.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.conic import Cone, solve_cone_program
from magbear_cli.kernels.structured_singular_value import mu_upper_bound
from magbear_cli.model.family import Plant
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import (
    interconnection,
    open_interconnection,
    worst_level,
)
from magbear_cli.synthesis.lag_ratio import LagRatio, lag_basis
from magbear_cli.synthesis.parrott import held_scales, level_discs

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_NO_RADIUS = 1e-9  # of |χ|: where neither bound asks for anything, the direction is that of χ alone


@dataclass(frozen=True)
class ConeRows:
    """At each row r: Σ_k mix[r, k] |moduli[k]·v| ≤ Re(side[r]·v), with v the coefficients of X, then of Y."""

    moduli: Complexes  # (k, 2n + 2)
    mix: sparse.csr_matrix  # (r, k)
    side: Complexes  # (r, 2n + 2)


def plant_factors(problem: ControlProblem, omega: Floats, plant: Plant) -> tuple[Floats, Floats, Floats, Floats]:
    """d, n, |W1 d| and |W3 n| of a plant n/d, over (a_0 + ω²) of the nominal one, each finite at ω = ∞ too."""
    finite = np.isfinite(omega)
    squared = np.where(finite, omega, 1.0) ** 2
    common = problem.nominal.pole_squared + squared
    a, b = plant.pole_squared, plant.acceleration_per_current
    d = np.where(finite, -(squared + a) / common, -1.0)
    n = np.where(finite, b / common, 0.0)
    w1 = np.where(finite, problem.performance_bound(np.sqrt(squared)), problem.performance_at_infinity())
    w3_n = np.zeros_like(squared)
    if problem.omega_c_rad_s is not None:
        w3_n = np.where(finite, squared * b / common, b) / problem.omega_c_rad_s**2
    return d, n, w1 * np.abs(d), w3_n


def real_mass_level(problem: ControlProblem, controller: Complexes, omega: Floats) -> Floats:
    """The exact worst case over the real mass range at each frequency."""
    return worst_level(problem, controller, omega)[0]


def real_mass_rows(problem: ControlProblem, ratio: LagRatio, omega: Floats, level: float) -> ConeRows:
    """The half-plane condition at both end masses, in the direction that the present controller likes best."""
    basis = lag_basis(ratio.poles, omega)
    zero = np.zeros_like(basis)
    numerator, denominator = basis @ ratio.x, basis @ ratio.y
    factors = [plant_factors(problem, omega, plant) for plant in problem.family.ends]
    vectors = []
    for d, n, w1_d, w3_n in factors:
        chi = denominator * d - numerator * n
        radius = w1_d * np.abs(denominator) + w3_n * np.abs(numerator)
        vectors.append(over_radius(chi, radius))
    rotation = np.conj(nearest_direction(vectors[0], vectors[-1]))
    moduli = np.concatenate([np.hstack([zero, basis]), np.hstack([basis, zero])])
    sides, mixes = [], []
    for d, n, w1_d, w3_n in factors:
        sides.append(level * rotation[:, None] * np.hstack([-basis * n[:, None], basis * d[:, None]]))
        mixes.append(sparse.hstack([sparse.diags(w1_d), sparse.diags(w3_n)]))
    return ConeRows(moduli, sparse.csr_matrix(sparse.vstack(mixes)), np.concatenate(sides))


def over_radius(centre: Complexes, radius: Floats) -> Complexes:
    """The centres of discs over their radii, of one shape; large and finite where there is no radius."""
    return np.asarray(centre / np.maximum(radius, np.maximum(_NO_RADIUS * np.abs(centre), np.finfo(float).tiny)))


def nearest_direction(first: Complexes, last: Complexes) -> Complexes:
    """The direction of the point nearest to 0 on the segment between two points, for arrays of segments."""
    step = last - first
    along = np.clip(-(np.conj(step) * first).real / np.maximum(np.abs(step) ** 2, 1e-300), 0.0, 1.0)
    nearest = first + along * step
    return np.asarray(nearest / np.maximum(np.abs(nearest), 1e-300))


def complex_mu_level(problem: ControlProblem, controller: Complexes, omega: Floats) -> Floats:
    """The structured singular value with complex blocks (its upper bound, exact for three scalar blocks)."""
    return np.asarray(mu_upper_bound(interconnection(problem, controller, omega))[0])


def complex_mu_rows(problem: ControlProblem, ratio: LagRatio, omega: Floats, level: float) -> ConeRows:
    """|K S − centre| ≤ radius with K S = X d/(Y d − X n), cleared of its denominator in the present direction."""
    basis = lag_basis(ratio.poles, omega)
    numerator, denominator = basis @ ratio.x, basis @ ratio.y
    d, n, _, _ = plant_factors(problem, omega, problem.nominal)
    scales = held_scales(interconnection(problem, numerator / denominator, omega), level)
    discs = level_discs(open_interconnection(problem, omega), scales, level)
    chi = denominator * d - numerator * n
    rotation = np.conj(chi) / np.abs(chi)
    x_chi, y_chi = -basis * n[:, None], basis * d[:, None]
    size = np.maximum(np.abs(discs.centre) + np.abs(discs.radius), 1e-300)
    centre, radius = discs.centre / size, discs.radius / size
    x_part = basis * (d / size)[:, None] - centre[:, None] * x_chi
    moduli = np.hstack([x_part, -centre[:, None] * y_chi])
    side = (radius * rotation)[:, None] * np.hstack([x_chi, y_chi])
    return ConeRows(moduli, sparse.csr_matrix(sparse.identity(omega.size)), side)


def control_rows(problem: ControlProblem, ratio: LagRatio, omega: Floats, bound: float) -> ConeRows:
    """|K S| ≤ bound at the nominal mass, with K S = X d/(Y d − X n) cleared of its denominator likewise."""
    basis = lag_basis(ratio.poles, omega)
    d, n, _, _ = plant_factors(problem, omega, problem.nominal)
    chi = (basis @ ratio.y) * d - (basis @ ratio.x) * n
    rotation = np.conj(chi) / np.abs(chi)
    moduli = np.asarray(np.hstack([basis * d[:, None], np.zeros_like(basis)]), dtype=complex)
    side = np.asarray(bound * rotation[:, None] * np.hstack([-basis * n[:, None], basis * d[:, None]]), dtype=complex)
    return ConeRows(moduli, sparse.csr_matrix(sparse.identity(omega.size)), side)


def both(first: ConeRows, second: ConeRows) -> ConeRows:
    """The rows of two conditions on the same coefficients."""
    mix = sparse.csr_matrix(sparse.block_diag([first.mix, second.mix]))
    moduli = np.asarray(np.concatenate([first.moduli, second.moduli]), dtype=complex)
    return ConeRows(moduli, mix, np.asarray(np.concatenate([first.side, second.side]), dtype=complex))


def widest_margin(rows: ConeRows, ratio: LagRatio, fastest_pole: float) -> tuple[LagRatio, float]:
    """The controller with the largest relative margin s in Σ mix |moduli·v| + s·(present side) ≤ Re(side·v).

    The sum of the controller's poles, −Σ p_k (1 + y_k), is held above −fastest_pole: without that bound a descent may
    trade a little for a pole at no frequency that anybody builds.

    Raises
    ------
    NumericsError
        when the cone program has no answer.
    """
    size = ratio.poles.size + 1
    present = np.concatenate([ratio.x, ratio.y])
    unit = np.concatenate([np.full(size, np.abs(ratio.x).max()), np.ones(size)])
    weight = np.maximum(np.abs((rows.side @ present).real), 1e-300)
    moduli, side = rows.moduli * unit, (rows.side * unit / weight[:, None]).real
    # A modulus is measured in its largest admissible size, so that all auxiliary variables are near one.
    mix = sparse.diags(1.0 / weight) @ rows.mix
    largest = np.maximum(np.abs(rows.moduli @ present), 1e-12 * np.abs(moduli).max(axis=1))
    moduli, mix = moduli / largest[:, None], mix @ sparse.diags(largest)
    count, rows_count, unknowns = moduli.shape[0], side.shape[0], 2 * size
    linear = sparse.hstack([sparse.csr_matrix(-side), mix, sparse.csr_matrix(-np.ones((rows_count, 1)))])
    stacked = np.zeros((3 * count, unknowns))
    stacked[1::3], stacked[2::3] = -moduli.real, -moduli.imag
    places = (np.arange(0, 3 * count, 3), np.arange(count))
    tops = sparse.csr_matrix((-np.ones(count), places), shape=(3 * count, count))
    cones = sparse.hstack([sparse.csr_matrix(stacked), tops, sparse.csr_matrix((3 * count, 1))])
    ends = sparse.lil_matrix((3, unknowns + count + 1))  # y0 = 1; margin ≥ −10, so that it is bounded; pole sum
    ends[0, size], ends[1, unknowns + count] = 1.0, -1.0
    ends[2, size + 1 : unknowns] = ratio.poles / fastest_pole
    bounds = [1.0, 10.0, 1.0 - float(ratio.poles.sum()) / fastest_pole]
    cost = np.zeros(unknowns + count + 1)
    cost[-1] = 1.0
    answer = solve_cone_program(
        cost,
        sparse.vstack([linear, cones, ends]),
        np.concatenate([np.zeros(rows_count + 3 * count), bounds]),
        [(Cone.NONNEGATIVE, rows_count), *[(Cone.SECOND_ORDER, 3)] * count, (Cone.ZERO, 1), (Cone.NONNEGATIVE, 2)],
        tolerance=1e-8,
    )
    if not answer.is_solved:
        raise NumericsError(f"the cone program of the descent ended as {answer.status}")
    v = answer.x[:unknowns] * unit
    return LagRatio(ratio.poles, v[:size] / v[size], v[size:] / v[size]), float(-answer.x[-1])

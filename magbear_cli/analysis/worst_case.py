"""The exact worst of |W1 S| + |W3 T| over the real mass range and all frequencies.

At a frequency ω, with x = 1/m and β = k_z + k_i K(jω),

    |W1 S| + |W3 T| = (|W1| |ω² + k_z x| + |W3| |k_i K| x)/|ω² + β x|,

a ratio of an affine function p + q x and the modulus of one. Its derivative vanishes at one x only,
x = ω² (p Re β − q ω²)/(q ω² Re β − p |β|²), so the worst of a range is at that point or at an end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.analysis.frequency_grid import closed_frequency_grid
from magbear_cli.analysis.loop_functions import controller_response
from magbear_cli.analysis.supremum import supremum
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, UncertainParameter

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class WorstCase:
    """The worst level over the mass range and all frequencies, and where it is (ω may be 0 or infinite)."""

    level: float
    mass_kg: float
    omega_rad_s: float


def worst_case_over_mass(
    problem: ControlProblem, controller_a_per_m: Complexes, omega_rad_s: Floats
) -> tuple[Floats, Floats]:
    """The largest |W1 S| + |W3 T| over the mass range at each frequency, and the mass that has it.

    Parameters
    ----------
    controller_a_per_m : (w,) array, K(jω)
    omega_rad_s : (w,) array

    Returns
    -------
    level, mass_kg : (w,) arrays
    """
    weights = (problem.performance_bound(omega_rad_s), problem.bandwidth_bound(omega_rad_s))
    return worst_weighted_sum(problem, controller_a_per_m, omega_rad_s, weights)


def worst_sensitivity_over_mass(
    problem: ControlProblem, controller_a_per_m: Complexes, omega_rad_s: Floats
) -> tuple[Floats, Floats]:
    """The largest |S| over the mass range at each frequency, and the mass that has it; shapes as for the worst case."""
    weights = (np.ones_like(omega_rad_s), np.zeros_like(omega_rad_s))
    return worst_weighted_sum(problem, controller_a_per_m, omega_rad_s, weights)


def worst_weighted_sum(
    problem: ControlProblem, controller_a_per_m: Complexes, omega_rad_s: Floats, weights: tuple[Floats, Floats]
) -> tuple[Floats, Floats]:
    """The largest w_S |S| + w_T |T| over the mass range at each frequency, and the mass that has it, each (w,)."""
    stiffness, force = problem.negative_stiffness_n_per_m, problem.current_stiffness_n_per_a * controller_a_per_m
    square = omega_rad_s**2
    alpha, beta = square + 0.0 * force, stiffness + 0.0 * force  # the closed loop is alpha + beta/m
    constant, slope = weights[0] * square, weights[0] * stiffness  # and the weighted sum above it likewise
    if problem.uncertain is UncertainParameter.MASS:
        beta, slope = beta + force, slope + weights[1] * np.abs(force)
    else:
        share = 1.0 / problem.mass.nominal_kg
        alpha, constant = alpha + share * force, constant + share * weights[1] * np.abs(force)
    both = (np.conj(alpha) * beta).real
    denominator = slope * both - constant * np.abs(beta) ** 2
    stationary = np.divide(
        constant * both - slope * np.abs(alpha) ** 2,
        denominator,
        out=np.full(square.shape, 1.0 / problem.mass.low_kg),
        where=denominator != 0,
    )
    ends = (1.0 / problem.mass.high_kg, 1.0 / problem.mass.low_kg)
    inverse_mass = np.stack([np.full(square.shape, ends[0]), np.full(square.shape, ends[1]), stationary])
    inverse_mass[2] = np.clip(inverse_mass[2], *ends)
    sums = (constant + slope * inverse_mass) / np.maximum(np.abs(alpha + beta * inverse_mass), np.finfo(float).tiny)
    worst = sums.argmax(axis=0)
    columns = np.arange(square.size)
    return sums[worst, columns], np.clip(1.0 / inverse_mass[worst, columns], problem.mass.low_kg, problem.mass.high_kg)


def worst_case(problem: ControlProblem, controller: StateSpace, omega_rad_s: Floats | None = None) -> WorstCase:
    """The supremum of |W1 S| + |W3 T| over the mass range and over ω in [0, ∞], both ends by their limits.

    It says nothing about stability: a loop that is unstable has a supremum on the axis as well.

    Parameters
    ----------
    omega_rad_s : (w,) the grid to start from; by default that of the loop
    """
    grid = closed_frequency_grid(problem, controller) if omega_rad_s is None else omega_rad_s

    def over_mass(omega: Floats) -> tuple[Floats, Floats]:
        return worst_case_over_mass(problem, controller_response(controller, omega), omega)

    level, omega = supremum(lambda points: over_mass(points)[0], grid, worst_case_at_infinity(problem, controller))
    mass = problem.mass.low_kg if np.isinf(omega) else float(over_mass(np.array([omega]))[1][0])
    return WorstCase(level, mass, omega)


def peak_sensitivity(problem: ControlProblem, controller: StateSpace, omega_rad_s: Floats) -> WorstCase:
    """The supremum of |S| over the mass range and all frequencies; its limit at ω → ∞ is one."""

    def over_mass(omega: Floats) -> tuple[Floats, Floats]:
        return worst_sensitivity_over_mass(problem, controller_response(controller, omega), omega)

    level, omega = supremum(lambda points: over_mass(points)[0], omega_rad_s, 1.0)
    mass = problem.mass.low_kg if np.isinf(omega) else float(over_mass(np.array([omega]))[1][0])
    return WorstCase(level, mass, omega)


def worst_case_at_infinity(problem: ControlProblem, controller: StateSpace) -> float:
    """The limit of the worst case at ω → ∞: |W1(∞)| + |K(∞)| k_i/(m_low ω_c²), as S → 1 and m ω² T → k_i K."""
    performance = performance_at_infinity(problem)
    if problem.omega_c_rad_s is None:
        return performance
    gain = abs(problem.current_stiffness_n_per_a * float(controller.d[0, 0]))
    return performance + gain / (problem.inertia_kg(problem.mass.low_kg) * problem.omega_c_rad_s**2)


def performance_at_infinity(problem: ControlProblem) -> float:
    """|W1(∞)|: the ratio of leading coefficients, zero or infinite where the degrees differ."""
    num, den = np.trim_zeros(problem.performance.num, "f"), np.trim_zeros(problem.performance.den, "f")
    if len(num) != len(den):
        return 0.0 if len(num) < len(den) else float("inf")
    return abs(float(num[0]) / float(den[0]))

"""What is measured when a controller is judged, in closed form from its frequency response K(jω).

With p = 1/m and c = k_z + k_i K the loop on the imaginary axis is S = (ω² + k_z p)/(ω² + c p), T = k_i K p/(ω² + c p).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from magbear_cli.model.problem import ControlProblem, UncertainParameter


def worst_case_over_mass(
    problem: ControlProblem, controller_a_per_m: NDArray[np.complex128], omega_rad_s: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The exact maximum over the real mass range of |W1 S| + |W3 T|, and the mass where it is taken.

    Parameters
    ----------
    controller_a_per_m : (w,) complex array, K(jω)
    omega_rad_s : (w,) array; ∞ is a legal frequency and then K is the controller's direct gain

    Returns
    -------
    level, mass_kg : (w,) arrays

    Notes
    -----
    In p the measure is (α + β p)/|a + c p| with a = ω², α = |W1| ω² and β = |W1| k_z + |W3 K| k_i (with the stiffness
    uncertain the terms of k_i go with a and α): an affine function over the norm of another. So it has one stationary
    point, p = (α Re a̅c − β |a|²)/(β Re a̅c − α |c|²), and the maximum is there or at an end of the range. Only the
    imaginary axis is looked at: stability is another question.
    """
    finite = np.isfinite(omega_rad_s)
    omega = np.where(finite, omega_rad_s, 1.0)
    squared = omega**2
    k_z, k_i = problem.negative_stiffness_n_per_m, problem.current_stiffness_n_per_a
    w1, w3 = problem.performance_bound(omega), problem.bandwidth_bound(omega)
    force = k_i * controller_a_per_m
    alpha, beta = w1 * squared, w1 * k_z + 0.0 * squared
    constant, slope = squared + 0.0j, k_z + 0.0 * force
    if problem.uncertain is UncertainParameter.MASS:
        beta, slope = beta + w3 * np.abs(force), slope + force
    else:
        alpha = alpha + w3 * np.abs(force) / problem.mass.nominal_kg
        constant = constant + force / problem.mass.nominal_kg
    low, high = 1.0 / problem.mass.high_kg, 1.0 / problem.mass.low_kg
    with np.errstate(divide="ignore", invalid="ignore"):
        both = (np.conj(constant) * slope).real
        stationary = (alpha * both - beta * np.abs(constant) ** 2) / (beta * both - alpha * np.abs(slope) ** 2)
    middle = np.clip(np.where(np.isfinite(stationary), stationary, low), low, high)
    inverse_mass = np.stack([np.full_like(omega, low), middle, np.full_like(omega, high)])
    with np.errstate(divide="ignore", invalid="ignore"):
        levels = (alpha + beta * inverse_mass) / np.abs(constant + slope * inverse_mass)
    levels = np.where(np.isnan(levels), np.inf, levels)
    best = np.argmax(levels, axis=0)
    columns = np.arange(omega.size)
    level, mass = levels[best, columns], 1.0 / inverse_mass[best, columns]
    end = _level_at_infinity(problem, controller_a_per_m)
    return np.where(finite, level, end), np.where(finite, mass, problem.mass.low_kg)


def _level_at_infinity(problem: ControlProblem, gain_a_per_m: NDArray[np.complex128]) -> NDArray[np.float64]:
    """|W1(∞)| + lim |W3 T|: there S = 1 and W3 T = k_i K/(m ω_c²), largest for the lightest rotor."""
    level = np.full(gain_a_per_m.shape, performance_at_infinity(problem))
    if problem.omega_c_rad_s is not None:
        lightest = problem.inertia_kg(problem.mass.low_kg)
        scale = problem.current_stiffness_n_per_a / (lightest * problem.omega_c_rad_s**2)
        level += scale * np.abs(gain_a_per_m)
    return level


def performance_at_infinity(problem: ControlProblem) -> float:
    """|W1(∞)|: zero for a strictly proper weight."""
    num, den = np.trim_zeros(problem.performance.num, "f"), np.trim_zeros(problem.performance.den, "f")
    return abs(num[0] / den[0]) if len(num) == len(den) else 0.0


def open_interconnection(
    problem: ControlProblem, omega_rad_s: NDArray[np.float64]
) -> tuple[NDArray[np.complex128], NDArray[np.complex128], NDArray[np.complex128]]:
    """P11, P12, P21 of the uncertain loop about the nominal mass: the closed loop is P11 + P12 (K S) P21.

    Channels, in this order, where they exist: the mass (an input of acceleration Δ·δ·q, an output of force
    q = k_z z + k_i u; with the stiffness uncertain q = k_z z), W1 on the measured position, W3 on the rotor's position.
    Both bounds are driven by the disturbance of the measurement.

    Returns
    -------
    p11 : (w, n, n), p12 : (w, n), p21 : (w, n) complex arrays, in units scaled so that every channel is near one

    Notes
    -----
    ∞ is a legal frequency. W3 = s²/ω_c² is improper, but W3 z is proper: z follows forces like 1/s².
    """
    finite = np.isfinite(omega_rad_s)
    omega = np.where(finite, omega_rad_s, 1.0)
    squared = omega**2
    k_z, k_i = problem.negative_stiffness_n_per_m, problem.current_stiffness_n_per_a
    nominal, deviation = 1.0 / problem.mass.nominal_kg, problem.mass.inverse_deviation_per_kg
    denominator = squared + nominal * k_z
    # Positions are carried times k_z p, so that the mass channel has the same size as the others.
    from_acceleration = np.where(finite, -1.0 / denominator, 0.0)
    from_current = nominal * k_i * from_acceleration
    w1 = np.where(finite, problem.performance(1j * omega), performance_at_infinity(problem))
    w3_position = _weighted_position(problem, squared, denominator, finite)
    rows, columns, inputs = [], [], []
    zero = np.zeros_like(omega, dtype=complex)
    if not problem.mass.is_fixed:
        unit = nominal * k_z
        rows.append([deviation * k_z * from_acceleration, zero, zero])
        coupled = k_i if problem.uncertain is UncertainParameter.MASS else 0.0
        columns.append(deviation / unit * (k_z * from_current + coupled))
        inputs.append(unit * from_acceleration)
    else:
        unit = 1.0
    rows.append([w1 * from_acceleration * unit, w1, w1])
    columns.append(w1 * from_current)
    inputs.append(zero + 1.0)
    if problem.omega_c_rad_s is not None:
        rows.append([w3_position * unit, zero, zero])
        columns.append(w3_position * nominal * k_i)
        inputs.append(zero + 1.0)
    keep = ([] if problem.mass.is_fixed else [0]) + [1, 2][: len(rows) - (not problem.mass.is_fixed)]
    p11 = np.stack([np.stack([row[index] + zero for index in keep], axis=-1) for row in rows], axis=-2)
    return p11, np.stack(columns, axis=-1) + zero[:, None], np.stack(inputs, axis=-1)


def _weighted_position(
    problem: ControlProblem,
    squared: NDArray[np.float64],
    denominator: NDArray[np.float64],
    finite: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """W3 times position over acceleration: (−ω²/ω_c²)(−1/(ω² + k_z/m)), one over ω_c² at ∞."""
    if problem.omega_c_rad_s is None:
        return np.zeros_like(squared)
    return np.where(finite, squared / denominator, 1.0) / problem.omega_c_rad_s**2


def interconnection(
    problem: ControlProblem, controller_a_per_m: NDArray[np.complex128], omega_rad_s: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """The closed uncertain loop M(jω), (w, n, n): its structured singular value is the peak mu of a design."""
    p11, p12, p21 = open_interconnection(problem, omega_rad_s)
    ks = control_sensitivity(problem, controller_a_per_m, omega_rad_s)
    return p11 + ks[:, None, None] * p12[:, :, None] * p21[:, None, :]


def control_sensitivity(
    problem: ControlProblem, controller_a_per_m: NDArray[np.complex128], omega_rad_s: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """K S at the nominal mass, in A/m, (w,)."""
    finite = np.isfinite(omega_rad_s)
    omega = np.where(finite, omega_rad_s, 1.0)
    plant = np.where(finite, problem.plant(omega, problem.mass.nominal_kg), 0.0)
    return np.asarray(controller_a_per_m / (1.0 - controller_a_per_m * plant))

"""What is measured when a controller is judged, in closed form from its frequency response K(jω).

With a = k_z/m and b = k_i/m of a member (``model.family``) the loop on the imaginary axis is
S = (ω² + a)/(ω² + a + b K) and T = b K/(ω² + a + b K). ∞ is a legal frequency everywhere.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from magbear_cli.model.family import FIRST, LAST, NOMINAL
from magbear_cli.model.problem import ControlProblem

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def worst_level(problem: ControlProblem, controller_a_per_m: Complexes, omega_rad_s: Floats) -> tuple[Floats, Floats]:
    """The exact maximum over the family of |W1 S| + |W3 T|, and the share of the member that has it.

    Parameters
    ----------
    controller_a_per_m : (w,) complex array, K(jω); at ω = ∞ the controller's direct gain
    omega_rad_s : (w,) array

    Returns
    -------
    level, share : (w,) arrays
    """
    omega = np.where(np.isfinite(omega_rad_s), omega_rad_s, 1.0)
    weights = problem.performance_bound(omega), problem.bandwidth_bound(omega)
    level, share = worst_weighted_sum(problem, controller_a_per_m, omega, weights)
    end = problem.level_at_infinity(controller_a_per_m)
    finite = np.isfinite(omega_rad_s)
    return np.where(finite, level, end), np.where(finite, share, FIRST)


def worst_sensitivity(
    problem: ControlProblem, controller_a_per_m: Complexes, omega_rad_s: Floats
) -> tuple[Floats, Floats]:
    """The largest |S| over the family at each finite frequency, and the share that has it; shapes as for the level."""
    weights = (np.ones_like(omega_rad_s), np.zeros_like(omega_rad_s))
    return worst_weighted_sum(problem, controller_a_per_m, omega_rad_s, weights)


def worst_weighted_sum(
    problem: ControlProblem, controller_a_per_m: Complexes, omega_rad_s: Floats, weights: tuple[Floats, Floats]
) -> tuple[Floats, Floats]:
    """The largest w_S |S| + w_T |T| over the family at each finite frequency, and the share that has it, each (w,).

    Notes
    -----
    Along the family a and b are affine in the share, so the sum is (p + q t)/|α + β t|: an affine function over the
    modulus of another. Its derivative vanishes at one t only, (p Re ᾱβ − q |α|²)/(q Re ᾱβ − p |β|²), so that the
    maximum is there or at an end. Where the loop has a pole on the axis it is infinite.
    """
    family, square = problem.family, omega_rad_s**2
    first_a, first_b = family.pole_squared(FIRST), family.acceleration_per_current(FIRST)
    step_a, step_b = family.pole_squared(LAST) - first_a, family.acceleration_per_current(LAST) - first_b
    alpha, beta = square + first_a + first_b * controller_a_per_m, step_a + step_b * controller_a_per_m
    gain = np.abs(controller_a_per_m)
    constant = weights[0] * (square + first_a) + weights[1] * gain * first_b
    slope = weights[0] * step_a + weights[1] * gain * step_b
    if family.is_fixed:
        shares = np.full((1, square.size), FIRST)
    else:
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            both = (np.conj(alpha) * beta).real
            stationary = (constant * both - slope * np.abs(alpha) ** 2) / (slope * both - constant * np.abs(beta) ** 2)
        inner = np.clip(np.where(np.isfinite(stationary), stationary, FIRST), FIRST, LAST)
        shares = np.stack([np.full(square.size, FIRST), inner, np.full(square.size, LAST)])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        levels = (constant + slope * shares) / np.abs(alpha + beta * shares)
    levels = np.where(np.isnan(levels) & ~np.isnan(controller_a_per_m), np.inf, levels)
    best = np.argmax(levels, axis=0)
    columns = np.arange(square.size)
    return levels[best, columns], shares[best, columns]


def open_interconnection(problem: ControlProblem, omega_rad_s: Floats) -> tuple[Complexes, Complexes, Complexes]:
    """P11, P12, P21 of the uncertain loop about the nominal plant: the closed loop is P11 + P12 (K S) P21.

    With δ in [−1, 1] and half the changes Δa and Δb of the family, s² z = a z + b u + p, p = δ q, q = Δa z + Δb u.
    Channels, in this order, where they exist: the uncertain one from p to q, W1 on the measured position, W3 on the
    rotor's position. Both bounds are driven by the disturbance of the measurement.

    Returns
    -------
    p11 : (w, n, n), p12 : (w, n), p21 : (w, n) complex arrays, in units scaled so that every channel is near one
    """
    family, nominal = problem.family, problem.nominal
    a, b = nominal.pole_squared, nominal.acceleration_per_current
    spread_a, spread_b = family.spread
    finite = np.isfinite(omega_rad_s)
    omega = np.where(finite, omega_rad_s, 1.0)
    squared = omega**2
    from_acceleration = np.where(finite, -1.0 / (squared + a), 0.0)
    w1 = np.where(finite, problem.performance(1j * omega), problem.performance_at_infinity())
    w3_position = _weighted_position(problem, squared, squared + a, finite)
    rows, columns, inputs = [], [], []
    zero = np.zeros_like(omega, dtype=complex)
    unit = 1.0 if family.is_fixed else a  # positions are carried times a, so that the channels have the same size
    if not family.is_fixed:
        rows.append([spread_a * from_acceleration, zero, zero])
        columns.append((spread_a * b * from_acceleration + spread_b) / unit)
        inputs.append(unit * from_acceleration)
    rows.append([w1 * from_acceleration * unit, w1, w1])
    columns.append(w1 * b * from_acceleration)
    inputs.append(zero + 1.0)
    if problem.omega_c_rad_s is not None:
        rows.append([w3_position * unit, zero, zero])
        columns.append(w3_position * b)
        inputs.append(zero + 1.0)
    keep = ([] if family.is_fixed else [0]) + [1, 2][: len(rows) - (not family.is_fixed)]
    p11 = np.stack([np.stack([row[index] + zero for index in keep], axis=-1) for row in rows], axis=-2)
    return p11, np.stack(columns, axis=-1) + zero[:, None], np.stack(inputs, axis=-1)


def _weighted_position(
    problem: ControlProblem, squared: Floats, denominator: Floats, finite: NDArray[np.bool_]
) -> Floats:
    """W3 times position over acceleration: (−ω²/ω_c²)(−1/(ω² + a)), one over ω_c² at ∞: proper, though W3 is not."""
    if problem.omega_c_rad_s is None:
        return np.zeros_like(squared)
    return np.where(finite, squared / denominator, 1.0) / problem.omega_c_rad_s**2


def interconnection(problem: ControlProblem, controller_a_per_m: Complexes, omega_rad_s: Floats) -> Complexes:
    """The closed uncertain loop M(jω), (w, n, n): its structured singular value is the peak mu of a design.

    Notes
    -----
    Formed from closed expressions, which do not cancel where P11 + P12 (K S) P21 does: with c = ω² + a + b K,
    q/p = −(Δa + Δb K)/c, q/d = −K (Δa b − Δb (ω² + a))/c, z/p = −1/c, z/d = −b K/c, (z + d)/d = (ω² + a)/c.
    """
    family, nominal = problem.family, problem.nominal
    a, b = nominal.pole_squared, nominal.acceleration_per_current
    spread_a, spread_b = family.spread
    gain, finite = np.asarray(controller_a_per_m, dtype=complex), np.isfinite(omega_rad_s)
    squared = np.where(finite, omega_rad_s, 1.0) ** 2
    closed = np.where(finite, squared + a + b * gain, 1.0)
    unit = a  # of the uncertain channel, as in the open interconnection
    at_rest = np.where(finite, squared + a, 1.0)
    w1 = np.where(finite, problem.performance(1j * np.sqrt(squared)), problem.performance_at_infinity())
    w3 = np.zeros_like(squared)
    if problem.omega_c_rad_s is not None:
        w3 = np.where(finite, squared, 1.0) / problem.omega_c_rad_s**2
    matrix = np.empty((squared.size, 3, 3), dtype=complex)
    matrix[:, 0, 0] = np.where(finite, -(spread_a + spread_b * gain) / closed, 0.0)
    driven = np.where(finite, spread_a * b - spread_b * (squared + a), -spread_b)
    matrix[:, 0, 1] = -gain * driven / (closed * unit)
    matrix[:, 1, 0] = np.where(finite, -w1 * unit / closed, 0.0)
    matrix[:, 1, 1] = w1 * at_rest / closed
    matrix[:, 2, 0] = w3 * unit / closed
    matrix[:, 2, 1] = w3 * b * gain / closed
    matrix[:, :, 2] = matrix[:, :, 1]
    channels = ([] if family.is_fixed else [0]) + [1] + ([] if problem.omega_c_rad_s is None else [2])
    return np.ascontiguousarray(matrix[:, channels][:, :, channels])


def control_sensitivity(problem: ControlProblem, controller_a_per_m: Complexes, omega_rad_s: Floats) -> Complexes:
    """K S of the nominal plant, in A/m, (w,)."""
    finite = np.isfinite(omega_rad_s)
    omega = np.where(finite, omega_rad_s, 1.0)
    plant = np.where(finite, problem.plant(omega, NOMINAL), 0.0)
    return np.asarray(controller_a_per_m / (1.0 - controller_a_per_m * plant))

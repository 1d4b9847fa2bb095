"""The loop as a matrix with scalar blocks, and its structured singular value over frequency.

With 1/m = 1/m_n + Δ δ, q = k_z z + k_i u the force on the rotor and p = Δ δ q, the loop is s² z = q/m_n + p,
y = z + d1 + d3, u = K y, e1 = W1 y, e3 = W3 z (thesis eqs. 2.16-2.21, with the way from p to e3 kept). M maps
(p, d1, d3) to (Δ q, e1, e3). The mass channel is absent when the mass is known, the last one without a bandwidth limit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.analysis.loop_functions import controller_response
from magbear_cli.analysis.supremum import supremum
from magbear_cli.analysis.worst_case import performance_at_infinity
from magbear_cli.kernels.structured_singular_value import mu_bounds, mu_upper_bound
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, UncertainParameter

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_FLATNESS_BAND_RAD_S = (10.0, 1e5)
_FLATNESS_POINTS = 241


@dataclass(frozen=True, eq=False)
class MuStudy:
    """Both bounds of mu over frequency, and the supremum of each (ω may be 0 or infinite)."""

    omega_rad_s: Floats  # (w,)
    upper: Floats  # (w,)
    lower: Floats  # (w,)
    peak_upper: float
    peak_lower: float
    peak_omega_rad_s: float
    flatness: float  # 1 − min/max of the upper bound over 10 … 1e5 rad/s


def uncertain_loop(problem: ControlProblem, controller_a_per_m: Complexes, omega_rad_s: Floats) -> Complexes:
    """M(jω) of shape (w, n, n), channels in the order mass, W1, W3, as many as the problem has.

    With D = m ω² + k_z + k_i K (the negative of the usual denominator) and s² = −ω²,
    M = [Δm(k_z + k_i K), −Δmω²k_i K, …; W1 m, −W1(mω² + k_z), …; W3 m, W3 k_i K, …]/(−D), rows for Δq, e1, e3, and the
    columns of d1 and d3 alike. The mass channel is scaled by ω² + k_z/m, which changes no structured singular value.

    Parameters
    ----------
    controller_a_per_m : (w,) array, K(jω)
    omega_rad_s : (w,) array of finite frequencies
    """
    mass, square = problem.mass.nominal_kg, omega_rad_s**2
    deviation = problem.mass.inverse_deviation_per_kg
    stiffness, force = problem.negative_stiffness_n_per_m, problem.current_stiffness_n_per_a * controller_a_per_m
    closed = -(mass * square + stiffness + force)
    scale = square + abs(stiffness) / mass
    w1, w3 = problem.performance(1j * omega_rad_s), -problem.bandwidth_bound(omega_rad_s)
    matrix = np.empty((omega_rad_s.size, 3, 3), dtype=complex)
    if problem.uncertain is UncertainParameter.MASS:
        matrix[:, 0, 0] = deviation * mass * (stiffness + force) / closed
        matrix[:, 0, 1] = -deviation * mass * (square / scale) * force / closed
    else:  # the channel carries k_z z alone
        matrix[:, 0, 0] = deviation * mass * stiffness / closed
        matrix[:, 0, 1] = deviation * (stiffness / scale) * force / closed
    matrix[:, 1, 0] = w1 * mass * scale / closed
    matrix[:, 1, 1] = -w1 * (mass * square + stiffness) / closed
    matrix[:, 2, 0] = w3 * mass * scale / closed
    matrix[:, 2, 1] = w3 * force / closed
    matrix[:, :, 2] = matrix[:, :, 1]
    return _present(problem, matrix)


def uncertain_loop_at_infinity(problem: ControlProblem, controller: StateSpace) -> Complexes:
    """The limit of M at ω → ∞, of shape (1, n, n), where S → 1 and ω² times the rotor's receptance → −1/m.

    The mass channel is scaled otherwise than at finite frequencies (p times −1/ω²): mu does not know.
    """
    mass = problem.mass.nominal_kg
    force = problem.current_stiffness_n_per_a * float(controller.d[0, 0])
    inverse_square = 0.0 if problem.omega_c_rad_s is None else problem.omega_c_rad_s**-2
    w1 = performance_at_infinity(problem)
    matrix = np.zeros((1, 3, 3), dtype=complex)
    if problem.uncertain is UncertainParameter.MASS:
        matrix[0, 0, 1] = problem.mass.inverse_deviation_per_kg * force
    matrix[0, 1, 1] = w1
    matrix[0, 2, 0] = inverse_square
    matrix[0, 2, 1] = inverse_square * force / mass
    matrix[:, :, 2] = matrix[:, :, 1]
    return _present(problem, matrix)


def mu_upper(problem: ControlProblem, controller: StateSpace, omega_rad_s: Floats) -> Floats:
    """The upper bound of mu of the loop at finite frequencies, (w,)."""
    matrices = uncertain_loop(problem, controller_response(controller, omega_rad_s), omega_rad_s)
    return mu_upper_bound(matrices)[0]


def mu_flatness(problem: ControlProblem, controller: StateSpace) -> float:
    """1 − min/max of the upper bound of mu over 10 … 1e5 rad/s: zero for a loop with nothing left to trade."""
    upper = mu_upper(problem, controller, np.geomspace(*_FLATNESS_BAND_RAD_S, _FLATNESS_POINTS))
    return float(1.0 - upper.min() / upper.max())


def mu_study(problem: ControlProblem, controller: StateSpace, omega_rad_s: Floats) -> MuStudy:
    """Both bounds of mu on a grid, with their suprema refined between its points and both ends by their limits.

    Parameters
    ----------
    omega_rad_s : (w,) ascending grid, which may start with zero
    """

    def bounds(omega: Floats) -> tuple[Floats, Floats]:
        return mu_bounds(uncertain_loop(problem, controller_response(controller, omega), omega))

    upper, lower = bounds(omega_rad_s)
    end_upper, end_lower = mu_bounds(uncertain_loop_at_infinity(problem, controller))
    peak, omega = supremum(lambda points: mu_upper(problem, controller, points), omega_rad_s, float(end_upper[0]))
    at_peak = float(end_lower[0]) if np.isinf(omega) else float(bounds(np.array([omega]))[1][0])
    peak_lower = max(at_peak, float(lower.max()), float(end_lower[0]))
    return MuStudy(omega_rad_s, upper, lower, peak, peak_lower, omega, mu_flatness(problem, controller))


def _present(problem: ControlProblem, matrix: Complexes) -> Complexes:
    channels = ([] if problem.mass.is_fixed else [0]) + [1] + ([] if problem.omega_c_rad_s is None else [2])
    return np.ascontiguousarray(matrix[:, channels][:, :, channels])

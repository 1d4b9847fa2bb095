"""Linear quadratic Gaussian control: the optimal state feedback on the optimal estimate, at the nominal mass.

The state is x = (z, z') of m z'' = k_z z + k_i u, the measurement is z, and u = −K x̂.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError, Status
from magbear_cli.kernels.riccati import solve_care
from magbear_cli.lti.connection import feedback
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem
from magbear_cli.synthesis.design import Design

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class LqgOptions:
    """The cost zᵀQz + R u² and the noise intensities, as in the thesis's section 2.3.1.

    ``q`` is the diagonal of Q over (z, z'), per m² and per (m/s)²; ``r`` is R, per A²; ``xi`` is the intensity of the
    disturbing force, N² s; ``theta`` that of the measurement noise, m² s.
    """

    q: tuple[float, float] = (1.0, 1e-5)
    r: float = 3e-9
    xi: float = 1.0
    theta: float = 1e-15

    def __post_init__(self) -> None:
        """Refuse weights of the wrong sign."""
        require_weights(self.q, "q", self.r, "r")
        require_weights((self.xi,), "xi", self.theta, "theta")


def require_weights(semidefinite: tuple[float, ...], first: str, positive: float, second: str) -> None:
    """Refuse, by name, a weight that is negative or not finite, or a divisor that is not positive."""
    if not all(0 <= value < np.inf for value in semidefinite):
        raise NumericsError(f"{first} must hold finite numbers that are not negative, not {list(semidefinite)}")
    if not 0 < positive < np.inf:
        raise NumericsError(f"{second} must be a positive number, not {positive}")


@dataclass(frozen=True, eq=False)
class Gain:
    """A gain (2,), the solution (2, 2) of its Riccati equation with the weights of that equation, and its residual."""

    gain: Matrix
    riccati: Matrix
    residual: float
    state_weight: Matrix
    signal_weight: float


def design_lqg(problem: ControlProblem, options: LqgOptions | None = None) -> Design:
    """The LQG controller of the nominal rotor, x̂' = (A − B K − H C) x̂ + H y, u = −K x̂.

    ``level`` stays without a value: a quadratic cost is no robust performance level. ``statistics`` holds that cost,
    the gains and the residuals of both Riccati equations. Status ``failed`` when an equation has no solution.
    """
    options = options or LqgOptions()
    try:
        control = lqr_gain(problem, np.diag(options.q), options.r)
        force = np.array([[0.0], [1.0 / problem.nominal.mass_kg]])
        estimate = kalman_gain(problem, options.xi * force @ force.T, options.theta)
        return observer_design(problem, control, estimate)
    except NumericsError as error:
        return Design(None, Status.FAILED, str(error))


def lqr_gain(problem: ControlProblem, state_weight: Matrix, control_weight: float) -> Gain:
    """K = R⁻¹ Bᵀ X in (A/m, A s/m), the feedback u = −K x that minimises ∫ xᵀQx + R u² dt.

    Raises
    ------
    NumericsError
        when the weights are not of the required sign or the equation has no stabilising solution.
    """
    a, b, _ = rotor_matrices(problem)
    x, residual = solve_care(a, b, state_weight, np.array([[control_weight]]))
    return Gain((b.T @ x)[0] / control_weight, x, residual, state_weight, control_weight)


def kalman_gain(problem: ControlProblem, process_covariance: Matrix, measurement_covariance: float) -> Gain:
    """H = P Cᵀ Θ⁻¹ in (1/s, 1/s²), the filter x̂' = A x̂ + H (y − C x̂) with the least error covariance P.

    Parameters
    ----------
    process_covariance : (2, 2) intensity of the noise on (z', z'')
    measurement_covariance : Θ in m² s

    Raises
    ------
    NumericsError
        when the covariances are not of the required sign or the equation has no stabilising solution.
    """
    a, _, c = rotor_matrices(problem)
    p, residual = solve_care(a.T, c.T, process_covariance, np.array([[measurement_covariance]]))
    return Gain((p @ c.T)[:, 0] / measurement_covariance, p, residual, process_covariance, measurement_covariance)


def rotor_matrices(problem: ControlProblem) -> tuple[Matrix, Matrix, Matrix]:
    """A, B, C of the nominal rotor from the current to the position (the thesis, eqs. 2.5-2.7)."""
    nominal = problem.nominal
    a = np.array([[0.0, 1.0], [nominal.pole_squared, 0.0]])
    b = np.array([[0.0], [nominal.acceleration_per_current]])
    return a, b, np.array([[1.0, 0.0]])


def observer_design(problem: ControlProblem, control: Gain, estimate: Gain) -> Design:
    """The estimator and the state feedback joined into one controller, its loop closed and its poles looked at."""
    a, b, c = rotor_matrices(problem)
    k, h = control.gain[None, :], estimate.gain[:, None]
    controller = StateSpace(a - b @ k - h @ c, h, -k, np.zeros((1, 1)))
    loop = feedback(StateSpace(a, b, c, np.zeros((1, 1))), controller)
    slowest = float(loop.poles().real.max())
    # What the disturbance costs when the state is known, plus what it costs to act on an estimate.
    known = float(np.trace(control.riccati @ estimate.state_weight))
    cost = known + control.signal_weight * float((k @ estimate.riccati @ k.T)[0, 0])
    statistics = {
        "quadratic_cost": cost,
        "gain_position_a_per_m": float(control.gain[0]),
        "gain_speed_a_s_per_m": float(control.gain[1]),
        "filter_gain_position_per_s": float(estimate.gain[0]),
        "filter_gain_speed_per_s2": float(estimate.gain[1]),
        "control_riccati_residual": control.residual,
        "filter_riccati_residual": estimate.residual,
        "slowest_pole_rad_s": slowest,
    }
    if slowest >= 0.0:
        return Design(
            controller, Status.UNSTABLE, "the closed loop is unstable in double precision", statistics=statistics
        )
    return Design(controller, Status.OK, statistics=statistics)

"""LQG with loop transfer recovery: the loop of a Kalman filter, recovered by a feedback with cheap control.

The filter loop, open at C (s I − A)⁻¹ H, is shaped first. As R falls, the loop of the plant with the controller tends
to it, because the rotor has no zeros (Doyle and Stein 1979); a weight on the speed stops it a little short.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError, Status
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.family import NOMINAL
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.table import Column, Table
from magbear_cli.synthesis.design import Design
from magbear_cli.synthesis.lqg import Gain, kalman_gain, lqr_gain, observer_design, require_weights, rotor_matrices

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class LqgLtrOptions:
    """The filter's covariances and the recovery's weights, as in the thesis's program A.3.

    ``xi`` is the diagonal of the process covariance over (z', z''), in m²/s and m²/s³; ``theta`` that of the
    measurement, m² s; ``q`` the diagonal of Q over (z, z'), per m² and per (m/s)²; ``r`` is R, per A².
    """

    xi: tuple[float, float] = (1e-7, 50.0)
    theta: float = 8e-9
    q: tuple[float, float] = (1e6, 1e-3)
    r: float = 1e-10

    def __post_init__(self) -> None:
        """Refuse weights of the wrong sign."""
        require_weights(self.q, "q", self.r, "r")
        require_weights(self.xi, "xi", self.theta, "theta")


def design_lqg_ltr(problem: ControlProblem, options: LqgLtrOptions | None = None) -> Design:
    """The LQG/LTR controller of the nominal rotor, of two states.

    ``level`` stays without a value: nothing is minimised that compares with a robust performance level.
    ``statistics`` holds the gains, the residuals, and ``recovery_error``: the largest distance over frequency between
    the sensitivity of the loop and that of the filter; the table ``recovery`` has both loops over frequency. Status
    ``failed`` when an equation has no solution.
    """
    options = options or LqgLtrOptions()
    try:
        estimate = kalman_gain(problem, np.diag(options.xi), options.theta)
        control = lqr_gain(problem, np.diag(options.q), options.r)
        design = observer_design(problem, control, estimate)
    except NumericsError as error:
        return Design(None, Status.FAILED, str(error))
    if design.controller is None:
        return design
    omega = problem.natural_rad_s * np.geomspace(1e-3, 1e5, 801)
    target = frequency_response(filter_loop(problem, estimate), omega)[:, 0, 0]
    gain = frequency_response(design.controller, omega)[:, 0, 0]
    sensitivity = 1.0 / (1.0 - gain * problem.plant(omega, NOMINAL))
    statistics = {**design.statistics, "recovery_error": float(np.abs(sensitivity - target).max())}
    tables = {"recovery": _recovery(omega, target, sensitivity)}
    return Design(design.controller, design.status, design.sentence, statistics=statistics, tables=tables)


def filter_loop(problem: ControlProblem, estimate: Gain) -> StateSpace:
    """The sensitivity 1/(1 + C (s I − A)⁻¹ H) of the filter's own loop, the target of the recovery."""
    a, _, c = rotor_matrices(problem)
    h = estimate.gain[:, None]
    return StateSpace(a - h @ c, h, -c, np.ones((1, 1)))


def _recovery(omega: Floats, target: Complexes, sensitivity: Complexes) -> Table:
    """Sensitivity and complementary sensitivity in dB, of the filter's loop and of the recovered one."""
    curves = {
        "filter_sensitivity_db": (target, "sensitivity of the filter loop"),
        "sensitivity_db": (sensitivity, "sensitivity of the recovered loop"),
        "filter_complementary_db": (1.0 - target, "complementary sensitivity of the filter loop"),
        "complementary_db": (1.0 - sensitivity, "complementary sensitivity of the recovered loop"),
    }
    columns = [
        Column(name, 20.0 * np.log10(np.maximum(np.abs(values), 1e-300)), "dB", told)
        for name, (values, told) in curves.items()
    ]
    return Table((Column("omega_rad_s", omega, "rad/s", "frequency"), *columns), "gain (dB)")

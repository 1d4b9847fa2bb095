"""The structured singular value of the uncertain loop over frequency, with complex blocks, and its peak."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.analysis.loop_functions import controller_response
from magbear_cli.analysis.supremum import supremum
from magbear_cli.kernels.structured_singular_value import mu_bounds, mu_upper_bound
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import interconnection

Floats = NDArray[np.float64]

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


def mu_upper(problem: ControlProblem, controller: StateSpace, omega_rad_s: Floats) -> Floats:
    """The upper bound of mu of the loop at finite frequencies, (w,)."""
    matrices = interconnection(problem, controller_response(controller, omega_rad_s), omega_rad_s)
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
        return mu_bounds(interconnection(problem, controller_response(controller, omega), omega))

    upper, lower = bounds(omega_rad_s)
    at_infinity = interconnection(problem, controller.d[0].astype(complex), np.array([np.inf]))
    end_upper, end_lower = mu_bounds(at_infinity)
    peak, omega = supremum(lambda points: mu_upper(problem, controller, points), omega_rad_s, float(end_upper[0]))
    at_peak = float(end_lower[0]) if np.isinf(omega) else float(bounds(np.array([omega]))[1][0])
    peak_lower = max(at_peak, float(lower.max()), float(end_lower[0]))
    return MuStudy(omega_rad_s, upper, lower, peak, peak_lower, omega, mu_flatness(problem, controller))

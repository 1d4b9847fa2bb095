"""The exact worst of |W1 S| + |W3 T|, and of |S|, over the family of plants and all frequencies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.analysis.frequency_grid import closed_frequency_grid
from magbear_cli.analysis.loop_functions import controller_response
from magbear_cli.analysis.supremum import supremum
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.family import FIRST
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import worst_level, worst_sensitivity

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class WorstCase:
    """The worst level over the family and all frequencies, and where it is (ω may be 0 or infinite)."""

    level: float
    share: float  # of the member that has it
    omega_rad_s: float


def worst_case(problem: ControlProblem, controller: StateSpace, omega_rad_s: Floats | None = None) -> WorstCase:
    """The supremum of |W1 S| + |W3 T| over the family and over ω in [0, ∞], both ends by their limits.

    It says nothing about stability: a loop that is unstable has a supremum on the axis as well.

    Parameters
    ----------
    omega_rad_s : (w,) the grid to start from; by default that of the loop
    """
    grid = closed_frequency_grid(problem, controller) if omega_rad_s is None else omega_rad_s

    def over_family(omega: Floats) -> tuple[Floats, Floats]:
        return worst_level(problem, controller_response(controller, omega), omega)

    at_infinity = float(problem.level_at_infinity(float(controller.d[0, 0])))
    level, omega = supremum(lambda points: over_family(points)[0], grid, at_infinity)
    share = FIRST if np.isinf(omega) else float(over_family(np.array([omega]))[1][0])
    return WorstCase(level, share, omega)


def peak_sensitivity(problem: ControlProblem, controller: StateSpace, omega_rad_s: Floats) -> WorstCase:
    """The supremum of |S| over the family and all frequencies; its limit at ω → ∞ is one."""

    def over_family(omega: Floats) -> tuple[Floats, Floats]:
        return worst_sensitivity(problem, controller_response(controller, omega), omega)

    level, omega = supremum(lambda points: over_family(points)[0], omega_rad_s, 1.0)
    share = FIRST if np.isinf(omega) else float(over_family(np.array([omega]))[1][0])
    return WorstCase(level, share, omega)

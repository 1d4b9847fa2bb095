"""The worst case of a controller over a family of plants, from its matrices, with every peak looked into."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import worst_level
from magbear_cli.synthesis.frequency_span import frequency_span
from magbear_cli.synthesis.peak import refined_peak
from magbear_cli.synthesis.stabilisation import loop_resonances

Floats = NDArray[np.float64]

DENSE = 1200  # frequencies of an even grid to judge by


def exact_level(problem: ControlProblem, controller: StateSpace) -> float:
    """The worst case over the family and all frequencies, from the controller's matrices; every peak is refined."""
    span = frequency_span(problem)
    grid = span.grid(DENSE, margin=1e4)
    corners = np.abs(np.concatenate([problem.performance.poles_rad_s, controller.poles()]))
    local = np.multiply.outer(corners[corners > 0], np.geomspace(0.7, 1.4, 41)).ravel()
    grid = np.unique(np.concatenate([grid, local, loop_resonances(problem, controller)]))

    def level(omega: Floats) -> Floats:
        return worst_level(problem, frequency_response(controller, omega)[:, 0, 0], omega)[0]

    return refined_peak(level, grid)[0]

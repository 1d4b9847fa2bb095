"""The least peak of |K S| that still meets the specification: how much current robust performance really costs."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import control_sensitivity
from magbear_cli.synthesis.descent import Descent
from magbear_cli.synthesis.frequency_span import frequency_span, with_bandwidth
from magbear_cli.synthesis.half_plane import (
    both,
    complex_mu_level,
    complex_mu_rows,
    control_rows,
    real_mass_level,
    real_mass_rows,
    widest_margin,
)
from magbear_cli.synthesis.lag_ratio import LagRatio
from magbear_cli.synthesis.stabilisation import loop_resonances, stabilises

Floats = NDArray[np.float64]

SPECIFICATION = 0.999  # of the level asked for: what is left covers the frequencies between the grid's points
PENALTY = 1e9  # a frequency that misses the specification counts as this many times its |K S|


def least_current_descent(scaled: ControlProblem, uncertainty: Literal["real", "complex"]) -> Descent[LagRatio]:
    """The descent on the peak of |K S| at the nominal mass among controllers that meet the specification.

    It starts from one that does. Its level is that peak, in the units of the scaled problem.
    """
    span = frequency_span(with_bandwidth(scaled))
    level, rows = (real_mass_level, real_mass_rows) if uncertainty == "real" else (complex_mu_level, complex_mu_rows)

    def measure(ratio: LagRatio, omega: Floats) -> Floats:
        response = ratio.response(omega)
        current = np.abs(control_sensitivity(scaled, response, omega))
        return np.where(level(scaled, response, omega) <= 1.0, current, PENALTY * current)

    def propose(ratio: LagRatio, omega: Floats, target: float) -> tuple[LagRatio, float]:
        conditions = both(rows(scaled, ratio, omega, SPECIFICATION), control_rows(scaled, ratio, omega, target))
        return widest_margin(conditions, ratio, span.fastest_pole)

    def resonances(ratio: LagRatio) -> Floats:
        return loop_resonances(scaled, ratio.controller())

    return Descent(measure, propose, lambda ratio: stabilises(scaled, ratio.controller()), resonances)

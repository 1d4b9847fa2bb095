"""The least peak of |K S| that still meets the specification: how much current robust performance really costs."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import control_sensitivity
from magbear_cli.synthesis.descent import Descended, Descent, Grids
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
from magbear_cli.synthesis.stabilisation import stabilises

Floats = NDArray[np.float64]

SPECIFICATION = 0.999  # of the level asked for: what is left covers the frequencies between the grid's points
PENALTY = 1e9  # a frequency that misses the specification counts as this many times its |K S|


def least_current(
    scaled: ControlProblem, start: LagRatio, uncertainty: Literal["real", "complex"]
) -> Descended[LagRatio]:
    """Descend on the peak of |K S| at the nominal mass from a controller that meets the specification.

    The level of the answer is that peak, in the units of the scaled problem.
    """
    level, rows = (real_mass_level, real_mass_rows) if uncertainty == "real" else (complex_mu_level, complex_mu_rows)

    def measure(ratio: LagRatio, omega: Floats) -> Floats:
        response = ratio.response(omega)
        current = np.abs(control_sensitivity(scaled, response, omega))
        return np.where(level(scaled, response, omega) <= 1.0, current, PENALTY * current)

    def propose(ratio: LagRatio, omega: Floats, target: float) -> tuple[LagRatio, float]:
        conditions = both(rows(scaled, ratio, omega, SPECIFICATION), control_rows(scaled, ratio, omega, target))
        return widest_margin(conditions, ratio)

    span = frequency_span(with_bandwidth(scaled))
    descent = Descent(measure, propose, lambda ratio: stabilises(scaled, ratio.controller()))
    return descent.run(start, Grids(span.grid(80), span.grid(900, margin=1e4)))

"""Which frequencies a synthesis of the scaled problem looks at, and how fast its basis may be."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from magbear_cli.lti.resonance import lightly_damped, resonance_frequencies
from magbear_cli.model.problem import ControlProblem

# Without a bandwidth limit more gain always helps; the design then rolls off as if omega_c were this many times the
# fastest of the unstable pole and W1's poles, and is judged without that limit.
UNLIMITED_BANDWIDTH = 300.0
FASTEST_POLE = 30.0  # times the fastest mark: what the sum of a searched controller's poles may reach


@dataclass(frozen=True)
class FrequencySpan:
    """The slowest and the fastest frequency that shape the problem, in its own units, and those near its resonances."""

    slow: float
    fast: float
    resonances: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    weight_resonances: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))  # of its light roots themselves

    @property
    def fastest_pole(self) -> float:
        """The bound of the speed of a controller's poles."""
        return FASTEST_POLE * self.fast

    def grid(self, points: int, *, margin: float = 100.0) -> NDArray[np.float64]:
        """0, a logarithmic grid that reaches beyond both ends by the margin, points near resonances, and ∞."""
        inner = np.geomspace(self.slow / margin, self.fast * margin, points)
        return np.concatenate([[0.0], np.union1d(inner, self.resonances), [np.inf]])


def with_bandwidth(problem: ControlProblem) -> ControlProblem:
    """The problem itself, or with a wide bandwidth limit where it has none, so that the least level exists."""
    if problem.omega_c_rad_s is not None:
        return problem
    corners = np.abs(problem.performance.poles_rad_s)
    fastest = max(problem.natural_rad_s, float(corners.max(initial=0.0)))
    return replace(problem, omega_c_rad_s=UNLIMITED_BANDWIDTH * fastest)


def frequency_span(problem: ControlProblem) -> FrequencySpan:
    """From W1's corner or the unstable pole to the bandwidth limit."""
    marks = np.abs(np.concatenate([problem.performance.poles_rad_s, [problem.natural_rad_s]]))
    marks = marks[marks > 0]
    fast = max(problem.omega_c_rad_s or 0.0, float(marks.max()))
    weight = problem.performance
    roots = np.concatenate([weight.poles_rad_s, np.roots(weight.num)])
    own = np.unique(np.abs(lightly_damped(roots)))
    return FrequencySpan(float(marks.min()), fast, resonance_frequencies(roots), own)

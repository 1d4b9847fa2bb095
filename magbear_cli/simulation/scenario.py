"""What is done to the closed loop in one run: the command, the rotor, the filters, the load, and for how long."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.model.filters import Prefilter, SensorDynamics
from magbear_cli.model.rotor import FlexibleRotor

Floats = NDArray[np.float64]

SAMPLE_RUNS = 8
SHORTEST_SPAN = 1e-9  # of the duration: an edge of the pulse nearer to an end of the run is left out


@dataclass(frozen=True)
class Disturbance:
    """A rectangular pulse of force on the rotor, at the magnets."""

    force_n: float
    start_s: float
    duration_s: float

    def __post_init__(self) -> None:
        """Refuse a pulse before the beginning, without an extent, or of a force that is not finite."""
        if not (np.isfinite(self.force_n) and 0 <= self.start_s < np.inf and 0 < self.duration_s < np.inf):
            raise NumericsError(
                f"a pulse needs a force, a start from 0 s on and a duration, not {self.force_n} N "
                f"from {self.start_s} s for {self.duration_s} s"
            )

    @property
    def end_s(self) -> float:
        """When the pulse is over."""
        return self.start_s + self.duration_s


@dataclass(frozen=True)
class StepScenario:
    """A step of the command and/or a pulse of force, on a rotor that rests at the operating point.

    The loop works in deviations from the operating point (``position_m``, ``current_a``): a constant load from outside,
    zero at the origin, is taken to hold the rotor there. Gravity comes on top of it at t = 0; with
    ``gravity_compensation`` a constant current balances it there, by the exact force law in the nonlinear model.
    The stretch of an elastic rotor under its own weight is part of the position of rest.

    Attributes
    ----------
    step_m : height of the step; zero is legal
    mass_kg : the rotor's total mass
    model : ``nonlinear``, the force law; ``linear``, its slopes at the operating point
    prefilter, sensor, rotor : None for no prefilter, an ideal sensor, a rigid rotor
    gravity_m_per_s2 : positive towards negative positions
    current_limit_a : the control current, balancing current included, stays within ± this
    duration_s : None for a duration in which the linear loop settles
    samples : the number of points of the response; they are denser at its start, see ``sample_times``
    """

    step_m: float
    mass_kg: float
    model: Literal["nonlinear", "linear"] = "nonlinear"
    prefilter: Prefilter | None = None
    sensor: SensorDynamics | None = None
    rotor: FlexibleRotor | None = None
    gravity_m_per_s2: float = 0.0
    gravity_compensation: bool = False
    current_limit_a: float | None = None
    disturbance: Disturbance | None = None
    duration_s: float | None = None
    samples: int = 1001
    position_m: float = 0.0
    current_a: float = 0.0

    def __post_init__(self) -> None:
        """Refuse numbers that describe no run."""
        for name in ("step_m", "gravity_m_per_s2", "position_m", "current_a"):
            if not np.isfinite(getattr(self, name)):
                raise NumericsError(f"{name} must be a finite number, not {getattr(self, name)}")
        for name in ("mass_kg", "current_limit_a", "duration_s"):
            value = getattr(self, name)
            if value is not None and not 0 < value < np.inf:
                raise NumericsError(f"{name} must be a positive number, not {value}")
        if self.model not in {"nonlinear", "linear"}:
            raise NumericsError(f"model must be nonlinear or linear, not {self.model}")
        if self.samples < 2:
            raise NumericsError(f"a response needs at least 2 samples, not {self.samples}")
        if self.current_limit_a is not None and abs(self.current_a) > self.current_limit_a:
            raise NumericsError(
                f"the operating current {self.current_a} A is beyond the limit of {self.current_limit_a} A"
            )

    def pulse_force_n(self, time_s: float) -> float:
        """The force of the pulse at a time, in N."""
        pulse = self.disturbance
        return pulse.force_n if pulse is not None and pulse.start_s <= time_s < pulse.end_s else 0.0

    def sample_times(self, end_s: float) -> Floats:
        """The times of the response's points, from 0 to the end, (samples,).

        A step moves everything in its first instants and little later: there are eight runs of even spacing, each
        twice as wide as the one before. A pulse that begins later gets an even spacing throughout.
        """
        later = self.disturbance is not None and self.disturbance.start_s > 0.0
        spans = self.samples - 1
        if later or spans < SAMPLE_RUNS:
            return np.linspace(0.0, end_s, self.samples)
        widths = 2.0 ** (np.arange(spans) * SAMPLE_RUNS // spans)
        times: Floats = np.concatenate([[0.0], np.cumsum(widths)]) * (end_s / widths.sum())
        times[-1] = end_s
        return times

    def segments(self, duration_s: float) -> list[tuple[float, float, float]]:
        """(start, end, force of the pulse) of the spans from 0 to the duration in which that force is constant."""
        pulse = self.disturbance
        shortest = SHORTEST_SPAN * duration_s
        edges = [] if pulse is None else [pulse.start_s, pulse.end_s]
        ordered = [0.0, *(time for time in edges if shortest < time < duration_s - shortest), duration_s]
        return [(start, end, self.pulse_force_n((start + end) / 2)) for start, end in pairwise(ordered)]

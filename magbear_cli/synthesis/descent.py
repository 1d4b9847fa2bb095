"""Descent by convex steps: ask for a lower level near the present controller, believe only what is recomputed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.lti.state_space import StateSpace

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


class Responds(Protocol):
    """A controller of whatever form, known by its frequency response."""

    def response(self, omega_rad_s: Floats) -> Complexes:
        """K(jω), (w,); ∞ is a legal frequency."""
        ...

    def controller(self) -> StateSpace:
        """The controller as a state-space system."""
        ...


Form = TypeVar("Form", bound=Responds)


@dataclass(frozen=True)
class Grids:
    """Few frequencies to constrain, many to judge by; both hold 0 and ∞."""

    coarse: Floats
    dense: Floats


@dataclass(frozen=True)
class Descended(Generic[Form]):
    """A controller, its level on the dense grid, and the number of cone programs spent."""

    controller: Form
    level: float
    solves: int


def _no_resonances(_: Responds) -> Floats:
    return np.empty(0)


@dataclass(frozen=True)
class Descent(Generic[Form]):
    """What is minimised, and how a better controller is proposed.

    ``measure`` (controller, frequencies) gives the level at each frequency; ``propose`` (controller, frequencies,
    level) gives another controller and its margin, negative when none near the present one reaches the level;
    ``admits`` (controller) says whether it stabilises the loop, which no level on a grid can tell; ``resonances``
    (controller) gives the frequencies at which it is judged beside the dense grid, where it may be lightly damped.
    """

    measure: Callable[[Form, Floats], Floats]
    propose: Callable[[Form, Floats, float], tuple[Form, float]]
    admits: Callable[[Form], bool]
    resonances: Callable[[Form], Floats] = _no_resonances
    precision: float = 3e-4
    most_solves: int = 150

    def run(self, start: Form, grids: Grids) -> Descended[Form]:
        """Lower the level of a stabilising controller until a step of the precision's size fails.

        Where the level recomputed on the dense grid is above the one asked for, the worst frequency joins the
        constraints (exchange), or the step is halved.
        """
        controller, coarse, solves = start, grids.coarse, 0
        level = float(self.measure(controller, self._judged(controller, grids.dense)).max())
        step, most_points = 0.2, coarse.size + 60
        while step > self.precision and solves < self.most_solves:
            solves += 1
            try:
                candidate, margin = self.propose(controller, coarse, level * (1.0 - step))
            except NumericsError:
                margin = -np.inf
            if margin < 0.0:
                step /= 2.0
                continue
            judged = self._judged(candidate, grids.dense)
            reached = self.measure(candidate, judged)
            peak = int(np.argmax(reached))
            if reached[peak] < level * (1.0 - 0.1 * step) and self.admits(candidate):
                controller, level, step = candidate, float(reached[peak]), min(2.0 * step, 0.3)
            elif judged[peak] not in coarse and coarse.size < most_points:
                coarse = np.union1d(coarse, judged[peak])
            else:
                step /= 2.0
        return Descended(controller, level, solves)

    def _judged(self, controller: Form, dense: Floats) -> Floats:
        return np.union1d(dense, self.resonances(controller))

"""The control current of the nominal linear loop after a unit step of the command, prefiltered or not.

The controller sees the measurement less the filtered command, so that u = −K S F r. The rotor has the nominal mass and
the magnets are replaced by their slopes: this is the linear current, which a simulation compares with the real one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.filters import Prefilter
from magbear_cli.synthesis.section_controller import SectionController

Floats = NDArray[np.float64]

_POINTS = 64  # instants of one width; the width then doubles
_FIRST = 0.04  # time constants of the fastest mark between the first instants
_LAST = 14.0  # time constants of the slowest mark until the end
_REFINED = 40  # instants between the neighbours of a peak


@dataclass(frozen=True)
class Instants:
    """Instants from 0 on, many of one width, then as many of its double, and so on.

    A response of which any mode has died away within some tens of its own periods is so seen at any speed.
    """

    first_width: float
    doublings: int

    @classmethod
    def between(cls, fastest: float, slowest: float) -> Instants:
        """Fine enough for what happens at the fastest speed, long enough for the slowest; both in rad per time."""
        width = _FIRST / fastest
        doublings = np.ceil(np.log2(1.0 + _LAST / slowest / (width * _POINTS)))
        return cls(width, int(np.clip(doublings, 1, 40)))

    def times(self) -> Floats:
        """The instants, (t,)."""
        widths = self.first_width * 2.0 ** np.repeat(np.arange(self.doublings), _POINTS)
        return np.concatenate([[0.0], np.cumsum(widths)])

    def states(self, a: Floats, start: Floats) -> Floats:
        """The states (t, n) of x' = A x at the instants."""
        onward, states = expm(a * self.first_width), start[:, None]
        for _ in range(self.doublings):
            ahead, reach, block = onward, 1, states[:, -1:]
            while reach <= _POINTS:
                block = np.hstack([block, ahead @ block])
                ahead, reach = ahead @ ahead, 2 * reach
            states = np.hstack([states, block[:, 1 : _POINTS + 1]])
            onward = onward @ onward
        return np.asarray(states.T)


def affine_step_current(
    form: SectionController, prefilter: Prefilter | None, instants: Instants
) -> tuple[Floats, Floats]:
    """−u after a unit step as an affine function of the form's coefficients: offset (t,), columns (t, order − 3)."""
    a, start, signals = _cascade(form, prefilter)
    values = instants.states(a, start) @ signals.T
    return values[:, 0], values[:, 1:]


def peak_step_current(controller: StateSpace, prefilter: Prefilter | None) -> float:
    """The largest |u(t)| after a unit step in the scaled nominal loop, from the controller's matrices alone.

    Infinite where the loop is not stable.
    """
    filter_ = StateSpace.gain([[1.0]]) if prefilter is None else prefilter.state_space()
    n, k = filter_.order, controller.order
    a, start = np.zeros((n + k + 3, n + k + 3)), np.zeros(n + k + 3)
    start[-1] = 1.0
    error = np.zeros(n + k + 3)  # y − r_f
    error[:n], error[n], error[-1] = -filter_.c[0], 1.0, -filter_.d[0, 0]
    current = controller.d[0, 0] * error
    current[n + 2 : -1] += controller.c[0]
    a[:n, :n], a[:n, -1] = filter_.a, filter_.b[:, 0]
    a[n, n + 1], a[n + 1] = 1.0, current
    a[n + 1, n] += 1.0
    a[n + 2 : -1] = np.outer(controller.b[:, 0], error)
    a[n + 2 : -1, n + 2 : -1] += controller.a
    poles = np.linalg.eigvals(a[:-1, :-1])
    if poles.real.max() >= 0.0:
        return float("inf")
    instants = Instants.between(float(np.abs(poles).max()), float(-poles.real.max()))
    times, states = instants.times(), instants.states(a, start)
    values = np.abs(states @ current)
    top = int(values.argmax())
    if top in {0, values.size - 1}:
        return float(values[top])
    onward, state, best = expm(a * (times[top + 1] - times[top - 1]) / _REFINED), states[top - 1], float(values[top])
    for _ in range(_REFINED):
        state = onward @ state
        best = max(best, float(abs(current @ state)))
    return best


def _cascade(form: SectionController, prefilter: Prefilter | None) -> tuple[Floats, Floats, Floats]:
    """Step, prefilter, (s² − 1)/f, (s² − 1)/l and the chain of Q: A, the start, and rows for n1/l and each function."""
    filter_ = StateSpace.gain([[1.0]]) if prefilter is None else prefilter.state_space()
    chain, enter, size = form.sections.without_first(2).chain()
    n, k = filter_.order, enter.size
    total = n + 4 + k + 1
    a, start, drive, offset = np.zeros((total, total)), np.zeros(total), np.zeros(total), np.zeros(total)
    start[-1] = 1.0
    drive[:n], drive[-1] = filter_.c[0], filter_.d[0, 0]
    a[:n, :n], a[:n, -1] = filter_.a, filter_.b[:, 0]
    slope, rest = form.factors()[2]
    for place, (b, c) in zip((n, n + 2), form.sections.quadratics[:2], strict=True):
        # The states are c/q and √c s/q with q = s² + b s + c.
        speed = np.sqrt(c)
        a[place, place + 1], a[place + 1, place], a[place + 1, place + 1] = speed, -speed, -b
        a[place + 1] += speed * drive
        if place > n:
            offset[place], offset[place + 1] = rest / c, slope / speed
        drive = drive.copy()
        drive[place], drive[place + 1] = -(c + 1.0) / c, -b / speed
    a[n + 4 : -1, n + 4 : -1] = chain
    a[n + 4 : -1] += np.outer(enter, drive)
    functions = np.zeros((k, total))
    functions[:, n + 4 : -1] = np.diag(size)
    return a, start, np.vstack([offset, drive, functions])

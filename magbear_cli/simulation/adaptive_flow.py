"""The linear part of the adaptive loop over one step, as a matrix from its start and the forces within.

A step of width h carries polynomials: the states are of degree s and fulfil their equation at Radau's s points. With Q
the integrals of Lagrange's polynomials up to the points (Hairer and Wanner, Solving Ordinary Differential Equations II,
section IV.5), X = x(0) + h Q (X Aᵀ + f bᵀ) is linear in x(0) and f, and solved once for each width. So many points make
a step as long as several radians of the fastest oscillation, and that is what matters: a step costs some hundred calls
of numpy, whatever its length.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from magbear_cli.simulation.adaptive_loop import (
    AT_MAGNETS,
    COMMAND,
    MEASURED,
    MODEL,
    MODEL_SPEED,
    SPEED,
    AdaptiveLoop,
)
from magbear_cli.simulation.collocation import interpolation, knots, radau_points

Floats = NDArray[np.float64]

STAGES = 22
FINE = np.linspace(0.0, 1.0, 97)  # where a step is searched for a switching, a kink of the force and the stator
_TINY = float(np.finfo(float).tiny)  # beside any other distance it is nothing, and instead of none it is enough
TAIL = 4  # coefficients of the highest degrees, from which the error of a step is estimated

ABOVE, BELOW, DEMAND, AWAY, FASTER, LEARNED = range(6)  # the outputs from which the force follows


@dataclass(frozen=True, eq=False)
class Flow:
    """A step of one width, while the law adapts or while it does not, for s points and n states.

    ``states`` (n·s, n + 1 + s) takes (start, 1, forces) to the states at the points. ``free`` (6·s, n + 1) and
    ``forced`` (6·s, s) take (start, 1) and the forces to the six outputs: the distances to the upper and the lower
    magnet (m), the demand without the terms of the estimate that are not linear (A), the measured position (m) and
    speed (m/s), and the rate of the estimate's constant (A/s; zero while the law does not adapt). ``position`` and
    ``demand`` (s, s) are the parts of ``forced`` that Newton's method needs. ``integral`` (s, s) takes rates in a row
    to their integrals.
    """

    width_s: float
    states: Floats
    free: Floats
    forced: Floats
    position: Floats
    demand: Floats
    integral: Floats


@dataclass(eq=False)
class Flows:
    """The flows of a loop, each computed once."""

    loop: AdaptiveLoop
    _known: dict[tuple[float, bool], Flow] = field(default_factory=dict)
    _states: dict[float, Floats] = field(default_factory=dict)  # the same in both states of the switch

    def over(self, width_s: float, *, adapting: bool) -> Flow:
        """The flow of a width and a state of the switch."""
        key = width_s, adapting
        if key not in self._known:
            self._known[key] = self._built(width_s, adapting=adapting)
        return self._known[key]

    def _built(self, width_s: float, *, adapting: bool) -> Flow:
        loop, order = self.loop, self.loop.order
        if width_s not in self._states:
            self._states[width_s] = _collocated(loop, width_s)
        states = self._states[width_s]
        mix, constant = _six_outputs(loop, adapting=adapting)
        rows = np.tensordot(mix, states, 1)  # (6, s, n + 1 + s)
        rows[:, :, order] += constant[:, None]
        integral = width_s * integration()
        if adapting:
            rows[DEMAND] -= integral @ rows[LEARNED]  # the estimate's constant is linear as well
        return Flow(
            width_s,
            states.reshape(order * STAGES, -1),
            np.ascontiguousarray(rows[:, :, : order + 1].reshape(-1, order + 1)),
            np.ascontiguousarray(rows[:, :, order + 1 :].reshape(-1, STAGES)),
            np.ascontiguousarray(rows[BELOW, :, order + 1 :]),
            np.ascontiguousarray(rows[DEMAND, :, order + 1 :]),
            np.ascontiguousarray(integral.T),
        )


@cache
def integration() -> Floats:
    """Q: from values at the points to the integrals from the start to the points, (s, s), for a width of one."""
    points = 2.0 * radau_points(STAGES) - 1.0
    integrals = [legendre.legval(points, legendre.legint(one, lbnd=-1)) / 2.0 for one in np.eye(STAGES)]
    return np.asarray(np.linalg.solve(legendre.legvander(points, STAGES - 1).T, np.array(integrals)).T)


@cache
def highest_degrees() -> Floats:
    """From values at the knots (in a row) to the last of Legendre's coefficients, (s + 1, 4)."""
    return np.ascontiguousarray(np.linalg.inv(legendre.legvander(2.0 * knots(STAGES) - 1.0, STAGES))[-TAIL:].T)


@cache
def at_fine() -> Floats:
    """From values at the knots (in a row) to those at the fine points, (s + 1, 97)."""
    return np.ascontiguousarray(interpolation(knots(STAGES), FINE).T)


def at_knots_of(place: float) -> Floats:
    """The weights of the values at the knots in the value at a place of the step, (s + 1,), in barycentric form."""
    return _weights(place - knots(STAGES), _barycentric(from_start=True))


def at_points_of(places: Floats) -> Floats:
    """The weights of the values at the points in the values at places of the step, (places, s)."""
    return _weights(places[:, None] - radau_points(STAGES), _barycentric(from_start=False))


def _weights(distance: Floats, barycentric: Floats) -> Floats:
    share = barycentric / (distance + _TINY)
    share /= np.add.reduce(share, axis=-1, keepdims=True)
    return np.asarray(share)


@cache
def _barycentric(*, from_start: bool) -> Floats:
    """The weights 1/Π(x_i − x_k) (Berrut and Trefethen 2004), the interval taken as four long against underflow."""
    nodes = knots(STAGES) if from_start else radau_points(STAGES)
    return np.asarray(1.0 / np.prod(4.0 * (nodes[:, None] - nodes) + np.eye(nodes.size), axis=1))


def _collocated(loop: AdaptiveLoop, width_s: float) -> Floats:
    """From (start, 1, forces) to the states at the points, (n, s, n + 1 + s)."""
    order, driven = loop.order, loop.driven
    moved, own = slice(0, driven), slice(driven, order)
    states = np.zeros((order, STAGES, order + 1 + STAGES))
    integral = width_s * integration()
    right = np.zeros((driven, STAGES, driven + STAGES))
    right[:, :, :driven] = np.eye(driven)[:, None]
    right[:, :, driven:] = loop.b[moved, None, None] * integral
    answer = _solved(loop.a[moved, moved], integral, right)
    states[moved, :, :driven], states[moved, :, order + 1 :] = answer[:, :, :driven], answer[:, :, driven:]
    right = np.zeros((order - driven, STAGES, order - driven + 1))
    right[:, :, :-1] = np.eye(order - driven)[:, None]
    right[:, :, -1] = loop.scenario.step_m * loop.command[own, None] * (width_s * radau_points(STAGES))
    states[own, :, driven : order + 1] = _solved(loop.a[own, own], integral, right)
    return states


def _solved(a: Floats, integral: Floats, right: Floats) -> Floats:
    """The solutions X (n, s, k) of X − (A ⊗ Q) X = right, with Q of the width."""
    count = a.shape[0]
    matrix = -(a[:, None, :, None] * integral[None, :, None, :]).reshape(count * STAGES, -1)
    matrix.flat[:: count * STAGES + 1] += 1.0
    return np.asarray(np.linalg.solve(matrix, right.reshape(count * STAGES, -1)).reshape(right.shape))


def _six_outputs(loop: AdaptiveLoop, *, adapting: bool) -> tuple[Floats, Floats]:
    """The six outputs over the states, (6, n), and their constants (6,)."""
    law, magnets = loop.law, loop.magnets
    from_position, from_speed = loop.learning if adapting else (0.0, 0.0)
    mix = np.zeros((6, loop.c.shape[0]))
    mix[ABOVE, AT_MAGNETS], mix[BELOW, AT_MAGNETS] = -1.0, 1.0
    mix[DEMAND, [COMMAND, MEASURED, SPEED]] = (
        law.feedforward_a_per_m, -law.gain_position_a_per_m, -law.gain_speed_a_s_per_m,
    )  # fmt: skip
    mix[AWAY, MEASURED] = mix[FASTER, SPEED] = 1.0
    mix[LEARNED, [MODEL, MEASURED, MODEL_SPEED, SPEED]] = from_position, -from_position, from_speed, -from_speed
    constant = mix @ loop.feed * loop.scenario.step_m
    constant[ABOVE] += magnets.gap_m[1]
    constant[BELOW] -= magnets.gap_m[0]
    return mix @ loop.c, constant

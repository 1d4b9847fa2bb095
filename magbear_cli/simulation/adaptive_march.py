"""The march of the adaptive loop: long smooth steps, each cut off where something happens in it.

What may happen: the error crosses the border of the sphere and the adaptation turns on or off, the force comes to a
kink, the rotor touches the stator, or the span of a constant pulse ends. All are looked for at fine points of the
step's own polynomials and then found on them to rounding. So widths are powers of two in seconds and need few matrices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from functools import partial
from math import ceil, floor, isfinite, log2
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magbear_cli.model.adaptive_law import Trigger
from magbear_cli.simulation.adaptive_branch import Branch, LinearBranch, branch_at, branches
from magbear_cli.simulation.adaptive_flow import FINE, STAGES, Flow, Flows, at_fine, at_knots_of
from magbear_cli.simulation.adaptive_loop import (
    AT_MAGNETS,
    AT_SENSOR,
    COEFFICIENTS,
    COMMAND,
    MEASURED,
    MODEL,
    MODEL_SPEED,
    SPEED,
    AdaptiveLoop,
)
from magbear_cli.simulation.adaptive_step import Start, carried_on, relative_error, solve_step
from magbear_cli.simulation.integration import LARGEST_CURRENT_A
from magbear_cli.simulation.trajectory import End
from magbear_cli.simulation.zeros import below_zero, first_zero

Floats = NDArray[np.float64]

RELATIVE_TOLERANCE = 1e-8
ABSOLUTE_TOLERANCE = 1e-9  # of the step or the sphere, for what is a position
NEWTON_TOLERANCE = 0.01  # of the absolute tolerance, for what the rest of Newton's method moves in a step
STEP_BUDGET = 30_000  # steps and rejected steps of all pieces together: some five seconds
SWITCH_BUDGET = 5_000  # more switchings than this in one run is chattering
LEFT = 1e-4  # of the gap: so near to a magnet the rotor has touched it
NEAR = 0.98  # of the gap: a step that cannot be made beyond this is contact
FIRST_RAD = 8.0  # of the fastest oscillation of the linear part in the first step
MOST_DOUBLINGS = 3  # of the width from one step to the next
DOUBT = 0.1  # of the variation between fine points, what a parabola's least value may be wrong by
NARROWEST_S = 1e-12  # no rotor moves so fast, and the powers of a width in the polynomials are still numbers


class Happening(IntEnum):
    """What may cut a step off, by the rows of ``_distances``."""

    SWITCH = 0
    BELOW_BRANCH = 1
    ABOVE_BRANCH = 2
    CONTACT = 3  # and beyond


@dataclass
class March:
    """What the march carries along: the state, the switch, and the values at the knots of every step taken.

    ``knots`` holds the states and coefficients (n + 3, s + 1) and ``demands`` (s + 1,) those of the whole step, also
    where only its part until ``ends`` was gone.
    """

    loop: AdaptiveLoop
    time_s: float = 0.0
    adapting: bool = False
    centre: tuple[float, float] = (0.0, 0.0)
    switchings: int = 0
    adapting_s: float = 0.0
    rejected: int = 0
    starts: list[float] = field(default_factory=list)
    widths: list[float] = field(default_factory=list)
    ends: list[float] = field(default_factory=list)
    knots: list[Floats] = field(default_factory=list)
    demands: list[Floats] = field(default_factory=list)
    end: End = End.FINISHED
    sentence: str = ""

    def __post_init__(self) -> None:
        """Gather what stays the same in all steps."""
        loop, law, order = self.loop, self.loop.law, self.loop.order
        self.state = np.zeros(order + COEFFICIENTS)
        size = max(abs(loop.scenario.step_m), law.rho_m)
        self.absolute = np.full(self.state.size, ABSOLUTE_TOLERANCE * size)
        gains = (1.0, 1.0 / size, 1.0 / (size * law.omega_rad_s))
        self.absolute[order:] *= law.feedforward_a_per_m * np.array(gains)
        self.watched, self.watched_constant = _watched(loop)
        self.flows, self.branches = Flows(loop), branches(loop.magnets)
        self.stator = _stator(loop)
        fastest = max(law.omega_rad_s, float(np.abs(np.linalg.eigvals(loop.a)).max()))
        self.level = floor(log2(FIRST_RAD / fastest))
        self.newton_n_s = NEWTON_TOLERANCE * float(self.absolute[0] / np.abs(loop.b).max())
        self.branch_at = 0
        self.forces, self.place = np.zeros(STAGES), 1.0  # of the last step, and where it was cut off

    @property
    def branch(self) -> Branch | LinearBranch:
        """The present branch of the force."""
        return self.branches[self.branch_at]

    def stop(self, end: End, sentence: str) -> None:
        """End the run here."""
        self.end, self.sentence = end, f"after {1e3 * self.time_s:.4g} ms {sentence}"


def march(loop: AdaptiveLoop, duration_s: float) -> March:
    """The course of a loop from rest to the duration, or to whatever ends it before."""
    run = March(loop)
    with np.errstate(all="ignore"):  # non-finite numbers are looked for after every step
        for start_s, end_s, pulse_n in loop.scenario.segments(duration_s):
            run.time_s = start_s
            run.branch_at = branch_at(run.branches, float(loop.demand_a(run.state[:, None], run.centre)[0]))
            while run.end is End.FINISHED and run.time_s < end_s:
                _step(run, end_s, pulse_n)
            if run.end is not End.FINISHED:
                break
    return run


def _step(run: March, end_s: float, pulse_n: float) -> None:
    """Make one step, or end the run."""
    tried = _tried(run, pulse_n)
    if tried is None:
        _cannot_step(run)
        return
    knots, flow, doublings = tried
    width = flow.width_s
    watched = run.watched.dot(knots[: run.loop.order]) + run.watched_constant
    estimate = knots[-3] + knots[-2] * (watched[4] - run.centre[0]) + knots[-1] * (watched[5] - run.centre[1])
    watched[6] -= estimate
    until, happening = _cut(run, watched)
    if run.time_s + until * width >= end_s:
        if run.time_s + until * width > end_s:
            happening = None
        until, time = (end_s - run.time_s) / width, end_s
    else:
        time = run.time_s + until * width
    if time > run.time_s:
        run.starts.append(run.time_s)
        run.widths.append(width)
        run.ends.append(time)
        run.knots.append(knots)
        run.demands.append(watched[6])
    else:
        run.rejected += (
            1  # something happened at once: a step all the same, or two borders could turn it round for ever
        )
    run.adapting_s += (time - run.time_s) * run.adapting
    run.state = knots[:, -1] if until == 1.0 else knots.dot(at_knots_of(until))
    run.time_s, run.place = time, until
    run.level += doublings
    _look(run, float(watched[6, 0]), happening)


def _tried(run: March, pulse_n: float) -> tuple[Floats, Flow, int] | None:
    """The widest step that is right, with its flow and how many times wider the next one may be; None without any."""
    law = run.loop.law
    centre = np.array(run.centre)[:, None]
    start = Start(run.state, centre, run.branch, pulse_n, run.adapting and law.taylor_order == 1)
    before, rejected = run.widths[-1] if run.widths else 1.0, run.rejected
    while (width := 2.0**run.level) > NARROWEST_S:
        flow = run.flows.over(width, adapting=run.adapting)
        answer = solve_step(flow, start, carried_on(run.forces, run.place, width / before), run.newton_n_s / width)
        error = np.inf if answer is None else relative_error(answer[0], run.absolute, RELATIVE_TOLERANCE)
        if answer is not None and error <= 1.0:
            knots, run.forces = answer
            return knots, flow, 0 if run.rejected > rejected else _doublings(error)
        finite = isfinite(error) and error > 0.0
        run.level -= max(1, ceil(log2(2.0 * error) / STAGES)) if finite else 1
        run.rejected += 1
    return None


def _doublings(error: float) -> int:
    """How many times wider the next step may be."""
    if error <= 0.0:
        return MOST_DOUBLINGS
    return min(max(floor(-log2(2.0 * error) / STAGES), 0), MOST_DOUBLINGS)


def _watched(loop: AdaptiveLoop) -> tuple[Floats, Floats]:
    """What is looked at, over the states (7, n), and its constants (7, 1).

    The two parts of the error's norm, the positions at magnets and sensor, the measured position and speed, and the
    demand without the estimate.
    """
    law = loop.law
    mix = np.zeros((7, loop.c.shape[0]))
    mix[0, [MODEL, MEASURED]] = 1.0, -1.0
    if law.trigger is Trigger.STATE:
        mix[1, [MODEL_SPEED, SPEED]] = 1.0, -1.0
    mix[range(2, 6), [AT_MAGNETS, AT_SENSOR, MEASURED, SPEED]] = 1.0
    mix[6, [COMMAND, MEASURED, SPEED]] = (
        law.feedforward_a_per_m, -law.gain_position_a_per_m, -law.gain_speed_a_s_per_m,
    )  # fmt: skip
    return mix @ loop.c, (loop.scenario.step_m * mix @ loop.feed)[:, None]


def _stator(loop: AdaptiveLoop) -> tuple[tuple[float, float], tuple[float, float]]:
    """The lowest deviations at magnets and sensor, and the highest ones; the stator lies beyond them."""
    magnets, (low, high) = loop.magnets, loop.magnets.gap_m
    left = 0.0 if magnets.is_linear else LEFT * magnets.bearing.air_gap_m
    return (low + left, low), (high - left, high)


def _distance(run: March, row: int, watched: Sequence[Any]) -> Any:  # noqa: ANN401 - floats or arrays of them
    """How far from a happening (a row in the order of ``Happening``), below zero beyond it, over what is looked at."""
    law, (low, high) = run.loop.law, run.stator
    if row == 0:
        square = watched[0] * watched[0] + watched[1] * watched[1]
        return square - law.inner_m**2 if run.adapting else law.outer_m**2 - square
    if row < 3:
        return watched[6] - run.branch.low_a if row == 1 else run.branch.high_a - watched[6]
    return watched[row - 1] - low[row - 3] if row < 5 else high[row - 5] - watched[row - 3]


def _cut(run: March, watched: Floats) -> tuple[float, Happening | None]:
    """Where in a step something happens first, as a part of its width, and what it is."""
    values = watched.dot(at_fine())
    fine = np.array([_distance(run, row, values) for row in range(7)])
    beyond = fine[:, 1:] < 0.0  # a step begins where the one before happened, to rounding on either side of it
    found = []
    if beyond.any():
        first = int(beyond.any(axis=0).argmax()) + 1
        found = [
            (_crossing(run, watched, row, first, fine[row].tolist()), row)
            for row in np.flatnonzero(beyond[:, first - 1]).tolist()
        ]
    found += _dips(run, watched, fine[: Happening.CONTACT])
    if not found:
        return 1.0, None
    until, row = min(found)
    return until, Happening(min(row, Happening.CONTACT))


def _crossing(run: March, watched: Floats, row: int, right: int, distances: list[float]) -> float:
    """Where in the interval before a fine point a distance passes zero, to rounding.

    The fine point itself where the distance was not positive at the interval's beginning: so every step gets on.
    """
    if not distances[right - 1] > 0.0:
        return float(FINE[right])
    near = [(float(FINE[at]), distances[at]) for at in range(max(0, right - 2), min(FINE.size, right + 2))]
    return first_zero(partial(_distance_at, run, watched, row), near, (float(FINE[right - 1]), float(FINE[right])))


def _dips(run: March, watched: Floats, fine: Floats) -> list[tuple[float, int]]:
    """Where a distance falls below zero and is back before the next fine point: it is least near some fine point.

    Whether it may is told by the parabola through that point and its neighbours, with some doubt of it; whether it does
    by the polynomials.
    """
    left, middle, right = fine[:, :-2], fine[:, 1:-1], fine[:, 2:]
    least = (middle < left) & (middle <= right) & (middle >= 0.0)  # not where a border is infinitely far
    rows, at = least.nonzero()
    if not rows.size:
        return []
    before, there, after = left[rows, at], middle[rows, at], right[rows, at]
    bend = before + after - 2.0 * there
    found = []
    for each in np.flatnonzero(8.0 * (there - DOUBT * bend) * bend < (after - before) ** 2).tolist():
        row, point = int(rows[each]), at[each] + np.arange(3)
        known = list(zip(FINE[point].tolist(), fine[rows[each], point].tolist(), strict=True))
        dip = below_zero(partial(_distance_at, run, watched, row), known)
        if dip is not None and dip[0][1] > 0.0:
            within = dip[0][0], dip[1][0]
            found.append((first_zero(partial(_distance_at, run, watched, row), dip, within), row))
    return found


def _distance_at(run: March, watched: Floats, row: int, place: float) -> float:
    return float(_distance(run, row, watched.dot(at_knots_of(place)).tolist()))


def _look(run: March, demand_a: float, happening: Happening | None) -> None:
    """Do what follows from what happened at the end of a step, and from the demand at its beginning."""
    if not np.isfinite(run.state).all():
        run.stop(End.NOT_FINITE, "the loop has no finite state any more")
    elif happening is Happening.CONTACT:
        run.stop(End.TOUCHED_DOWN, "the rotor touched the stator")
    elif abs(demand_a) > LARGEST_CURRENT_A:
        run.stop(End.DIVERGED, f"the controller asked for more than {LARGEST_CURRENT_A:g} A")
    elif len(run.widths) + run.rejected > STEP_BUDGET:
        run.stop(End.DIVERGED, "the loop moves too fast to be followed")
    elif happening is Happening.SWITCH:
        _switch(run)
    elif happening is Happening.BELOW_BRANCH:
        run.branch_at -= 1
    elif happening is Happening.ABOVE_BRANCH:
        run.branch_at += 1


def _switch(run: March) -> None:
    """Turn the adaptation on or off; on: expand the estimate about the present state, without a jump."""
    run.adapting = not run.adapting
    run.switchings += 1
    if run.switchings > SWITCH_BUDGET:
        run.stop(End.DIVERGED, "the adaptation chatters too fast to be followed")
    if not run.adapting:
        return
    out = run.loop.outputs(run.state[:, None])[:, 0]
    centre = float(out[MEASURED]), float(out[SPEED])
    run.state = run.state.copy()
    run.state[-3] += run.state[-2:] @ (np.array(centre) - np.array(run.centre))
    run.centre = centre


def _cannot_step(run: March) -> None:
    """End a run whose next step has no solution: at a magnet this is contact, elsewhere numbers beyond reach."""
    position = run.loop.scenario.position_m + float(run.loop.outputs(run.state[:, None])[AT_MAGNETS, 0])
    if abs(position) > NEAR * run.loop.magnets.bearing.air_gap_m:
        run.stop(End.TOUCHED_DOWN, "the rotor touched the stator")
    else:
        run.stop(End.NOT_FINITE, "the loop has no finite state any more")

"""The march through time: steps as wide as the tolerance allows, until the end, the stator or a number that is none.

The error of a step is the impulse of its defect, and that is held below a fraction of the impulse which the net force
has given the rotor so far. This measures a step of a nanometre and one of half the gap alike, and needs no scale from
the user. Where the force has a kink (a limit met, a coil switched off) the steps shrink until the kink does not matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from magbear_cli.errors import NumericsError
from magbear_cli.simulation.collocation import (
    STAGES,
    Steps,
    Task,
    carried_on,
    hull,
    knots,
    probes,
    radau_points,
    solve_steps,
)
from magbear_cli.simulation.crossings import crossings
from magbear_cli.simulation.loop import DEMAND, MAGNETS, SENSOR, Fleet, Loop
from magbear_cli.simulation.propagation import Propagation
from magbear_cli.simulation.trajectory import End, Pieces, Trajectory, piecewise

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Integers = NDArray[np.int64]

TOLERANCE = 1e-9  # of the impulse so far, for the defect of one step
FINEST = 46  # halvings of a span of constant pulse
FIRST = 24  # halvings for the first step of all
LARGEST_CURRENT_A = 1e9  # a demand beyond this is a controller that runs away
STEP_BUDGET = 60_000  # steps and rejected steps together: some ten seconds
CONTACT = 1e-4  # of the gap: what is left when the collapse onto a magnet, which no step can end, is extrapolated
MOST_DOUBLINGS = 3  # of the width from one step to the next
FARTHEST_EXTRAPOLATION = 2.0  # widths of the last step over which its polynomial is carried on
NEAR = 0.99  # of the gap: a step that cannot be made here is contact


@dataclass
class _Record:
    """What became of one loop: its pieces, and how it ended."""

    starts: list[float] = field(default_factory=list)
    widths: list[float] = field(default_factory=list)
    outputs: list[Floats] = field(default_factory=list)
    rejected: int = 0
    end: End | None = None
    sentence: str = ""
    end_s: float = 0.0

    def stop(self, end: End, time_s: float, sentence: str) -> None:
        """End the run here."""
        self.end, self.end_s, self.sentence = end, time_s, sentence


@dataclass
class _March:
    """What the march of k loops carries along; every array is over the loops."""

    fleet: Fleet
    propagation: Propagation
    records: list[_Record]
    state: Floats
    impulse_n_s: Floats
    forces: Floats  # at the Radau points of the last step
    width_s: Floats  # of the last step; zero before the first
    runs: NDArray[np.bool_]  # which have not ended
    tolerance: float
    pulse_n: float = 0.0  # during the last step

    @classmethod
    def of(cls, fleet: Fleet, tolerance: float) -> _March:
        one, count = fleet.one, len(fleet.loops)
        points = np.append(radau_points(), probes())
        return cls(
            fleet,
            Propagation(one.a, one.b, one.c, points, STAGES),
            [_Record() for _ in fleet.loops],
            np.array([loop.start for loop in fleet.loops]),
            np.zeros(count),
            np.zeros((count, STAGES)),
            np.zeros(count),
            np.ones(count, dtype=bool),
            tolerance,
        )


def integrate(loop: Loop, duration_s: float, tolerance: float = TOLERANCE) -> Trajectory:
    """The course of the loop from its start to the duration, or to whatever ends it before.

    ``tolerance`` is what the impulse of a step's defect may be of the impulse so far; the error at the end of a run is
    usually far smaller.

    Raises
    ------
    NumericsError
        when the loop has no finite force at t = 0.
    """
    (trajectory,) = integrate_fleet([loop], duration_s, tolerance)
    if isinstance(trajectory, NumericsError):
        raise trajectory
    return trajectory


def integrate_fleet(
    loops: Sequence[Loop], duration_s: float, tolerance: float = TOLERANCE
) -> list[Trajectory | NumericsError]:
    """The courses of loops that differ in the mass of a rigid rotor only, each with steps of its own.

    A loop that has no first step is an error in the list and keeps none of the others. The numbers of a loop are, to
    rounding, those that it has alone.

    Raises
    ------
    NumericsError
        when the loops differ otherwise.
    """
    march = _March.of(Fleet(tuple(loops)), tolerance)
    with np.errstate(all="ignore"):  # non-finite numbers are looked for after every step
        for start_s, end_s, pulse_n in march.fleet.one.scenario.segments(duration_s):
            _march(march, start_s, end_s, pulse_n)
    return [
        _trajectory(loop, record, march.state[at], duration_s)
        for at, (loop, record) in enumerate(zip(march.fleet.loops, march.records, strict=True))
    ]


def _trajectory(loop: Loop, record: _Record, state: Floats, duration_s: float) -> Trajectory | NumericsError:
    if not record.starts:
        return NumericsError(f"the simulation has no first step: {record.sentence}")
    if record.end is None:
        record.stop(End.FINISHED, duration_s, "")
    pieces = Pieces(np.array(record.starts), np.array(record.widths), np.stack(record.outputs))
    position, current, command = pieces.curves(loop)
    return Trajectory(
        position,
        current,
        command,
        record.end_s,
        record.end or End.FINISHED,
        record.sentence,
        state,
        len(record.starts),
        record.rejected,
    )


def _march(march: _March, start_s: float, end_s: float, pulse_n: float) -> None:
    """Step every loop through a span of constant pulse.

    Widths are the span halved a whole number of times, and a step of 2^-k begins at a multiple of 2^-k, so that few
    different exponentials are needed. ``place`` counts in the finest width.
    """
    span = end_s - start_s
    finest = min(FINEST, int(np.log2(span / (8.0 * np.finfo(float).eps * end_s))))
    count, total = len(march.records), 2**finest
    place, failures = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    level = np.full(count, min(FIRST, finest), dtype=np.int64)
    while (rows := np.flatnonzero(march.runs & (place < total))).size:
        now = np.maximum(level[rows], finest - _twos(place[rows], finest))
        time, width = start_s + span * (place[rows] / total), span * 0.5**now
        steps = _tried(march, rows, width, pulse_n)
        impulse = width * np.abs(steps.forces).sum(axis=1) / STAGES
        halvings = np.where(
            steps.solved, _halvings(march.tolerance * (march.impulse_n_s[rows] + impulse), steps, width), 1
        )
        finer = now < finest
        again = ~(steps.solved & (halvings <= 0)) & finer
        stuck = ~(steps.solved | finer)
        for at in np.flatnonzero(again):
            march.records[rows[at]].rejected += 1
        for at in np.flatnonzero(stuck):
            _end_early(march, rows[at], float(time[at]))
        failures[rows] = np.where(again, failures[rows] + 1, 0)
        # ever faster where it fails again and again: there is a kink here
        level[rows] = np.clip(now + np.where(again, np.maximum(halvings, failures[rows]), halvings), 0, finest)
        taken = np.flatnonzero(~(again | stuck))
        if taken.size:
            place[rows[taken]] += 1 << (finest - now[taken])
            _accept(march, rows[taken], steps.at(taken), (time[taken], width[taken], impulse[taken], pulse_n))
        march.runs[rows] = [march.records[at].end is None for at in rows]


def _twos(place: Integers, most: int) -> Integers:
    """How many times each number can be halved."""
    lowest = np.frexp((place & -place).astype(float))[1] - 1
    return np.where(place == 0, most, lowest)


def _tried(march: _March, rows: Indices, width_s: Floats, pulse_n: float) -> Steps:
    """One step of each of these loops."""
    if rows.size == 1:
        widths, of_width = width_s, np.zeros(1, dtype=np.intp)
    else:
        widths, of_width = np.unique(width_s, return_inverse=True)
    propagators = tuple(march.propagation.over(width) for width in widths.tolist())
    task = Task(march.fleet, rows, propagators, of_width, width_s, march.state[rows], pulse_n)
    return solve_steps(task, _guess(march, rows, width_s, pulse_n), 0.01 * march.tolerance * march.impulse_n_s[rows])


def _guess(march: _March, rows: Indices, width_s: Floats, pulse_n: float) -> Floats:
    """Forces to begin Newton's method with: the last step's polynomial carried on, or the last force held."""
    guess, added = march.forces[rows], pulse_n - march.pulse_n
    ratios = width_s / march.width_s[rows]
    for ratio in set(ratios.tolist()):
        if ratio == np.inf:  # no step before
            same = np.flatnonzero(ratios == ratio)
            outputs = march.state[rows[same]] @ march.fleet.one.c.T
            force, _, _ = march.fleet.force(rows[same], outputs[:, [MAGNETS]], outputs[:, [DEMAND]])
            guess[same] = force + pulse_n - added
        elif ratio > FARTHEST_EXTRAPOLATION:
            same = np.flatnonzero(ratios == ratio)
            guess[same] = guess[same, -1:]
        elif ratio > 0.0:
            same = np.flatnonzero(ratios == ratio)
            guess[same] = guess[same] @ carried_on(float(f"{ratio:.6g}")).T
    return guess + added


def _halvings(allowed_n_s: Floats, steps: Steps, width_s: Floats) -> Integers:
    """How many times to halve each width: above zero, the step must be taken again; else it is that of the next one.

    The defect goes with width^STAGES. Without any impulse a defect is halved once, and without a defect all is well.
    """
    error = width_s * (steps.defect_n - steps.noise_n)
    wanted = np.ceil(np.log2(2.0 * error / allowed_n_s) / (STAGES + 1))
    halvings = np.where(error > allowed_n_s, np.clip(wanted, 1, FINEST), np.clip(wanted, -MOST_DOUBLINGS, 0))
    halvings[allowed_n_s == 0.0] = 1
    halvings[error <= 0.0] = -MOST_DOUBLINGS
    return halvings.astype(np.int64)


def _accept(march: _March, rows: Indices, steps: Steps, step: tuple[Floats, Floats, Floats, float]) -> None:
    """Go to the ends of these steps, and look which runs have ended in them."""
    time, width, impulse, pulse_n = step
    march.state[rows], march.forces[rows] = steps.end, steps.forces
    march.width_s[rows], march.pulse_n = width, pulse_n
    march.impulse_n_s[rows] += impulse
    for row, start, span, outputs in zip(rows, time.tolist(), width.tolist(), steps.outputs, strict=True):
        record = march.records[row]
        record.starts.append(start)
        record.widths.append(span)
        record.outputs.append(outputs)
        if len(record.starts) + record.rejected > STEP_BUDGET:
            record.stop(End.DIVERGED, start, f"{_when(start)} the current chatters too fast to be followed")
    magnets = march.fleet.one.magnets
    left = 0.0 if magnets.is_linear else CONTACT * magnets.bearing.air_gap_m
    size = np.abs(steps.outputs).max(axis=1)
    reach = np.abs(hull() @ steps.outputs).max(axis=1)  # no less than is reached between the knots
    at_magnets = size[:, MAGNETS] + left if left else reach[:, MAGNETS]
    farthest, loudest = np.maximum(at_magnets, reach[:, SENSOR]), size[:, DEMAND]
    for at in np.flatnonzero((farthest >= min(-magnets.gap_m[0], magnets.gap_m[1])) | (loudest > LARGEST_CURRENT_A)):
        _look_for_the_end(march.records[rows[at]], magnets.gap_m, left)


def _look_for_the_end(record: _Record, gap_m: tuple[float, float], left_m: float) -> None:
    """End a run in whose last step the rotor touched the stator, at magnets or sensor, or the demand ran away."""
    start, width, outputs = record.starts[-1], record.widths[-1], record.outputs[-1]
    contacts = [
        _contact_s(start, width, outputs[:, channel], limit, distance)
        for channel, distance in ((MAGNETS, left_m), (SENSOR, 0.0))
        for limit in gap_m
    ]
    time, end = min(contacts), start + width
    if np.isfinite(time):
        record.stop(End.TOUCHED_DOWN, time, f"{_when(time)} the rotor touched the stator")
    elif np.abs(outputs[:, DEMAND]).max() > LARGEST_CURRENT_A:
        record.stop(End.DIVERGED, end, f"{_when(end)} the controller asked for more than {LARGEST_CURRENT_A:g} A")


def _contact_s(start_s: float, width_s: float, positions_m: Floats, limit_m: float, left_m: float) -> float:
    """When the position reaches a limit, in s; infinite when it does not in this step.

    The attraction grows without bound at a magnet. So the position is followed to a short distance from it, and the
    rest is gone at the speed reached there. Where no such distance is left the first passage of the step's polynomial
    counts, also of a peak between two knots.
    """
    side = np.sign(limit_m)
    left = side * (limit_m - positions_m) - left_m
    distance = piecewise(np.array([start_s]), np.array([width_s]), left[None, :])
    if left_m == 0.0 and left[0] > 0.0 and (passages := crossings(distance, 0.0)[0]).size:
        return float(passages[0])
    beyond = np.flatnonzero(left <= 0.0)
    if not beyond.size:
        return float(np.inf)
    time, until = start_s, start_s + width_s * float(knots()[beyond[0]])
    if distance(time) > 0.0:  # else it starts there
        is_crossed = distance(until) < 0.0
        time = float(brentq(distance, time, until, xtol=1e-300, rtol=1e-14)) if is_crossed else until
    speed = -float(distance.derivative()(time))
    return time + (left_m / speed if speed > 0.0 else 0.0)


def _end_early(march: _March, row: int, time_s: float) -> None:
    """End a run whose finest step has no solution: at a magnet this is contact, elsewhere numbers beyond reach."""
    record, one = march.records[row], march.fleet.one
    position = one.scenario.position_m + float(one.c[MAGNETS] @ march.state[row])
    if abs(position) > NEAR * one.magnets.bearing.air_gap_m:
        record.stop(End.TOUCHED_DOWN, time_s, f"{_when(time_s)} the rotor touched the stator")
    else:
        record.stop(End.NOT_FINITE, time_s, f"{_when(time_s)} the loop has no finite state any more")


def _when(time_s: float) -> str:
    """The time as it stands in a sentence."""
    return f"after {1e3 * time_s:.4g} ms"

"""The march through time: steps as wide as the tolerance allows, until the end, the stator or a number that is none.

The error of a step is the impulse of its defect, and that is held below a fraction of the impulse which the net force
has given the rotor so far. This measures a step of a nanometre and one of half the gap alike, and needs no scale from
the user. Where the force has a kink (a limit met, a coil switched off) the steps shrink until the kink does not matter.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from magbear_cli.errors import NumericsError
from magbear_cli.simulation.collocation import (
    STAGES,
    Propagator,
    Step,
    build_propagator,
    carried_on,
    knots,
    solve_step,
)
from magbear_cli.simulation.loop import DEMAND, MAGNETS, SENSOR, Loop
from magbear_cli.simulation.trajectory import End, Piece, Trajectory, curves, piecewise

Floats = NDArray[np.float64]

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
class _Run:
    """What the march carries along."""

    loop: Loop
    state: Floats
    impulse_n_s: float = 0.0
    pieces: list[Piece] = field(default_factory=list)
    pulse_n: float = 0.0
    rejected: int = 0
    propagators: dict[float, Propagator] = field(default_factory=dict)
    end: End = End.FINISHED
    sentence: str = ""
    end_s: float = 0.0

    def propagator(self, width_s: float) -> Propagator:
        """The linear part over a width, computed once."""
        if width_s not in self.propagators:
            self.propagators[width_s] = build_propagator(self.loop, width_s)
        return self.propagators[width_s]

    def stop(self, end: End, time_s: float, sentence: str) -> bool:
        """End the run here; always True."""
        self.end, self.end_s, self.sentence = end, time_s, sentence
        return True


def integrate(loop: Loop, duration_s: float) -> Trajectory:
    """The course of the loop from its start to the duration, or to whatever ends it before.

    Raises
    ------
    NumericsError
        when the loop has no finite force at t = 0.
    """
    run = _Run(loop, loop.start)
    with np.errstate(all="ignore"):  # non-finite numbers are looked for after every step
        for start_s, end_s, pulse_n in loop.scenario.segments(duration_s):
            if _march(run, start_s, end_s, pulse_n):
                break
        else:
            run.end_s = duration_s
    if not run.pieces:
        raise NumericsError(f"the simulation has no first step: {run.sentence}")
    position, current, command = curves(loop, run.pieces)
    return Trajectory(
        position, current, command, run.end_s, run.end, run.sentence, run.state, len(run.pieces), run.rejected
    )


def _march(run: _Run, start_s: float, end_s: float, pulse_n: float) -> bool:
    """Step through a span of constant pulse; True when the run has ended in it.

    Widths are the span halved a whole number of times, and a step of 2^-k begins at a multiple of 2^-k, so that few
    different exponentials are needed. ``place`` counts in the finest width.
    """
    span = end_s - start_s
    finest = min(FINEST, int(np.log2(span / (8.0 * np.finfo(float).eps * end_s))))
    place, total, level, failures = 0, 2**finest, min(FIRST, finest), 0
    while place < total:
        level = max(level, finest - _twos(place, finest))
        time, width = start_s + span * (place / total), span * 2.0**-level
        tolerance = 0.01 * TOLERANCE * run.impulse_n_s
        step = solve_step(run.loop, run.propagator(width), run.state, pulse_n, _guess(run, width, pulse_n), tolerance)
        if step is None and level == finest:
            return _cannot_step(run, time)
        if len(run.pieces) + run.rejected > STEP_BUDGET:
            return run.stop(End.DIVERGED, time, f"{_when(time)} the current chatters too fast to be followed")
        halvings = 1 if step is None else _halvings(run, step, width)
        if step is None or (halvings > 0 and level < finest):
            failures += 1
            run.rejected += 1
            level = min(finest, level + max(halvings, failures))  # ever faster: there is a kink here
            continue
        _accept(run, Piece(time, width, step), pulse_n)
        if _has_ended(run, run.pieces[-1]):
            return True
        failures = 0
        place += 2 ** (finest - level)
        level = min(finest, max(0, level + halvings))
    return False


def _twos(place: int, most: int) -> int:
    """How many times a number can be halved."""
    return most if place == 0 else (place & -place).bit_length() - 1


def _guess(run: _Run, width_s: float, pulse_n: float) -> Floats:
    """Forces to begin Newton's method with: the last step's polynomial carried on, or the last force held."""
    if not run.pieces:
        outputs = run.loop.c @ run.state
        force, _, _ = run.loop.magnets.force(outputs[MAGNETS], outputs[DEMAND])
        return np.full(STAGES, float(force) + pulse_n)
    last = run.pieces[-1]
    added = pulse_n - run.pulse_n
    ratio = width_s / last.width_s
    if ratio > FARTHEST_EXTRAPOLATION:
        return np.full(STAGES, last.step.forces[-1] + added)
    return carried_on(float(f"{ratio:.6g}")) @ last.step.forces + added


def _halvings(run: _Run, step: Step, width_s: float) -> int:
    """How many times to halve the width: above zero, the step must be taken again; else it is that of the next one."""
    impulse = run.impulse_n_s + width_s * float(np.abs(step.forces).mean())
    allowed = TOLERANCE * impulse
    error = width_s * (step.defect_n - step.noise_n)
    if error <= 0.0:
        return -MOST_DOUBLINGS
    if allowed == 0.0:
        return 1
    wanted = np.log2(2.0 * error / allowed) / (STAGES + 1)  # the defect goes with width^STAGES
    return max(1, int(np.ceil(wanted))) if error > allowed else -int(np.clip(np.floor(-wanted), 0, MOST_DOUBLINGS))


def _accept(run: _Run, piece: Piece, pulse_n: float) -> None:
    """Go to the end of the step."""
    run.pieces.append(piece)
    run.state = piece.step.end
    run.pulse_n = pulse_n
    run.impulse_n_s += piece.width_s * float(np.abs(piece.step.forces).mean())


def _has_ended(run: _Run, piece: Piece) -> bool:
    """Whether the rotor touched the stator in a step, at the magnets or at the sensor, or the demand ran away."""
    below, above = run.loop.magnets.gap_m
    outputs = piece.step.outputs
    left = 0.0 if run.loop.magnets.is_linear else CONTACT * run.loop.magnets.bearing.air_gap_m
    contacts = [
        _contact_s(piece, outputs[:, channel], limit, distance)
        for channel, distance in ((MAGNETS, left), (SENSOR, 0.0))
        for limit in (below, above)
    ]
    if np.isfinite(min(contacts)):
        time = min(contacts)
        return run.stop(End.TOUCHED_DOWN, time, f"{_when(time)} the rotor touched the stator")
    end = piece.start_s + piece.width_s
    if np.abs(outputs[:, DEMAND]).max() > LARGEST_CURRENT_A:
        return run.stop(End.DIVERGED, end, f"{_when(end)} the controller asked for more than {LARGEST_CURRENT_A:g} A")
    return False


def _contact_s(piece: Piece, positions_m: Floats, limit_m: float, left_m: float) -> float:
    """When the position reaches a limit, in s; infinite when it does not in this step.

    The attraction grows without bound at a magnet. So the position is followed to a short distance from it, and the
    rest is gone at the speed reached there.
    """
    side = np.sign(limit_m)
    left = side * (limit_m - positions_m) - left_m
    beyond = np.flatnonzero(left <= 0.0)
    if not beyond.size:
        return float(np.inf)
    distance = piecewise([piece], left[None, :])
    time, until = piece.start_s, piece.start_s + piece.width_s * float(knots()[beyond[0]])
    if distance(time) > 0.0:  # else it starts there
        is_crossed = distance(until) < 0.0
        time = float(brentq(distance, time, until, xtol=1e-300, rtol=1e-14)) if is_crossed else until
    speed = -float(distance.derivative()(time))
    return time + (left_m / speed if speed > 0.0 else 0.0)


def _cannot_step(run: _Run, time_s: float) -> bool:
    """End a run whose finest step has no solution: at a magnet this is contact, elsewhere numbers beyond reach."""
    outputs = run.loop.c @ run.state
    position = run.loop.scenario.position_m + float(outputs[MAGNETS])
    if abs(position) > NEAR * run.loop.magnets.bearing.air_gap_m:
        return run.stop(End.TOUCHED_DOWN, time_s, f"{_when(time_s)} the rotor touched the stator")
    return run.stop(End.NOT_FINITE, time_s, f"{_when(time_s)} the loop has no finite state any more")


def _when(time_s: float) -> str:
    """The time as it stands in a sentence."""
    return f"after {1e3 * time_s:.4g} ms"

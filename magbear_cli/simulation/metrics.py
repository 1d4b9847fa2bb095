"""The figures of a step response: settling time, overshoot, rise time, peak current, final error.

They are measured on the polynomials of the run, not on its samples, so that no peak falls between two samples.
Settling, overshoot and rise are relative to where the response comes to rest, which differs from the command by the
final error: a bearing without integral action rests beside its command.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from magbear_cli.simulation.crossings import crossings, extremes
from magbear_cli.simulation.loop import DEMAND, MAGNETS, SENSOR, Loop

Floats = NDArray[np.float64]

BAND = 0.02  # settled: within 2 % of the rest
RISE = (0.1, 0.9)  # of the rest
CALM = 0.05  # the last part of the run that must lie within the band for it to count as settled


@dataclass(frozen=True)
class StepMetrics:
    """The figures of one run; None where a figure has no meaning.

    For a step they are relative to its final value: ``settling_time_s`` until the response stays within 2 % of it,
    ``overshoot`` the excursion beyond it, as a fraction, ``rise_time_s`` from 10 to 90 %. For a pulse (no step)
    settling is relative to the largest deviation, ``overshoot`` is the excursion on the other side of the rest as a
    fraction of it, and there is no rise. ``final_error_m`` is the last position minus the command.
    ``peak_current_a`` is the largest magnitude of the control current; it is measured in every run.
    """

    settling_time_s: float | None
    overshoot: float | None
    rise_time_s: float | None
    peak_current_a: float | None
    final_error_m: float | None


def rest_state(loop: Loop, near: Floats) -> Floats | None:
    """The state without change to which a state belongs, by Newton's method on A x + B f = 0; None if none is found."""
    state = near.copy()
    moving = slice(0, loop.b.size - 1)  # the last state is constant
    with np.errstate(all="ignore"):
        for _ in range(30):
            outputs = loop.c @ state
            force, stiffness, gain = (float(x) for x in loop.magnets.force(outputs[MAGNETS], outputs[DEMAND]))
            slope = loop.a + np.outer(loop.b, stiffness * loop.c[MAGNETS] + gain * loop.c[DEMAND])
            try:
                change = np.linalg.solve(slope[moving, moving], -(loop.a @ state + loop.b * force)[moving])
            except np.linalg.LinAlgError:
                return None
            state[moving] += change
            if not np.isfinite(state).all():
                return None
            if np.abs(loop.c[[MAGNETS, SENSOR]][:, moving] @ change).max() <= 1e-12 * loop.magnets.bearing.air_gap_m:
                return state
    return None


def step_metrics(
    position_m: PPoly, step_m: float, rest_m: float, peak_current_a: float, nothing_m: float = 0.0
) -> StepMetrics:
    """The figures of a run that went to its end.

    Parameters
    ----------
    position_m : the deviation over time, from 0 to the end of the run
    rest_m : where the response comes to rest
    nothing_m : a motion up to this is none; then there is nothing to settle, and for a step nothing that has settled
    """
    duration_s = float(position_m.x[-1])
    low, high = extremes(position_m)
    is_step = step_m != 0.0 and abs(rest_m) > nothing_m
    size = abs(rest_m) if is_step else max(high, -low)
    final_error = float(position_m(duration_s)) - step_m
    if size <= nothing_m:
        return StepMetrics(0.0 if step_m == 0.0 else None, None, None, peak_current_a, final_error)
    upward = rest_m > 0.0 if is_step else high < -low
    beyond = high - rest_m if upward else rest_m - low
    band = BAND * size
    levels = [rest_m - band, rest_m + band, *((part * rest_m for part in RISE) if is_step else ())]
    entries, exits, *passages = crossings(position_m, levels)
    return StepMetrics(
        settling_time_s=_settling_time(position_m, duration_s, rest_m, band, np.concatenate([entries, exits])),
        overshoot=max(0.0, beyond) / size,
        rise_time_s=_rise_time(duration_s, *passages) if is_step else None,
        peak_current_a=peak_current_a,
        final_error_m=final_error,
    )


def peak_magnitude(curve: PPoly, end_s: float) -> float:
    """The largest magnitude of a curve from its beginning to the end given."""
    return max(abs(value) for value in extremes(_until(curve, end_s)))


def _until(curve: PPoly, end_s: float) -> PPoly:
    """The curve up to a time."""
    if end_s >= curve.x[-1]:
        return curve
    pieces = max(1, int(np.searchsorted(curve.x, end_s)))
    return PPoly(curve.c[:, :pieces], np.append(curve.x[:pieces], end_s))


def _settling_time(curve: PPoly, end_s: float, rest: float, band: float, borders_s: Floats) -> float | None:
    """The last time at which the curve passes a border of the band around its rest; None when it has not stayed in."""
    last = float(borders_s[borders_s <= end_s].max(initial=0.0))
    calm = np.linspace(last, end_s, 33)[1:]
    if last > (1.0 - CALM) * end_s or (np.abs(curve(calm) - rest) > band * (1.0 + 1e-9)).any():
        return None
    return last


def _rise_time(end_s: float, first: Floats, second: Floats) -> float | None:
    """From the first passage of 10 % to the first passage of 90 % of the rest; None when that is not reached."""
    if not (first.size and second.size) or second[0] > end_s:
        return None
    return float(second[0] - first[0])

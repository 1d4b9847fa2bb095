"""The response of the adaptive loop to a step or a pulse: its samples and its figures.

``simulate_adaptive_step`` is the page to read first: close the loop, march (``adaptive_march``), sample, measure.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from magbear_cli.model.adaptive_law import AdaptiveLaw
from magbear_cli.model.bearing import Bearing
from magbear_cli.simulation.adaptive_flow import FINE
from magbear_cli.simulation.adaptive_loop import (
    AT_SENSOR,
    MEASURED,
    MODEL,
    MODEL_SPEED,
    SPEED,
    close_adaptive_loop,
)
from magbear_cli.simulation.adaptive_march import March, march
from magbear_cli.simulation.linear import LONGEST_S, NOTHING
from magbear_cli.simulation.metrics import StepMetrics, peak_magnitude, step_metrics
from magbear_cli.simulation.scenario import StepScenario
from magbear_cli.simulation.step import StepResponse
from magbear_cli.simulation.trajectory import End, piecewise

Floats = NDArray[np.float64]

SETTLING_TIMES = 30.0  # time constants of the reference model in a duration that is chosen
LATE = 0.5  # of a run: from here on the error is that of a law which has had time to learn


def simulate_adaptive_step(bearing: Bearing, law: AdaptiveLaw, scenario: StepScenario) -> StepResponse:
    """The response of a bearing under the adaptive law to a step of its reference model's command and/or a pulse.

    Parameters
    ----------
    bearing : the magnets
    law : the adaptive law; what it feeds back is the measured signal and its exact derivative
    scenario : what is done to the loop; a prefilter acts on the command of the reference model

    Returns
    -------
    StepResponse; ``reference_m`` is the reference model's response. The law has no linear loop to show beside it, so
    that the linear curves are NaN: the law on the linearised force is a run of its own, ``model: linear``. The step
    is settled relative to the last position, as the law comes to rest anywhere within its sphere. ``statistics``
    holds the tracking errors |x_m − y| of the whole run and of its second half, the same and those of the speed in
    its third and fourth quarters, the number of switchings, the part of the time spent adapting, and the estimate at
    the end.

    Raises
    ------
    NumericsError
        when the parts do not fit together: an operating point or a weight that the magnets cannot hold, a sensor's
        mass larger than the rotor's.
    """
    loop = close_adaptive_loop(bearing, law, scenario)
    duration = scenario.duration_s or choose_adaptive_duration(law, scenario)
    with np.errstate(all="ignore"):  # a run that ends beyond all bounds has figures that are none
        return _response(march(loop, duration))


def choose_adaptive_duration(law: AdaptiveLaw, scenario: StepScenario) -> float:
    """A duration in s: thirty time constants of the reference model's slower pole, counted from the end of a pulse."""
    spread = np.sqrt(max(law.zeta**2 - 1.0, 0.0))
    slowest = law.omega_rad_s * (1.0 / (law.zeta + spread) if law.zeta > 1.0 else law.zeta)
    wanted = SETTLING_TIMES / slowest
    if scenario.prefilter is not None:
        wanted = max(wanted, 20.0 / scenario.prefilter.omega_rad_s)
    begun = 0.0 if scenario.disturbance is None else scenario.disturbance.end_s
    return float(min(begun + wanted, begun + LONGEST_S))


def _response(run: March) -> StepResponse:
    """The samples and the figures of a run that has ended."""
    scenario, nothing = run.loop.scenario, np.full(1, np.nan)
    if not run.widths:
        rest = np.array([scenario.position_m])
        metrics = StepMetrics(None, None, None, None, None)
        return StepResponse(
            np.zeros(1), rest, nothing, rest, nothing, nothing, run.end, run.sentence, metrics, {"steps": 0.0}
        )
    limit = scenario.current_limit_a or np.inf
    outputs = (run.loop.c @ np.stack(run.knots)[:, : run.loop.order]).transpose(1, 0, 2)  # (7, steps, knots)
    outputs += scenario.step_m * run.loop.feed[:, None, None]
    current = run.loop.magnets.standing_current_a + np.stack(run.demands)
    curves = [_curve(run, values) for values in (outputs[AT_SENSOR], current, outputs[MODEL])]
    time = np.linspace(0.0, run.time_s, scenario.samples)  # even: what rings here may ring at any time
    position, current_a, model = (curve(time) for curve in curves)
    nowhere = np.full(time.size, np.nan)
    metrics, sentence = _measured(run, curves[0], min(peak_magnitude(curves[1], run.time_s), limit))
    return StepResponse(
        time_s=time,
        position_m=scenario.position_m + position,
        current_a=np.clip(current_a, -limit, limit),
        reference_m=scenario.position_m + model,
        linear_position_m=nowhere,
        linear_current_a=nowhere,
        end=run.end,
        sentence=sentence,
        metrics=metrics,
        statistics=_statistics(run, outputs),
    )


def _curve(run: March, values: Floats) -> PPoly:
    """The polynomials through values at the knots of every step, (steps, knots)."""
    return piecewise(np.array(run.starts), np.array(run.widths), values, run.time_s)


def _measured(run: March, position_m: PPoly, peak_current_a: float) -> tuple[StepMetrics, str]:
    if run.end is not End.FINISHED:
        return StepMetrics(None, None, None, peak_current_a, None), run.sentence
    nothing = NOTHING * run.loop.magnets.bearing.air_gap_m
    step, last = run.loop.scenario.step_m, float(position_m(run.time_s))
    metrics = step_metrics(position_m, step, last, peak_current_a, nothing)
    if metrics.settling_time_s is None:
        return metrics, f"the response had not settled when the simulation ended, after {1e3 * run.time_s:.4g} ms"
    return metrics, ""


def _statistics(run: March, outputs: Floats) -> dict[str, float]:
    """The tracking errors, and how often the adaptation was switched."""
    times = _grid(run)
    position, speed = (
        _Magnitude(_curve(run, outputs[wanted] - outputs[felt]), times)
        for wanted, felt in ((MODEL, MEASURED), (MODEL_SPEED, SPEED))
    )
    return {
        "steps": float(len(run.widths)),
        "switchings": float(run.switchings),
        "adapting_share": float(run.adapting_s / run.time_s),
        "largest_error_m": position.largest(0.0, 1.0),
        "tracking_error_m": position.largest(LATE, 1.0),
        "third_quarter_error_m": position.largest(0.5, 0.75),
        "fourth_quarter_error_m": position.largest(0.75, 1.0),
        "third_quarter_speed_error_m_per_s": speed.largest(0.5, 0.75),
        "fourth_quarter_speed_error_m_per_s": speed.largest(0.75, 1.0),
        "estimate_constant_a": float(run.state[-3]),
        "estimate_position_a_per_m": float(run.state[-2]),
        "estimate_speed_a_s_per_m": float(run.state[-1]),
    }


def _grid(run: March) -> Floats:
    """Times at which errors are looked at: the same number in every step, and the quarters of the run."""
    begin, end = np.array(run.starts)[:, None], np.array(run.ends)[:, None]
    inner = (begin + (end - begin) * FINE[:-1:2]).ravel()
    return np.unique(np.concatenate([inner, run.time_s * np.arange(5) / 4.0]))


class _Magnitude:
    """The magnitude of a curve on a grid of times, fine enough that between neighbours it is a parabola."""

    def __init__(self, curve: PPoly, times: Floats) -> None:
        self.curve, self.times, self.values = curve, times, np.abs(curve(times))

    def largest(self, begin: float, end: float) -> float:
        """The largest magnitude between two parts of the run: at a time of the grid or on the parabola's vertex."""
        first, last = np.searchsorted(self.times, self.times[-1] * np.array([begin, end])).tolist()
        at = first + int(self.values[first : last + 1].argmax())
        found = float(self.values[at])
        if first < at < last:
            (a, b, c), (u, v, w) = self.times[at - 1 : at + 2].tolist(), self.values[at - 1 : at + 2].tolist()
            left, right = (v - u) / (b - a), (w - v) / (c - b)
            if left > right:
                vertex = 0.5 * (a + b) - left * 0.5 * (c - a) / (right - left)
                found = max(found, abs(float(self.curve(min(max(vertex, a), c)))))
        return found

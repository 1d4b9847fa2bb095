"""The response of a closed loop to a step of the command or a pulse of force, and its figures.

``simulate_step`` is the page to read first: close the loop, choose a duration, march, sample, measure.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.bearing import Bearing
from magbear_cli.simulation.integration import integrate
from magbear_cli.simulation.linear import LONGEST_S, NOTHING, LinearLoop, choose_duration, linear_response, linearize
from magbear_cli.simulation.loop import SENSOR, Loop, close_loop
from magbear_cli.simulation.metrics import StepMetrics, peak_magnitude, rest_state, step_metrics
from magbear_cli.simulation.scenario import StepScenario
from magbear_cli.simulation.trajectory import End, Trajectory

Floats = NDArray[np.float64]

EXTENSION = 4.0  # times a chosen duration, when that was too short for the nonlinear loop


@dataclass(frozen=True, eq=False)
class StepResponse:
    """How a run went: its samples from 0 to its end, how it ended, and its figures.

    Attributes
    ----------
    time_s : (samples,)
    position_m : (samples,) the rotor's position in the gap, at the sensor
    current_a : (samples,) the control current, after the limit; the standing current is part of it
    reference_m : (samples,) the filtered command, in the coordinate of ``position_m``
    linear_position_m, linear_current_a : (samples,) the linear loop without limit and stator, at the same times; NaN
        where it has grown out of all bounds
    end : finished, touched_down, not_finite or diverged
    sentence : why the run ended early or has no settling time; empty when there is nothing to say
    metrics : the figures; after an early end only the peak current
    statistics : steps taken and rejected
    """

    time_s: Floats
    position_m: Floats
    current_a: Floats
    reference_m: Floats
    linear_position_m: Floats
    linear_current_a: Floats
    end: End
    sentence: str
    metrics: StepMetrics
    statistics: dict[str, float]


def simulate_step(bearing: Bearing, controller: StateSpace, scenario: StepScenario) -> StepResponse:
    """The response of the closed loop to a step and/or a pulse.

    Parameters
    ----------
    bearing : the magnets
    controller : from the measured deviation minus the filtered command (m) to the control current's deviation (A)
    scenario : what is done to the loop

    Returns
    -------
    StepResponse; a touch-down, a runaway and a number that is none are ends of a run, not exceptions

    Raises
    ------
    NumericsError
        when the parts do not fit together: a controller of the wrong size, an operating point or a weight that the
        magnets cannot hold, a sensor's mass larger than the rotor's.

    Notes
    -----
    m z̈ = F(z, u) + pulse − load, u = K (y − r_f), F of thesis eqs. 2.1 and 4.1, prefilter of eq. 3.7,
    sensor of eq. 2.11.
    """
    loop = close_loop(bearing, controller, scenario)
    linear = linearize(loop)
    try:
        trajectory, metrics, sentence = _run(loop, linear)
    except NumericsError as error:
        return _never_began(loop, str(error))
    time = scenario.sample_times(trajectory.end_s)
    limit = scenario.current_limit_a or np.inf
    inside = np.minimum(time, trajectory.position_m.x[-1])
    position = scenario.position_m + trajectory.position_m(inside)
    linear_position, linear_current = linear_response(linear, time)
    return StepResponse(
        time_s=time,
        position_m=position,
        current_a=np.clip(trajectory.current_a(inside), -limit, limit),
        reference_m=scenario.position_m + trajectory.command_m(inside),
        linear_position_m=scenario.position_m + np.where(np.isfinite(linear_position), linear_position, np.nan),
        linear_current_a=np.where(np.isfinite(linear_current), linear_current, np.nan),
        end=trajectory.end,
        sentence=sentence,
        metrics=metrics,
        statistics={"steps": float(trajectory.steps), "rejected": float(trajectory.rejected)},
    )


def _run(loop: Loop, linear: LinearLoop) -> tuple[Trajectory, StepMetrics, str]:
    """The run and its figures; a chosen duration is tried again, longer, when the linear loop settles and this not."""
    scenario = loop.scenario
    duration = scenario.duration_s or choose_duration(linear)
    trajectory = integrate(loop, duration)
    metrics, sentence = _measure(loop, trajectory)
    unsettled = trajectory.end == End.FINISHED and metrics.settling_time_s is None
    if unsettled and scenario.duration_s is None and linear.is_stable:
        trajectory = integrate(loop, min(EXTENSION * duration, max(LONGEST_S, duration)))
        metrics, sentence = _measure(loop, trajectory)
    return trajectory, metrics, sentence


def _measure(loop: Loop, trajectory: Trajectory) -> tuple[StepMetrics, str]:
    """The figures of a run, and what there is to say about it."""
    limit = loop.scenario.current_limit_a or np.inf  # the polynomials may swing past it by what their tolerance allows
    peak = min(peak_magnitude(trajectory.current_a, trajectory.end_s), limit)
    if trajectory.end != End.FINISHED:
        return StepMetrics(None, None, None, peak, None), trajectory.sentence
    state = rest_state(loop, trajectory.state)
    rest = float(trajectory.position_m(trajectory.end_s)) if state is None else float(loop.c[SENSOR] @ state)
    nothing = NOTHING * loop.magnets.bearing.air_gap_m
    metrics = step_metrics(trajectory.position_m, loop.scenario.step_m, rest, peak, nothing)
    if metrics.settling_time_s is None:
        return metrics, f"the response had not settled when the simulation ended, after {1e3 * trajectory.end_s:.4g} ms"
    return metrics, ""


def _never_began(loop: Loop, sentence: str) -> StepResponse:
    """The answer when not even the first step is finite: one sample, at rest, without a current."""
    rest, nothing = np.array([loop.scenario.position_m]), np.array([np.nan])
    return StepResponse(
        time_s=np.zeros(1),
        position_m=rest,
        current_a=nothing,
        reference_m=rest,
        linear_position_m=rest,
        linear_current_a=nothing,
        end=End.NOT_FINITE,
        sentence=sentence,
        metrics=StepMetrics(None, None, None, None, None),
        statistics={"steps": 0.0, "rejected": 0.0},
    )

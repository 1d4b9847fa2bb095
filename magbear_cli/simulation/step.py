"""The response of a closed loop to a step of the command or a pulse of force, and its figures.

``simulate_steps`` is the page to read first: close the loops, choose a duration, march, sample, measure.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.bearing import Bearing
from magbear_cli.simulation.integration import integrate_fleet
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
    (response,) = simulate_steps(bearing, controller, [scenario])
    if isinstance(response, NumericsError):
        raise response
    return response


def simulate_steps(
    bearing: Bearing, controller: StateSpace, scenarios: Sequence[StepScenario]
) -> list[StepResponse | NumericsError]:
    """The responses of one controller in many scenarios, in their order; one whose parts do not fit is an error.

    Scenarios of one given duration that differ in the mass of a rigid rotor only are marched through time together.
    """
    loops: list[Loop | NumericsError] = []
    for scenario in scenarios:
        try:
            loops.append(close_loop(bearing, controller, scenario))
        except NumericsError as error:
            loops.append(error)
    runs = _run_together([loop for loop in loops if isinstance(loop, Loop)])
    return [next(runs) if isinstance(loop, Loop) else loop for loop in loops]


def _run_together(loops: Sequence[Loop]) -> Iterator[StepResponse | NumericsError]:
    """The responses of the loops, in their order."""
    fleets: dict[Hashable, list[Loop]] = {}
    for loop in loops:
        fleets.setdefault(_fleet_key(loop), []).append(loop)
    marched = {
        key: iter(integrate_fleet(fleet, fleet[0].scenario.duration_s or 0.0))
        for key, fleet in fleets.items()
        if fleet[0].scenario.duration_s is not None
    }
    for loop in loops:
        key = _fleet_key(loop)
        try:
            linear = linearize(loop)
            yield _response(loop, linear, next(marched[key]) if key in marched else _run(loop, linear))
        except NumericsError as error:
            yield error


def _fleet_key(loop: Loop) -> Hashable:
    """What loops that are marched together have in common; loops whose durations are chosen have nothing."""
    if loop.scenario.duration_s is None or loop.scenario.rotor is not None:
        return id(loop)
    return replace(loop.scenario, mass_kg=1.0), loop.a.tobytes(), loop.c.tobytes()


def _response(loop: Loop, linear: LinearLoop, trajectory: Trajectory | NumericsError) -> StepResponse:
    """The samples and the figures of a run."""
    if isinstance(trajectory, NumericsError):
        return _never_began(loop, str(trajectory))
    scenario, (metrics, sentence) = loop.scenario, _measure(loop, trajectory)
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


def _run(loop: Loop, linear: LinearLoop) -> Trajectory | NumericsError:
    """A run of a chosen duration, tried again, longer, when the linear loop settles and this one does not."""
    duration = loop.scenario.duration_s or choose_duration(linear)
    (trajectory,) = integrate_fleet([loop], duration)
    if isinstance(trajectory, NumericsError) or loop.scenario.duration_s is not None:
        return trajectory
    metrics, _ = _measure(loop, trajectory)
    if trajectory.end == End.FINISHED and metrics.settling_time_s is None and linear.is_stable:
        (trajectory,) = integrate_fleet([loop], min(EXTENSION * duration, max(LONGEST_S, duration)))
    return trajectory


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

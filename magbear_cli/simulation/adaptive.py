"""The response of the adaptive loop to a step or a pulse: smooth pieces between the switchings of the adaptation.

``simulate_adaptive_step`` is the page to read first. Within a piece the differential equation is smooth but for the
kinks of the force (a coil switched off, the current's limit), which the error control of the Runge-Kutta method
resolves. A piece ends where the error crosses the sphere's border, found on the method's own interpolant.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853
from scipy.interpolate import PPoly
from scipy.optimize import brentq

from magbear_cli.model.adaptive_law import AdaptiveLaw
from magbear_cli.model.bearing import Bearing
from magbear_cli.simulation.adaptive_loop import (
    AT_MAGNETS,
    AT_SENSOR,
    COEFFICIENTS,
    MEASURED,
    MODEL,
    MODEL_SPEED,
    SPEED,
    AdaptiveLoop,
    close_adaptive_loop,
)
from magbear_cli.simulation.collocation import knots
from magbear_cli.simulation.integration import LARGEST_CURRENT_A
from magbear_cli.simulation.linear import LONGEST_S, NOTHING
from magbear_cli.simulation.metrics import StepMetrics, peak_magnitude, step_metrics
from magbear_cli.simulation.scenario import StepScenario
from magbear_cli.simulation.step import StepResponse
from magbear_cli.simulation.trajectory import End, piecewise

Floats = NDArray[np.float64]

RELATIVE_TOLERANCE = 1e-8
ABSOLUTE_TOLERANCE = 1e-9  # of the step or the sphere, for what is a position
STEP_BUDGET = 30_000  # steps of all pieces together: some fifteen seconds
SWITCH_BUDGET = 5_000  # more switchings than this in one run is chattering
LEFT = 1e-4  # of the gap: so near to a magnet the rotor has touched it
NEAR = 0.98  # of the gap: a step that cannot be made beyond this is contact
SETTLING_TIMES = 30.0  # time constants of the reference model in a duration that is chosen
LATE = 0.5  # of a run: from here on the error is that of a law which has had time to learn


@dataclass
class _Run:
    """What the march carries along: the state, the switch, and the values at the knots of every step taken."""

    loop: AdaptiveLoop
    state: Floats
    time_s: float = 0.0
    adapting: bool = False
    centre: tuple[float, float] = (0.0, 0.0)
    switchings: int = 0
    adapting_s: float = 0.0
    steps: int = 0
    starts: list[float] = field(default_factory=list)
    widths: list[float] = field(default_factory=list)
    outputs: list[Floats] = field(default_factory=list)
    demands: list[Floats] = field(default_factory=list)
    end: End = End.FINISHED
    sentence: str = ""

    def stop(self, end: End, sentence: str) -> None:
        """End the run here."""
        self.end, self.sentence = end, f"after {1e3 * self.time_s:.4g} ms {sentence}"


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
    run = _Run(loop, np.zeros(loop.order + COEFFICIENTS))
    with np.errstate(all="ignore"):  # beyond a magnet the force is no number: the step is taken back
        for start_s, end_s, pulse_n in scenario.segments(duration):
            run.time_s = start_s
            while run.end is End.FINISHED and run.time_s < end_s:
                _piece(run, end_s, pulse_n)
        return _response(run)


def choose_adaptive_duration(law: AdaptiveLaw, scenario: StepScenario) -> float:
    """A duration in s: thirty time constants of the reference model's slower pole, counted from the end of a pulse."""
    spread = np.sqrt(max(law.zeta**2 - 1.0, 0.0))
    slowest = law.omega_rad_s * (1.0 / (law.zeta + spread) if law.zeta > 1.0 else law.zeta)
    wanted = SETTLING_TIMES / slowest
    if scenario.prefilter is not None:
        wanted = max(wanted, 20.0 / scenario.prefilter.omega_rad_s)
    begun = 0.0 if scenario.disturbance is None else scenario.disturbance.end_s
    return float(min(begun + wanted, begun + LONGEST_S))


def _piece(run: _Run, end_s: float, pulse_n: float) -> None:
    """March until the switch of the adaptation turns, the span of constant pulse ends, or the run does."""
    loop = run.loop
    size = max(abs(loop.scenario.step_m), loop.law.rho_m)
    absolute = np.full(run.state.size, ABSOLUTE_TOLERANCE * size)
    gains = (1.0, 1.0 / size, 1.0 / (size * loop.law.omega_rad_s))
    absolute[loop.order :] *= loop.law.feedforward_a_per_m * np.array(gains)
    slope = loop.derivative(pulse_n=pulse_n, centre=run.centre, adapting=run.adapting)
    method = DOP853(slope, run.time_s, run.state, end_s, rtol=RELATIVE_TOLERANCE, atol=absolute)
    while method.status == "running":
        method.step()
        if method.status == "failed":
            _cannot_step(run)
            return
        curve = method.dense_output()
        until, turns = method.t, False
        states = curve(run.time_s + (method.t - run.time_s) * knots())
        crossing = _first_crossing(run, states)
        if crossing is not None:
            until, turns = _crossing_time(run, curve, crossing, method.t), True
            states = curve(run.time_s + (until - run.time_s) * knots())
        _accept(run, until, states)
        if run.end is not End.FINISHED:
            return
        if turns:
            _switch(run)
            return


def _first_crossing(run: _Run, states: Floats) -> int | None:
    """The first knot of a step beyond which the switch has to turn; None if it need not."""
    norm, law = run.loop.error_norm(states), run.loop.law
    beyond = norm < law.inner_m if run.adapting else norm >= law.outer_m
    found = np.flatnonzero(beyond)
    return int(found[0]) if found.size else None


def _crossing_time(run: _Run, curve: DOP853, knot: int, end_s: float) -> float:
    """When the error crosses the border, on the interpolant of a step."""
    width = end_s - run.time_s
    if knot == 0 or width <= 0.0:
        return run.time_s
    distance = run.loop.distance_to_inner if run.adapting else run.loop.distance_to_outer
    before, after = (run.time_s + width * float(knots()[index]) for index in (knot - 1, knot))
    if distance(curve(before)) * distance(curve(after)) >= 0.0:
        return after
    return float(brentq(lambda time: distance(curve(time)), before, after, xtol=1e-15, rtol=1e-13))


def _switch(run: _Run) -> None:
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
    slopes = run.state[-2:]
    run.state[-3] += slopes @ (np.array(centre) - np.array(run.centre))
    run.centre = centre


def _accept(run: _Run, until_s: float, states: Floats) -> None:
    """Go to the end of a step, and look whether the run has ended in it."""
    loop, gap = run.loop, run.loop.magnets.gap_m
    if not np.isfinite(states).all():
        run.stop(End.NOT_FINITE, "the loop has no finite state any more")
        return
    if until_s > run.time_s:
        out, demand = loop.outputs(states), loop.demand_a(states, run.centre)
        run.starts.append(run.time_s)
        run.widths.append(until_s - run.time_s)
        run.outputs.append(out)
        run.demands.append(demand)
        run.adapting_s += (until_s - run.time_s) * run.adapting
        run.steps += 1
        run.state, run.time_s = states[:, -1], until_s
        left = 0.0 if loop.magnets.is_linear else LEFT * loop.magnets.bearing.air_gap_m
        low, high = min(out[AT_MAGNETS].min() - left, out[AT_SENSOR].min()), max(
            out[AT_MAGNETS].max() + left, out[AT_SENSOR].max()
        )  # fmt: skip
        if low <= gap[0] or high >= gap[1]:
            run.stop(End.TOUCHED_DOWN, "the rotor touched the stator")
        elif np.abs(demand).max() > LARGEST_CURRENT_A:
            run.stop(End.DIVERGED, f"the controller asked for more than {LARGEST_CURRENT_A:g} A")
        elif run.steps > STEP_BUDGET:
            run.stop(End.DIVERGED, "the loop moves too fast to be followed")


def _cannot_step(run: _Run) -> None:
    """End a run whose next step has no solution: at a magnet this is contact, elsewhere numbers beyond reach."""
    position = run.loop.scenario.position_m + float(run.loop.outputs(run.state[:, None])[AT_MAGNETS, 0])
    if abs(position) > NEAR * run.loop.magnets.bearing.air_gap_m:
        run.stop(End.TOUCHED_DOWN, "the rotor touched the stator")
    else:
        run.stop(End.NOT_FINITE, "the loop has no finite state any more")


def _polynomials(run: _Run, values: Floats) -> PPoly:
    """The polynomials through values at the knots of every step, (steps, knots)."""
    return piecewise(np.array(run.starts), np.array(run.widths), values)


def _response(run: _Run) -> StepResponse:
    """The samples and the figures of a run that has ended."""
    scenario, nothing = run.loop.scenario, np.full(1, np.nan)
    if not run.widths:
        rest = np.array([scenario.position_m])
        metrics = StepMetrics(None, None, None, None, None)
        return StepResponse(
            np.zeros(1), rest, nothing, rest, nothing, nothing, run.end, run.sentence, metrics, {"steps": 0.0}
        )
    outputs = np.stack(run.outputs)
    limit = scenario.current_limit_a or np.inf
    position = _polynomials(run, outputs[:, AT_SENSOR])
    current = _polynomials(run, run.loop.magnets.current(np.stack(run.demands)))
    model = _polynomials(run, outputs[:, MODEL])
    time = np.linspace(0.0, run.time_s, scenario.samples)  # even: what rings here may ring at any time
    nowhere = np.full(time.size, np.nan)
    metrics, sentence = _measured(run, position, min(peak_magnitude(current, run.time_s), limit))
    return StepResponse(
        time_s=time,
        position_m=scenario.position_m + position(time),
        current_a=np.clip(current(time), -limit, limit),
        reference_m=scenario.position_m + model(time),
        linear_position_m=nowhere,
        linear_current_a=nowhere,
        end=run.end,
        sentence=sentence,
        metrics=metrics,
        statistics=_statistics(run, outputs),
    )


def _measured(run: _Run, position_m: PPoly, peak_current_a: float) -> tuple[StepMetrics, str]:
    if run.end is not End.FINISHED:
        return StepMetrics(None, None, None, peak_current_a, None), run.sentence
    nothing = NOTHING * run.loop.magnets.bearing.air_gap_m
    step, last = run.loop.scenario.step_m, float(position_m(run.time_s))
    metrics = step_metrics(position_m, step, last, peak_current_a, nothing)
    if metrics.settling_time_s is None:
        return metrics, f"the response had not settled when the simulation ended, after {1e3 * run.time_s:.4g} ms"
    return metrics, ""


def _statistics(run: _Run, outputs: Floats) -> dict[str, float]:
    """The tracking errors at the knots, and how often the adaptation was switched."""
    error = np.abs(outputs[:, MODEL] - outputs[:, MEASURED])
    speed = np.abs(outputs[:, MODEL_SPEED] - outputs[:, SPEED])
    times = np.array(run.starts)[:, None] + np.array(run.widths)[:, None] * knots()

    def largest(begin: float, end: float = 1.0, of: Floats = error) -> float:
        inside = (times >= begin * run.time_s) & (times <= end * run.time_s)
        return float(of[inside].max(initial=0.0))

    return {
        "steps": float(run.steps),
        "switchings": float(run.switchings),
        "adapting_share": float(run.adapting_s / run.time_s),
        "largest_error_m": largest(0.0),
        "tracking_error_m": largest(LATE),
        "third_quarter_error_m": largest(0.5, 0.75),
        "fourth_quarter_error_m": largest(0.75),
        "third_quarter_speed_error_m_per_s": largest(0.5, 0.75, speed),
        "fourth_quarter_speed_error_m_per_s": largest(0.75, 1.0, speed),
        "estimate_constant_a": float(run.state[-3]),
        "estimate_position_a_per_m": float(run.state[-2]),
        "estimate_speed_a_s_per_m": float(run.state[-1]),
    }

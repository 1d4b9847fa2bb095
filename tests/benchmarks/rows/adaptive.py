"""The adaptive law with the elastic rotor, 20 ms, with its switchings: ours beside solve_ivp with events.

The peer integrates the very same right-hand side from one switching to the next, with the border of the sphere as a
terminal event, by the method and the loosest tolerance with which its answer is right to 1e-6 of the step.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from magbear_cli.model.rotor import FlexibleRotor
from magbear_cli.simulation.adaptive import simulate_adaptive_step
from magbear_cli.simulation.adaptive_loop import (
    AT_SENSOR,
    COEFFICIENTS,
    MEASURED,
    SPEED,
    AdaptiveLoop,
    close_adaptive_loop,
)
from magbear_cli.simulation.scenario import StepScenario
from magbear_cli.simulation.step import StepResponse
from magbear_cli.spec import read_study_text
from magbear_cli.study.adaptation import build_design
from magbear_cli.study.building import build_bearing, build_problem
from tests.benchmarks.measuring import Goal, Prepared, Row, Side

Floats = NDArray[np.float64]

OURS, PEER = "magbear", "solve_ivp with events"
STEP_M, DURATION_S, ENOUGH = 100e-6, 0.02, 1e-6
STUDY = """\
magbear: 1
name: benchmark
bearing: thesis_thrust_half_switched
mass_kg: [2.2, 4.5]
performance: thesis_slow
controller: {method: adaptive_lfe, gamma: 1.0e7}
"""
ROTOR = FlexibleRotor(0.1824, 2.612e6, 100.0)  # the identified one of configs/rotors
METHODS, TOLERANCES = ("LSODA", "DOP853", "RK45"), (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)


def closed() -> AdaptiveLoop:
    """The loop of the law, the bearing and a rotor of 2.2 kg on a spring."""
    inputs = dict(next(iter(read_study_text(STUDY, "the benchmark").cases())))
    law = build_design(build_problem(inputs), inputs["controller"]).law
    scenario = StepScenario(STEP_M, 2.2, rotor=ROTOR, duration_s=DURATION_S, samples=401)
    return close_adaptive_loop(build_bearing(inputs), law, scenario)


def switched(loop: AdaptiveLoop, method: str, tolerance: float, times: Floats) -> tuple[Floats, int]:
    """The position at the sensor and the number of switchings, by solve_ivp between events."""
    state, now, adapting, centre, switchings = np.zeros(loop.order + COEFFICIENTS), 0.0, False, (0.0, 0.0), 0
    size = STEP_M * tolerance * 0.01
    absolute = np.full(state.size, size)
    gains = (1.0, 1.0 / STEP_M, 1.0 / (STEP_M * loop.law.omega_rad_s))
    absolute[loop.order :] *= loop.law.feedforward_a_per_m * np.array(gains)
    pieces = []
    while now < DURATION_S:
        border = loop.distance_to_inner if adapting else loop.distance_to_outer
        event: Any = lambda _t, x, border=border: border(x)  # noqa: E731 - it needs attributes
        event.terminal, event.direction = True, -1.0 if adapting else 1.0
        slope = loop.derivative(pulse_n=0.0, centre=centre, adapting=adapting)
        inside = times[(times >= now) & (times <= DURATION_S)]
        answer = solve_ivp(
            slope, (now, DURATION_S), state, method=method, rtol=tolerance, atol=absolute, t_eval=inside, events=event
        )
        pieces.append(loop.outputs(np.asarray(answer.y))[AT_SENSOR] if np.size(answer.y) else np.empty(0))
        if answer.status != 1:
            break
        now, state, adapting, switchings = (
            float(answer.t_events[0][0]),
            answer.y_events[0][0],
            not adapting,
            switchings + 1,
        )
        if adapting:
            out = loop.outputs(state[:, None])[:, 0]
            new = float(out[MEASURED]), float(out[SPEED])
            state[-3] += state[-2:] @ (np.array(new) - np.array(centre))
            centre = new
    return np.concatenate(pieces), switchings


def _prepare(tiny: bool) -> Prepared:  # noqa: FBT001 - the row's switch
    loop = closed()
    times = np.linspace(0.0, DURATION_S, 401)
    reference, switchings = switched(loop, "DOP853", 1e-12, times)
    choices = {} if tiny else _choices(loop, times, reference)
    method, tolerance = min(choices, key=choices.__getitem__) if choices else ("DOP853", 1e-9)
    bearing = loop.magnets.bearing

    def ours() -> StepResponse:
        return simulate_adaptive_step(bearing, loop.law, loop.scenario)

    def errors(answers: Mapping[str, Any]) -> Mapping[str, Mapping[str, float]]:
        mine, (theirs, their_switchings) = answers[OURS], answers[PEER]
        return {
            OURS: {
                "largest error over the step": _error(mine.position_m, reference),
                "switchings": mine.statistics["switchings"],
            },
            PEER: {
                "largest error over the step": _error(theirs, reference),
                "switchings": their_switchings,
                "rtol": tolerance,
            },
            "reference": {"switchings": switchings},
        }

    def floor(seconds: Mapping[str, float]) -> str:
        steps = ours().statistics["steps"]
        took = f"we take {steps:.0f} steps in {1e3 * seconds[OURS]:.3g} ms"
        calls = f"some 150 calls of numpy each, of 0.5 to 4 µs, are {steps * 0.2:.2g} ms"
        return f"{took}; {calls}; the peer's best is {method} at rtol {tolerance:g}"

    return Prepared([Side(OURS, ours), Side(PEER, lambda: switched(loop, method, tolerance, times))], errors, floor)


def _error(position: Floats, reference: Floats) -> float:
    return float(np.abs(position - reference).max() / STEP_M) if position.shape == reference.shape else float("inf")


def _choices(loop: AdaptiveLoop, times: Floats, reference: Floats) -> dict[tuple[str, float], float]:
    """The seconds of each method at the loosest tolerance with which it is right to 1e-6 of the step."""
    from time import perf_counter

    seconds = {}
    for method in METHODS:
        for tolerance in TOLERANCES:
            start = perf_counter()
            position, _ = switched(loop, method, tolerance, times)
            if _error(position, reference) <= ENOUGH:
                seconds[method, tolerance] = perf_counter() - start
                break
    return seconds


ROW = Row(
    "adaptive",
    "adaptive run with hysteresis events, flexible rotor, 20 ms",
    [Goal(OURS, PEER, 10.0)],
    _prepare,
    missed_because={
        PEER: "13 of our 20 steps are cut off by a switching or by a coil that turns on or off, and none of these can "
        "be spared; a step is Newton's method for 22 forces, whose time is the way through numpy, and a quarter of the "
        "run is closing the loop and measuring the answer, which the peer does not do; compiled code would win it "
        "(decision 0019)"
    },
)

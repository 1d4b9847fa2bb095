"""The nonlinear response to a step of 10 µm with a controller of 33 states, 20 ms, right to 1e-6 of the step.

Each side takes the loosest of its tolerances with which its answer is right to 1e-6 of the step at 401 times, found
before and untimed; ours is also timed as every study has it, right to 1e-11 or so. A peer is given the closed loop as
a function that is quick to take.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from magbear_cli.errors import NumericsError
from magbear_cli.model.bearing import force_in_floats
from magbear_cli.model.filters import Prefilter
from magbear_cli.simulation.integration import integrate, integrate_fleet
from magbear_cli.simulation.loop import DEMAND, MAGNETS, SENSOR, Loop, close_loop
from magbear_cli.simulation.scenario import StepScenario
from magbear_cli.simulation.trajectory import Trajectory
from tests.benchmarks.measuring import Goal, Prepared, Row, Side
from tests.benchmarks.problem import bearing, controller_of_33_states

Floats = NDArray[np.float64]

OURS, STUDY, BATCH = "magbear", "magbear, at a study's tolerance", "magbear, 64 masses at once"
BEST, RADAU, CONTROL = "solve_ivp LSODA", "solve_ivp Radau", "python-control"
STEP_M, DURATION_S, ENOUGH = 10e-6, 0.02, 1e-6
SCENARIO = StepScenario(STEP_M, 3.6, prefilter=Prefilter(20000.0, 1.0), duration_s=DURATION_S)
MASSES_KG = np.linspace(3.0, 4.5, 64)
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
SMALLEST = 1e-5  # absolute tolerance over the relative one: states are some 1e-5 m


def closed(mass_kg: float = SCENARIO.mass_kg) -> Loop:
    """The loop of the bearing, the controller and a rotor."""
    return close_loop(bearing(), controller_of_33_states(), replace(SCENARIO, mass_kg=mass_kg))


def slope_of(loop: Loop) -> Callable[[float, Floats], Floats]:
    """dx/dt of a loop, quick to take."""
    force, b, order = force_in_floats(loop.magnets.bearing), loop.b, loop.b.size
    stacked = np.vstack([loop.a, loop.c[[MAGNETS, DEMAND]]])

    def slope(_: float, state: Floats) -> Floats:
        flow = stacked @ state
        return flow[:order] + b * force(flow[order], flow[order + 1])

    return slope


def solved(loop: Loop, method: str, tolerance: float, times: Floats) -> Floats:
    """The position at the sensor by solve_ivp."""
    answer = solve_ivp(
        slope_of(loop),
        (0.0, DURATION_S),
        loop.start,
        method=method,
        rtol=tolerance,
        atol=tolerance * SMALLEST,
        t_eval=times,
    )
    return np.asarray(loop.c[SENSOR] @ answer.y, dtype=float)


def by_control(loop: Loop, tolerance: float, times: Floats) -> Floats:
    """The position at the sensor by python-control's nonlinear simulation, with LSODA as its method."""
    import control

    slope = slope_of(loop)
    system = control.NonlinearIOSystem(
        lambda t, x, _u, _params: slope(t, x),
        lambda _t, x, _u, _params: loop.c[SENSOR] @ x,
        states=loop.b.size,
        inputs=1,
        outputs=1,
    )
    options = {"rtol": tolerance, "atol": tolerance * SMALLEST}
    answer = control.input_output_response(
        system, times, np.zeros_like(times), loop.start, solve_ivp_method="LSODA", solve_ivp_kwargs=options
    )
    return np.asarray(answer.outputs, dtype=float)


def marched(loops: Sequence[Loop], tolerance: float, times: Floats) -> Floats:
    """The positions at the sensor of many loops, marched together, (loops, times)."""
    courses = integrate_fleet(loops, DURATION_S, tolerance)
    return np.array([one.position_m(times) for one in courses if isinstance(one, Trajectory)])


def loosest(solve: Callable[[float], Floats], exact: Floats) -> float:
    """The loosest tolerance whose answer is right to 1e-6 of the step."""
    for tolerance in TOLERANCES:
        answer = solve(tolerance)
        if answer.shape == exact.shape and np.abs(answer - exact).max() <= ENOUGH * STEP_M:
            return tolerance
    raise NumericsError("the peer does not reach the accuracy")


def _prepare(tiny: bool) -> Prepared:  # noqa: FBT001 - the row's switch
    loop = closed()
    times = np.linspace(0.0, DURATION_S, 401)
    reference = solved(loop, "DOP853", 1e-12, times)
    loops = [closed(mass) for mass in MASSES_KG]
    peers: dict[str, Callable[[float], Floats]] = {BEST: lambda tolerance: solved(loop, "LSODA", tolerance, times)}
    if not tiny:
        peers[RADAU] = lambda tolerance: solved(loop, "Radau", tolerance, times)
        peers[CONTROL] = lambda tolerance: by_control(loop, tolerance, times)
    chosen = {name: loosest(solve, reference) for name, solve in peers.items()}
    chosen[OURS] = loosest(lambda tolerance: integrate(loop, DURATION_S, tolerance).position_m(times), reference)
    ends = loops[0], loops[-1]
    both = np.array([solved(one, "DOP853", 1e-12, times) for one in ends])
    chosen[BATCH] = loosest(lambda tolerance: marched(ends, tolerance, times), both)
    sides = [
        Side(OURS, lambda: integrate(loop, DURATION_S, chosen[OURS]).position_m(times)),
        Side(STUDY, lambda: integrate(loop, DURATION_S).position_m(times)),
        Side(BATCH, lambda: marched(loops, chosen[BATCH], times), amount=len(loops)),
        *(Side(name, lambda solve=solve, name=name: solve(chosen[name])) for name, solve in peers.items()),  # type: ignore[misc]
    ]

    def errors(answers: Mapping[str, Any]) -> Mapping[str, Mapping[str, float]]:
        found = {BATCH: {"largest error over the step": float(np.abs(answers[BATCH][[0, -1]] - both).max() / STEP_M)}}
        for name in (OURS, STUDY, *peers):
            found[name] = {"largest error over the step": float(np.abs(answers[name] - reference).max() / STEP_M)}
        return {name: {**found[name], **({"tolerance": chosen[name]} if name in chosen else {})} for name in found}

    def floor(seconds: Mapping[str, float]) -> str:
        steps = integrate(loop, DURATION_S, chosen[OURS]).steps
        return (
            f"{steps} steps of two Newton iterations are {1e3 * steps * 2 * 5e3 / 2e9:.1g} ms of flops; the way "
            f"through numpy's calls, some 150 a step, is {1e3 * steps * 150 * 1e-6:.2g} ms; we "
            f"take {1e3 * seconds[OURS]:.3g} ms"
        )

    return Prepared(sides, errors, floor)


ROW = Row(
    "step",
    "nonlinear 10 µm step, 33-state controller, 20 ms",
    [Goal(OURS, BEST, 5.0), Goal(BATCH, BEST, 50.0), Goal(OURS, RADAU, 5.0), Goal(OURS, CONTROL, 20.0)],
    _prepare,
    needs=("control",),
    missed_because=dict.fromkeys(
        (BEST, RADAU, CONTROL),
        "numpy's calls, some 150 a step, and the exponentials of a dozen widths are all the time",
    ),
)

"""Extreme bearings, weights, masses and controllers: each ends with a status and a sentence, and never falsely ok.

A case of the first kind runs here, where warnings are errors. The second kind runs in workers with a time limit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from magbear_cli.errors import Status
from magbear_cli.model.problem import ControlProblem
from magbear_cli.study.building import build_problem
from magbear_cli.study.events import CaseEnded
from magbear_cli.study.outcome import CaseOutcome
from magbear_cli.study.pipeline import run_case
from magbear_cli.study.plan import plan_cases
from magbear_cli.study.proving import is_proof
from magbear_cli.study.runner import RunnerOptions, run_cases

Resolve = Callable[..., dict[str, Any]]

NAN, INF = float("nan"), float("inf")
LEAD = ([[-2e5]], [[1.0]], [[1.5e12]], [[-7.6e6]])
MOST_SECONDS = 8.0

THESIS = {"air_gap_m": 4e-4, "force_constant_n_m2_per_a2": 4e-6, "bias_current_a": 0.5, "current_law": "full"}


def low_pass(dc_gain: float, corner_rad_s: float) -> dict[str, Any]:
    """W1 = dc_gain·corner/(s + corner)."""
    return {"performance": {"num": [dc_gain * corner_rad_s], "den": [1.0, corner_rad_s]}}


def rational(num: list[float], den: list[float]) -> dict[str, Any]:
    """W1 = num/den."""
    return {"performance": {"num": num, "den": den}}


def bandwidth(omega_c_rad_s: float) -> dict[str, Any]:
    """W3 = s²/ω_c²."""
    return {"bandwidth": {"omega_c_rad_s": omega_c_rad_s}}


def bearing(**fields: object) -> dict[str, Any]:
    """The thesis's bearing with fields changed."""
    return {"bearing": {**THESIS, **fields}}


def stored(a: object, b: object, c: object, d: object) -> dict[str, Any]:
    """A controller that exists already."""
    return {"controller": {"method": "stored", "source": "the test", "a": a, "b": b, "c": c, "d": d}}


def of_order(n: int) -> dict[str, Any]:
    """The lead with states that hardly take part, spread over six decades."""
    poles = -np.geomspace(10.0, 1e7, n)
    poles[0] = -2e5
    return stored(np.diag(poles).tolist(), [[1.0]] * n, [[1.5e12] + [1e-3] * (n - 1)], [[-7.6e6]])


PROBLEMS: dict[str, dict[str, Any]] = {
    "slowest corner": low_pass(10.0, 1e-6),
    "fastest corner": low_pass(10.0, 1e9),
    "largest dc gain": low_pass(1e12, 200.0),
    "least dc gain": low_pass(1e-12, 200.0),
    "an integrator": rational([2000.0], [1.0, 0.0]),
    "an undamped resonance": rational([2000.0], [1.0, 0.0, 1e4]),
    "an improper weight": rational([1.0, 2000.0], [200.0]),
    "a weight without a denominator": rational([1.0], [0.0]),
    "a weight of zero": rational([0.0], [1.0]),
    "a weight that cancels": rational([2000.0, 4e5], [1.0, 400.0, 4e4]),
    "a weight of order 20": rational([1e40], np.poly([-100.0] * 20).tolist()),
    "huge coefficients": rational([1e60], [1.0, 1e60]),
    "tiny coefficients": rational([1e-60], [1.0, 1e-60]),
    "a leading zero": rational([0.0, 2000.0], [0.0, 1.0, 200.0]),
    "least bandwidth": bandwidth(1e-3),
    "a bandwidth below the plant": bandwidth(1.0),
    "largest bandwidth": bandwidth(1e12),
    "a bandwidth of zero": bandwidth(0.0),
    "a bandwidth of NaN": bandwidth(NAN),
    "no bandwidth": {"bandwidth": None},
    "lightest rotor": {"mass_kg": 1e-6},
    "heaviest rotor": {"mass_kg": 1e6},
    "any rotor": {"mass_kg": [1e-6, 1e6]},
    "a range of almost one mass": {"mass_kg": [3.0, 3.0000000001]},
    "no mass": {"mass_kg": 0.0},
    "a mass of NaN": {"mass_kg": NAN},
    "a range that falls": {"mass_kg": [4.5, 3.0]},
    "narrowest gap": bearing(air_gap_m=1e-7),
    "a micrometre": bearing(air_gap_m=1e-6),
    "widest gap": bearing(air_gap_m=0.1),
    "no gap": bearing(air_gap_m=0.0),
    "weakest magnets": bearing(force_constant_n_m2_per_a2=1e-15),
    "strongest magnets": bearing(force_constant_n_m2_per_a2=1.0),
    "no bias to speak of": bearing(bias_current_a=1e-6),
    "all at once": bearing(air_gap_m=1e-7, force_constant_n_m2_per_a2=1.0, bias_current_a=1e4),
    "nothing at all": bearing(air_gap_m=0.1, force_constant_n_m2_per_a2=1e-15, bias_current_a=1e-6),
    "NaN in the bearing": bearing(force_constant_n_m2_per_a2=NAN),
    "on the stator": {"operating_point": {"position_m": 3.999999e-4, "current_a": 0.0}},
    "beyond the stator": {"operating_point": {"position_m": 5e-4, "current_a": 0.0}},
    "far off in current": {"operating_point": {"position_m": 0.0, "current_a": 1e4}},
}

CONTROLLERS: dict[str, tuple[dict[str, Any], set[Status]]] = {
    "NaN in A": (stored([[NAN]], [[1.0]], [[1.0]], [[-1e6]]), {Status.FAILED}),
    "infinity in B": (stored([[-1.0]], [[INF]], [[1.0]], [[-1e6]]), {Status.FAILED}),
    "NaN in D": (stored([], [], [[]], [[NAN]]), {Status.FAILED}),
    "no entry in reach": (stored([[-1e300]], [[1e300]], [[1e300]], [[-1e300]]), {Status.FAILED, Status.UNSTABLE}),
    "no entry to speak of": (stored([[-1e-300]], [[1e-300]], [[1e-300]], [[0.0]]), {Status.FAILED, Status.UNSTABLE}),
    "an endless gain": (stored([], [], [[]], [[-1e300]]), {Status.FAILED, Status.UNSTABLE}),
    "no control": (stored([], [], [[]], [[0.0]]), {Status.UNSTABLE}),
    "no damping": (stored([], [], [[]], [[-1e6]]), {Status.UNSTABLE}),
    "the wrong sign": (stored([[-2e5]], [[1.0]], [[-1.5e12]], [[7.6e6]]), {Status.UNSTABLE}),
    "its own unstable pole": (stored([[1e3]], [[1.0]], [[1.0]], [[-1e6]]), {Status.UNSTABLE}),
    "an unstable mode out of reach": (
        stored([[-2e5, 0.0], [0.0, 1e3]], [[1.0], [0.0]], [[1.5e12, 1.0]], [[-7.6e6]]),
        {Status.UNSTABLE},
    ),
    "an unstable mode out of sight": (
        stored([[-2e5, 0.0], [0.0, 1e3]], [[1.0], [1.0]], [[1.5e12, 0.0]], [[-7.6e6]]),
        {Status.UNSTABLE},
    ),
    "an integrator": (
        stored([[0.0, 0.0], [0.0, -2e5]], [[1.0], [1.0]], [[-1e7, 1.5e12]], [[-7.6e6]]),
        {Status.NOT_ACHIEVED},
    ),
    "an undamped resonance": (
        stored([[0.0, 1e3], [-1e3, 0.0]], [[0.0], [1.0]], [[1.0, 0.0]], [[-1e6]]),
        {Status.UNSTABLE, Status.FAILED},
    ),
    "units far apart": (stored([[-2e5]], [[1e-150]], [[1.5e162]], [[-7.6e6]]), {Status.NOT_ACHIEVED}),
    "stiffness of 1e12": (
        stored([[-2e5, 0.0], [0.0, -2e-7]], [[1.0], [1.0]], [[1.5e12, 1e-9]], [[-7.6e6]]),
        {Status.NOT_ACHIEVED, Status.UNVERIFIED},
    ),
    "repeated poles": (
        stored(
            [[-2e5, 1.0, 0.0], [0.0, -2e5, 1.0], [0.0, 0.0, -2e5]],
            [[0.0], [0.0], [1.0]],
            [[1.0, 1.0, 1.5e12]],
            [[-7.6e6]],
        ),
        {Status.NOT_ACHIEVED},
    ),
    "sizes that do not fit": (stored([[1.0]], [[1.0], [2.0]], [[1.0]], [[0.0]]), {Status.FAILED}),
    "two inputs": (stored([[-1.0]], [[1.0, 2.0]], [[1.0]], [[0.0, 0.0]]), {Status.FAILED}),
}

STEPS: dict[str, dict[str, object]] = {
    "no step": {"step_m": 0.0},
    "a step into the stator": {"step_m": 390e-6},
    "a step through the stator": {"step_m": -1.0},
    "a rotor of lead": {"masses_kg": [1e6]},
    "a rotor of dust": {"masses_kg": [1e-6]},
    "a hundred times gravity": {"gravity_m_per_s2": 1000.0},
    "gravity held by the bias": {"gravity_m_per_s2": 1000.0, "gravity_compensation": True},
    "no current": {"current_limit_a": 1e-6},
    "a nanosecond": {"duration_s": 1e-9},
    "the force of a rocket": {"disturbance": {"force_n": 1e9, "start_s": 0.0, "duration_s": 1e4}},
    "a prefilter that never comes": {"prefilter": {"omega_rad_s": 1e-3, "zeta": 1e6}},
    "a sensor that rings for ever": {"sensor": {"omega_rad_s": 1e-3, "damping_rad_s": 1e-12}},
    "a rotor of rubber": {"rotor": {"sensor_mass_kg": 1e-6, "stiffness_n_per_m": 1.0, "damping_n_s_per_m": 0.0}},
    "a part heavier than the whole": {
        "rotor": {"sensor_mass_kg": 5.0, "stiffness_n_per_m": 1e9, "damping_n_s_per_m": 0.0}
    },
}


@pytest.mark.parametrize("name", PROBLEMS)
def test_every_problem_ends_with_a_status(resolved: Resolve, name: str) -> None:
    """A known controller judged on an extreme bearing, weight or mass range: a status, a sentence, no warning."""
    outcome = run_case(resolved(**{**stored(*LEAD), **PROBLEMS[name], "simulate": []}), "x", 0)
    _check(outcome)


@pytest.mark.parametrize("name", PROBLEMS)
def test_every_problem_is_a_case_for_lqg(resolved: Resolve, name: str) -> None:
    """The quickest design of them all either gives a controller or says why not, whatever the numbers."""
    _check(run_case(resolved(**{**PROBLEMS[name], "simulate": []}), "x", 0))


@pytest.mark.parametrize("name", CONTROLLERS)
def test_every_controller_ends_with_its_status(resolved: Resolve, name: str) -> None:
    """Whatever a file calls a controller is judged for what it is."""
    controller, expected = CONTROLLERS[name]
    outcome = run_case(resolved(**controller), "x", 0)
    _check(outcome)
    assert outcome.status in expected, outcome.sentence


@pytest.mark.parametrize("name", STEPS)
def test_every_step_has_an_end(resolved: Resolve, name: str) -> None:
    """A simulation ends by itself, with a time and a word for it, and finite figures only."""
    inputs = resolved(**stored(*LEAD))
    inputs["simulate"] = [{**inputs["simulate"][0], **STEPS[name]}]
    outcome = run_case(inputs, "x", 0)
    _check(outcome)
    (step,) = outcome.steps
    assert step.end in {"finished", "touched_down", "diverged", "not_finite", "not_begun"}
    assert step.end == "finished" or step.sentence
    assert step.end == "finished" or step.settling_time_s is None
    assert np.isfinite(step.time_s).all()
    assert np.isfinite(step.position_m).all()


def test_a_step_that_cannot_begin_spares_the_others(resolved: Resolve) -> None:
    """A rotor whose sensor part is heavier than the whole has no response; the case and its other steps have."""
    inputs = resolved(**stored(*LEAD))
    usual = inputs["simulate"][0]
    inputs["simulate"] = [{**usual, **STEPS["a part heavier than the whole"]}, usual]
    outcome = run_case(inputs, "x", 0)
    assert outcome.status is Status.NOT_ACHIEVED
    assert [step.end for step in outcome.steps] == ["not_begun", "finished"]
    assert "sensor mass" in outcome.steps[0].sentence


def test_what_takes_long_is_stopped(resolved: Resolve) -> None:
    """Searches on extreme problems and controllers of high order end with a status or at the limit of their time."""
    mu = {"controller": {"method": "mu_convex", "uncertainty": "real", "max_order": 4}}
    hinf = {"controller": {"method": "hinf", "gamma_tolerance": 1e-3, "form": "mended"}}
    order = {
        "controller": {
            "method": "fixed_order",
            "order": 1,
            "max_order": 6,
            "uncertainty": "real",
            "minimise": "worst_case",
        }
    }
    asked: list[dict[str, Any]] = [
        of_order(60),
        {**hinf, **low_pass(10.0, 1e-6)},
        {**hinf, **bandwidth(1e12)},
        {**hinf, **bearing(air_gap_m=1e-6)},
        {**order, **low_pass(1e12, 200.0)},
        {**order, "mass_kg": [1e-6, 1e6]},
        {**order, **bandwidth(1e-3)},
        {**mu, **bandwidth(1e12)},
    ]
    ringing = {**resolved()["simulate"][0], "prefilter": {"omega_rad_s": 1e9, "zeta": 1e-6}}
    asked = [{**parts, "simulate": []} for parts in asked] + [{**stored(*LEAD), "simulate": [ringing]}]
    cases = plan_cases(resolved(**parts) for parts in asked)
    events = run_cases(cases, RunnerOptions(jobs=2, timeout_s=MOST_SECONDS))
    ended = [event for event in events if isinstance(event, CaseEnded)]
    assert sorted(event.outcome.index for event in ended) == list(range(len(asked)))
    for event in ended:
        _check(event.outcome)
        assert event.outcome.status is not Status.CRASHED
        assert "Error" not in event.outcome.sentence
        assert "Traceback" not in event.detail


def _check(outcome: CaseOutcome) -> None:
    """A status, one line that says why it is not ok, finite figures, and no ok that brute force denies."""
    assert (outcome.sentence == "") == (outcome.status is Status.OK)
    assert "\n" not in outcome.sentence
    assert (outcome.status is Status.INFEASIBLE) == (
        outcome.impossibility is not None and outcome.impossibility.level >= 1
    )
    if outcome.impossibility is not None:
        assert is_proof(build_problem(outcome.inputs), outcome.impossibility)
    worst = outcome.summary.worst_case
    assert worst is None or not np.isnan(worst)
    assert outcome.summary.verified == (outcome.status is Status.OK)
    if outcome.status is Status.OK:
        assert _is_stable(outcome)
        assert _brute_force(outcome) <= 1.001


def _is_stable(outcome: CaseOutcome) -> bool:
    """Eigenvalues of the loop built anew, at the ends of the range, in a unit of time of its own."""
    problem, K = build_problem(outcome.inputs), outcome.controller
    assert K is not None
    unit = 1.0 / problem.natural_rad_s
    for plant in problem.family.ends:
        rotor = np.array([[0.0, 1.0], [plant.negative_stiffness_n_per_m / plant.mass_kg * unit**2, 0.0]])
        force = np.array([[0.0], [plant.current_stiffness_n_per_a / plant.mass_kg * unit**2]])
        see = np.array([[1.0, 0.0]])
        top = np.hstack([rotor + force @ K.d @ see, force @ K.c])
        whole = np.vstack([top, np.hstack([unit * K.b @ see, unit * K.a])])
        if np.linalg.eigvals(whole).real.max() >= 0.0:
            return False
    return True


def _brute_force(outcome: CaseOutcome) -> float:
    """The largest |W1 S| + |W3 T| on members × frequencies, from the definitions."""
    problem, K = build_problem(outcome.inputs), outcome.controller
    assert K is not None
    omega = problem.natural_rad_s * np.geomspace(1e-6, 1e8, 1200)
    resolvent = np.linalg.solve(1j * omega[:, None, None] * np.eye(K.order) - K.a, K.b.astype(complex))
    response = (K.c @ resolvent)[:, 0, 0] + K.d[0, 0]
    return max(_level(problem, response, omega, float(share)) for share in np.linspace(0.0, 1.0, 9))


def _level(problem: ControlProblem, response: Any, omega: Any, share: float) -> float:  # noqa: ANN401 - arrays
    S = 1.0 / (1.0 - response * problem.plant(omega, share))
    return float(
        (problem.performance_bound(omega) * np.abs(S) + problem.bandwidth_bound(omega) * np.abs(S - 1.0)).max()
    )

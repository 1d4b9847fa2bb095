"""Plants and kernels at their worst: every case must end by its limit with a status that an independent check allows.

Bearings, masses, weights and operating points are drawn over many decades, most of them far from any machine, and given
to the methods in turn; beside them stand the calls of solvers that are known never to return.

    python tests/campaigns/zoo.py --plants 120
"""

from __future__ import annotations

import argparse
import collections
import os
import random
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from magbear_cli.errors import Status
from magbear_cli.spec.study import read_study_text
from magbear_cli.study.building import build_problem
from magbear_cli.study.events import CaseEnded, CaseStarted
from magbear_cli.study.outcome import CaseOutcome
from magbear_cli.study.plan import plan_cases
from magbear_cli.study.proving import is_proof
from magbear_cli.study.runner import RunnerOptions, run_cases

LATE_S = 2.0
BASE = """\
magbear: 1
name: zoo
bearing: thesis_thrust
mass_kg: [3.0, 4.5]
performance: {dc_gain: 10, corner_rad_s: 200}
bandwidth: {omega_c_rad_s: 20000}
controller: {method: lqg}
"""
METHODS = [
    "{method: lqg}", "{method: lqg_ltr}", "{method: hinf}", "{method: mu_convex, max_order: 4}",
    "{method: fixed_order}",
    "{method: pole_placement}", "{method: lqr}", "{method: mu_dk, iterations: 2}", "{method: eigenstructure}",
    "{method: mu_convex, uncertainty: complex, max_order: 4}",
]  # fmt: skip


def plants(number: int, seed: int) -> list[tuple[str, dict[str, Any]]]:
    """So many cases: what is odd about each, and its resolved inputs."""
    draw = random.Random(seed)  # noqa: S311 - a reproducible walk, not a secret
    base = {method: next(iter(read_study_text(BASE, "zoo", (f"controller={method}",)).cases())) for method in METHODS}

    def decades(low: float, high: float) -> float:
        return float(10.0 ** draw.uniform(low, high))

    cases = []
    for place in range(number):
        method = METHODS[place % len(METHODS)]
        inputs = dict(base[method])
        wild = draw.random() < 0.7
        span = 3.0 if wild else 0.5
        mass = 3.0 * decades(-2 * span, 2 * span)
        inputs["mass_kg"] = draw.choice([mass, [mass, mass * (1.0 + decades(-6, 2 if wild else -0.5))]])
        inputs["bearing"] = {
            "air_gap_m": 4e-4 * decades(-span, span / 2),
            "force_constant_n_m2_per_a2": 4e-6 * decades(-2 * span, span),
            "bias_current_a": 0.5 * decades(-span, span),
            "current_law": draw.choice(["full", "half_switched"]),
        }
        gain, corner = decades(-2, 6 if wild else 1.5), decades(-4 if wild else 1, 7 if wild else 3)
        inputs["performance"] = {"num": [gain * corner], "den": [1.0, corner]}
        inputs["bandwidth"] = draw.choice([None, {"omega_c_rad_s": decades(0 if wild else 3, 10 if wild else 5)}])
        inputs["simulate"] = []
        cases.append((f"{method} {inputs['mass_kg']}, {inputs['bearing']}, {gain:.3g}, {corner:.3g}", inputs))
    return cases


def stuck(inputs: Mapping[str, Any], case_id: str, index: int) -> CaseOutcome:
    """Calls of solvers on numbers that they do not return from, or should not believe; named by the inputs."""
    KERNELS[inputs["kernel"]]()
    return CaseOutcome(case_id, index, inputs, Status.UNVERIFIED, "it came back")


def _riccati_of_nothing() -> None:
    import slycot

    a = np.array([[np.nan, 1.0], [0.0, 1.0]])
    slycot.sb10ad(2, 2, 2, 1, 1, 1e2, a, np.eye(2), np.eye(2), np.zeros((2, 2)))


def _mu_of_nothing() -> None:
    import slycot

    slycot.ab13md(np.full((3, 3), np.nan + 0j), np.array([1, 1, 1]), np.array([2, 2, 2]))


def _steps_of_nothing() -> None:
    from scipy.integrate import solve_ivp

    solve_ivp(lambda _t, y: y * np.nan, (0.0, 1.0), [1.0], method="RK45")


def _no_control_weight() -> None:
    import control

    plant = control.ss(control.tf([1.0], [1.0, 0.0, -1.0]))
    control.mixsyn(plant, control.tf([1.0], [1.0, 1e-6]), None, control.tf([1.0, 0.0], [1e-6, 1.0]))


def _hold_the_lock() -> None:
    import ctypes

    ctypes.PyDLL(None).pause()


KERNELS = {
    "H-infinity synthesis with NaN": _riccati_of_nothing,
    "mu of NaN": _mu_of_nothing,
    "integration of NaN": _steps_of_nothing,
    "no weight on control": _no_control_weight,
    "the interpreter's lock held for ever": _hold_the_lock,
}


def judge(outcome: CaseOutcome) -> str:
    """What is wrong with an outcome; nothing, as a rule."""
    if (outcome.sentence == "") != (outcome.status is Status.OK):
        return "a status without a sentence"
    if outcome.summary.verified != (outcome.status is Status.OK):
        return "verified and not ok, or ok and not verified"
    if outcome.status is Status.INFEASIBLE:
        proof = outcome.impossibility
        if proof is None or proof.level < 1 or not is_proof(build_problem(outcome.inputs), proof):
            return "infeasible without a proof"
    if outcome.status is Status.OK:
        return _denied(outcome)
    return ""


def _denied(outcome: CaseOutcome) -> str:
    """What the definitions, evaluated anew, have against an ok."""
    problem, K = build_problem(outcome.inputs), outcome.controller
    if K is None:
        return "ok without a controller"
    unit = 1.0 / problem.natural_rad_s
    omega = problem.natural_rad_s * np.geomspace(1e-6, 1e8, 4000)
    response = np.array([(K.c @ np.linalg.solve(1j * w * np.eye(K.order) - K.a, K.b))[0, 0] + K.d[0, 0] for w in omega])
    for share in np.linspace(0.0, 1.0, 9):
        plant = problem.family.member(float(share))
        mass = plant.mass_kg
        rotor = np.array([[0.0, 1.0], [plant.negative_stiffness_n_per_m / mass * unit**2, 0.0]])
        force, see = np.array([[0.0], [plant.current_stiffness_n_per_a / mass * unit**2]]), np.array([[1.0, 0.0]])
        top = np.hstack([rotor + force @ K.d @ see, force @ K.c])
        whole = np.vstack([top, np.hstack([unit * K.b @ see, unit * K.a])])
        if np.linalg.eigvals(whole).real.max() >= 0.0:
            return f"ok and unstable at {mass} kg"
        S = 1.0 / (1.0 - response * problem.plant(omega, share))
        level = problem.performance_bound(omega) * np.abs(S) + problem.bandwidth_bound(omega) * np.abs(S - 1.0)
        if level.max() > 1.001:
            return f"ok and a level of {level.max()} at {mass} kg"
    return ""


def main() -> int:
    """Run the campaign and tell what came of it; 1 if a case ended late or with a wrong status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plants", type=int, default=120)
    parser.add_argument("--limit", type=float, default=10.0, help="seconds a case")
    parser.add_argument("--kernel-limit", type=float, default=3.0, help="seconds a call of a solver")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    os.environ["PYTHONPATH"] = str(Path(__file__).parent)
    words, inputs = zip(*plants(asked.plants, asked.seed), strict=True)
    counts, late_s, bad = _run(plan_cases(inputs), RunnerOptions(jobs=asked.jobs, timeout_s=asked.limit), words)
    print(f"plants: {asked.plants} ({', '.join(f'{count} {status}' for status, count in counts.most_common())})")
    print(f"latest end after a limit of {asked.limit:g} s: {late_s:.2f} s")
    calls = plan_cases({"kernel": name, "controller": {"method": "none"}, "mass_kg": 1.0} for name in KERNELS)
    options = RunnerOptions(jobs=asked.jobs, timeout_s=asked.kernel_limit, target="zoo:stuck")
    told, kernels_late_s, worse = _run(calls, options, tuple(KERNELS))
    print(f"solvers: {len(KERNELS)} ({', '.join(f'{count} {status}' for status, count in told.most_common())})")
    print(f"latest end after a limit of {asked.kernel_limit:g} s: {kernels_late_s:.2f} s")
    print(f"not as it should be: {len(bad) + len(worse)}")
    for sentence in [*bad, *worse][:20]:
        print(f"  {sentence}")
    return int(bool(bad or worse) or max(late_s, kernels_late_s) > LATE_S)


def _run(
    cases: tuple[Any, ...], options: RunnerOptions, words: tuple[str, ...]
) -> tuple[collections.Counter[str], float, list[str]]:
    """How often each status came, how late the latest end was, and what was wrong."""
    counts: collections.Counter[str] = collections.Counter()
    bad: list[str] = []
    began: dict[int, float] = {}
    late_s = 0.0
    for event in run_cases(cases, options):
        if isinstance(event, CaseStarted):
            began[event.case.index] = time.monotonic()
        elif isinstance(event, CaseEnded):
            outcome = event.outcome
            late_s = max(late_s, time.monotonic() - began[outcome.index] - (options.timeout_s or 0.0))
            counts[outcome.status.value] += 1
            fault = judge(outcome)
            bad += [f"{words[outcome.index]}: {outcome.status.value}: {fault}"] if fault else []
    if counts.total() != len(cases):
        bad.append(f"{len(cases) - counts.total()} cases did not end")
    return counts, max(0.0, late_s), bad


if __name__ == "__main__":
    sys.exit(main())

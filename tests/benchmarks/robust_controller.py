"""From the problem to a robust controller, side by side with a peer: the methods of magbear and dkpy's D-K iteration.

The problem is the thesis's thrust bearing with a rotor of 3.0-4.5 kg and ω_c = 20 000 rad/s. Each sample is a process
of its own with one thread; the routes take turns, so that a busy machine is busy for all of them. A route of magbear is
timed from the resolved inputs of a case to its outcome, with the judgement and the verification of the controller in
it; dkpy from its plant to its controller, without any, as it has none. Imports are not timed. The peak of mu (complex
blocks), stability and the verification of every controller are then computed anew by the same code for all.

dkpy gets what it needs by hand, not timed: time in ms, the uncertainty channel scaled by the best constant, SLICOT as
its H-infinity solver, D-scales of order five on a grid that suits the problem. It returns its last iterate.

Run it with ``python tests/benchmarks/robust_controller.py``, after ``pip install -e ".[benchmark]"``.
"""

# ruff: noqa: T201 - a benchmark is a command, and its table is its answer

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from statistics import median
from typing import Any

PEER = "dkpy"


@dataclass(frozen=True)
class PeerSettings:
    """The best true mu among eight settings tried by hand with a stable loop; chosen for mu, not for time."""

    time_unit_s: float = 1e-3
    uncertainty_scale: float = 0.0046
    d_order: int = 5
    iterations: int = 3
    grid_rad_s: tuple[float, float, int] = (10.0, 1e6, 61)


SETTINGS = PeerSettings()
STUDY = """\
magbear: 1
name: benchmark
bearing: thesis_thrust
mass_kg: [3.0, 4.5]
performance: {dc_gain: 10, corner_rad_s: 200}
bandwidth: {omega_c_rad_s: 20000}
controller: {method: lqg}
"""
ROUTES: dict[str, dict[str, Any]] = {
    "fixed_order 1": {"method": "fixed_order", "order": 1, "uncertainty": "complex"},
    "fixed_order 2": {"method": "fixed_order", "order": 2, "uncertainty": "complex"},
    "mu_convex": {"method": "mu_convex", "uncertainty": "complex"},
    "mu_dk": {"method": "mu_dk"},
    PEER: {},
}
PACKAGES = ("magbear", PEER, "numpy", "scipy", "slycot", "clarabel", "control", "cvxpy")
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
GRID_RAD_S = (1e-2, 1e9, 4000)
SAMPLE_TIMEOUT_S = 900.0

Matrices = dict[str, list[list[float]]]


def main(arguments: Sequence[str] | None = None) -> int:
    """Sample all routes by turns, store the samples, print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=3, help="samples of each route")
    parser.add_argument("--routes", nargs="+", choices=list(ROUTES), default=list(ROUTES))
    parser.add_argument("-o", "--output", type=Path, help="file for the raw samples, JSON")
    parser.add_argument("--sample", choices=list(ROUTES), help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.sample:
        print(json.dumps(sample(options.sample)))
        return 0
    samples = []
    for repeat in range(options.repeats):
        for route in options.routes:
            samples.append({"route": route, "repeat": repeat, **sample_in_a_process(route)})
            print(f"{repeat + 1}/{options.repeats} {route}: {told(samples[-1])}", file=sys.stderr)
    document = {"machine": machine(), "study": STUDY, "routes": ROUTES, PEER: asdict(SETTINGS), "samples": samples}
    if options.output:
        options.output.write_text(json.dumps(document, indent=1) + "\n", "utf-8")
    print(table(samples))
    return 0


def sample_in_a_process(route: str) -> dict[str, Any]:
    """One sample, or why there is none."""
    command = [sys.executable, __file__, "--sample", route]
    environment = {**os.environ, **ONE_THREAD}
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, env=environment, check=False, timeout=SAMPLE_TIMEOUT_S
        )
    except subprocess.TimeoutExpired:
        return {"error": f"no answer within {SAMPLE_TIMEOUT_S:.0f} s"}
    if done.returncode != 0:
        return {"error": (done.stderr.strip().splitlines() or ["it ended without a word"])[-1]}
    answer: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return answer


def sample(route: str) -> dict[str, Any]:
    """Seconds, the controller, and what is true of it."""
    from magbear_cli.study.pipeline import run_case

    inputs = case_of(ROUTES[route] or {"method": "lqg"})
    if route == PEER:
        seconds, matrices, claimed = peers_controller()
    else:
        start = time.perf_counter()
        outcome = run_case(inputs, "benchmark", 0)
        seconds = time.perf_counter() - start
        if outcome.controller is None:
            raise SystemExit(outcome.sentence)
        matrices = {name: getattr(outcome.controller, name).tolist() for name in "abcd"}
        claimed = outcome.summary.level
    return {"seconds": seconds, "claimed": claimed, **judged(matrices), "controller": matrices}


def case_of(controller: Mapping[str, Any]) -> dict[str, Any]:
    """The resolved inputs of the problem with a method, every option of it at its default unless given."""
    from magbear_cli.spec import read_study_text

    text = STUDY.replace("{method: lqg}", json.dumps(controller))
    return dict(next(iter(read_study_text(text, "the benchmark").cases())))


def judged(matrices: Matrices) -> dict[str, Any]:
    """Order, peak mu on a dense grid, and the verdict of the same independent check for a controller of any origin."""
    import numpy as np

    from magbear_cli.analysis.uncertain_loop import mu_upper
    from magbear_cli.lti.state_space import StateSpace
    from magbear_cli.study.building import build_problem
    from magbear_cli.study.pipeline import run_case

    inputs = {**case_of({"method": "lqg"}), "controller": {"method": "stored", "source": "the benchmark", **matrices}}
    controller = StateSpace.of(*(matrices[name] for name in "abcd"))
    low, high, points = GRID_RAD_S
    grid = np.geomspace(low, high, points)
    outcome = run_case(inputs, "judged", 0)
    return {
        "order": controller.order,
        "peak_mu": float(mu_upper(build_problem(inputs), controller, grid).max()),
        "verified": outcome.summary.verified,
        "status": str(outcome.status),
        "sentence": outcome.summary.verification_sentence or outcome.sentence,
    }


def peers_controller() -> tuple[float, Matrices, float]:
    """Seconds, matrices in SI units and claimed mu of dkpy's D-K iteration at the settings above."""
    import warnings

    import numpy as np
    from dkpy import ComplexFullBlock, DkIterFixedOrder, DScaleFitSlicot, HinfSynSlicot, SsvLmiBisection

    from magbear_cli.lti.state_space import StateSpace
    from magbear_cli.synthesis.gamma_search import controller_in_si

    plant, unit_rad_s, unit_a = peers_plant()
    low, high, points = SETTINGS.grid_rad_s
    iteration = DkIterFixedOrder(
        controller_synthesis=HinfSynSlicot(),
        structured_singular_value=SsvLmiBisection(n_jobs=1),
        d_scale_fit=DScaleFitSlicot(),
        n_iterations=SETTINGS.iterations,
        fit_order=SETTINGS.d_order,
    )
    omega, blocks = np.geomspace(low, high, points) / unit_rad_s, [ComplexFullBlock(1, 1)] * 3
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        start = time.perf_counter()
        k, _, claimed, _, _ = iteration.synthesize(plant, 1, 1, omega, blocks)
        seconds = time.perf_counter() - start
    if k is None:
        raise SystemExit("dkpy found no controller")
    controller = controller_in_si(StateSpace.of(k.A, k.B, k.C, k.D), unit_rad_s, unit_a)
    return seconds, {name: getattr(controller, name).tolist() for name in "abcd"}, float(claimed)


def peers_plant() -> tuple[Any, float, Any]:
    """The generalised plant for dkpy in good units, with its unit of frequency in rad/s and of current in A."""
    import numpy as np
    from control import StateSpace

    from magbear_cli.kernels.block_structure import BlockStructure
    from magbear_cli.lti.balancing import with_balanced_states, with_time_unit
    from magbear_cli.model.generalized_plant import build_generalized_plant
    from magbear_cli.study.building import build_problem
    from magbear_cli.synthesis.channel_scaling import thesis_scales, with_channel_scales
    from magbear_cli.synthesis.gamma_search import with_unit_penalty

    problem = build_problem(case_of({"method": "lqg"}))
    generalized, structure = build_generalized_plant(problem), BlockStructure.scalar(3)
    scales = thesis_scales(problem, generalized) * np.array([SETTINGS.uncertainty_scale, 1, 1])
    unit_rad_s = 1.0 / SETTINGS.time_unit_s
    scaled = with_time_unit(with_channel_scales(generalized.system, structure, scales), unit_rad_s)
    plant, unit_a = with_unit_penalty(scaled)
    plant = with_balanced_states(plant)
    return StateSpace(plant.a, plant.b, plant.c, plant.d), unit_rad_s, unit_a


def told(one: Mapping[str, Any]) -> str:
    """A sample in a line."""
    if "error" in one:
        return str(one["error"])
    verified = "verified" if one["verified"] else f"not verified ({one['sentence']})"
    return f"{one['seconds']:.2f} s, peak mu {one['peak_mu']:.4f}, {one['order']} states, {verified}"


def table(samples: Sequence[Mapping[str, Any]]) -> str:
    """Medians of each route, and how many times longer the peer takes."""
    rows = [
        "| route | states | peak mu | verified | seconds (median) | least to most | dkpy takes |",
        "| --- " * 7 + "|",
    ]
    peers = [one["seconds"] for one in samples if one["route"] == PEER and "error" not in one]
    for route in dict.fromkeys(one["route"] for one in samples):
        mine = [one for one in samples if one["route"] == route]
        good = [one for one in mine if "error" not in one]
        if not good:
            rows.append(f"| {route} | {mine[0]['error']} | | | | | |")
            continue
        seconds = [one["seconds"] for one in good]
        mu, order = median(one["peak_mu"] for one in good), good[0]["order"]
        verified = sum(bool(one["verified"]) for one in good)
        ratio = f"{median(peers) / median(seconds):.1f} times as long" if peers and route != PEER else ""
        span = f"{min(seconds):.2f} to {max(seconds):.2f}"
        checked = f"{verified} of {len(mine)}"
        rows.append(f"| {route} | {order} | {mu:.4f} | {checked} | {median(seconds):.2f} | {span} | {ratio} |")
    return "\n".join(rows)


def machine() -> dict[str, Any]:
    """What the samples were taken on and with."""
    versions = {}
    for package in PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            versions[package] = "not installed"
    load = os.getloadavg() if hasattr(os, "getloadavg") else None
    about = {"platform": platform.platform(), "processor": platform.processor(), "python": platform.python_version()}
    return {**about, "cores": os.cpu_count(), "load": load, "versions": versions}


if __name__ == "__main__":
    raise SystemExit(main())

"""A sweep of many cases: the runner beside the kernels alone and beside joblib over the same function.

Four hundred cases (``CASES``) stand for the two thousand of the row, so that all sides together take some four minutes
a round. The start of the workers and the figures of the report, which a run has once, weigh five times as much as they
would; the results file grows with the cases and weighs what it weighs. Each case is an H-infinity design with judgement
and proof, some 0.16 s. The runner stores every case safely as it ends and writes one file and a report of all; joblib
and the bare loop keep answers in memory. A single round of all two thousand, which takes eighteen minutes, is in
``results/whole``.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from magbear_cli.spec import read_study_text
from magbear_cli.study.pipeline import run_case
from tests.benchmarks.measuring import Goal, Prepared, Row, Side

KERNELS, ONE, TWO, JOBLIB = "the kernels alone", "magbear run, 1 worker", "magbear run, 2 workers", "joblib, 2 workers"
CASES, OF = 400, 2000
STUDY = """\
magbear: 1
name: benchmark
bearing: thesis_thrust
mass_kg: [3.0, 4.5]
performance: {dc_gain: 10, corner_rad_s: 200}
bandwidth: {omega_c_rad_s: 20000}
controller: {method: hinf}
sweep: {bandwidth.omega_c_rad_s: OMEGAS}
report: {figures: [mu]}
"""


def _prepare(tiny: bool) -> Prepared:  # noqa: FBT001 - the row's switch
    count = 3 if tiny else CASES
    text = STUDY.replace("OMEGAS", json.dumps(np.geomspace(8000.0, 30000.0, count).tolist()))
    cases = [dict(case) for case in read_study_text(text, "the benchmark").cases()]
    folder = Path(tempfile.mkdtemp(prefix="magbear-benchmark-"))
    study = folder / "study.yaml"
    study.write_text(text, "utf-8")
    share = count / OF

    def alone() -> list[float]:
        return [_level(case) for case in cases]

    def by_joblib() -> list[float]:
        from joblib import Parallel, delayed

        return list(Parallel(n_jobs=2)(delayed(_level)(case) for case in cases))

    def runner(workers: int) -> list[float]:
        output = folder / "out"
        shutil.rmtree(output, ignore_errors=True)
        command = [
            sys.executable,
            "-m",
            "magbear_cli",
            "run",
            str(study),
            "-o",
            str(output),
            "-j",
            str(workers),
            "--json",
        ]
        done = subprocess.run(command, capture_output=True, text=True, check=True, env=dict(os.environ))
        return [case["level"] for case in json.loads(done.stdout)["cases"]]

    def errors(answers: Mapping[str, Any]) -> Mapping[str, Mapping[str, float]]:
        shutil.rmtree(folder, ignore_errors=True)
        exact = np.array(answers[KERNELS])
        return {
            name: {"largest difference from the kernels alone": float(np.abs(np.array(answer) / exact - 1.0).max())}
            for name, answer in answers.items()
            if name != KERNELS
        }

    def floor(seconds: Mapping[str, float]) -> str:
        each = {name: 1e3 * value / OF for name, value in seconds.items()}
        return (
            f"a case costs {each[KERNELS]:.0f} ms in its kernels and {each[ONE]:.0f} ms with the runner and a share of "
            f"its start and end; two workers can halve it at best, to {each[KERNELS] / 2:.0f} ms, and take "
            f"{each[TWO]:.0f} ms"
        )

    sides = [
        Side(KERNELS, alone, share, warm_up=lambda: _level(cases[0])),
        Side(ONE, lambda: runner(1), share, warm_up=_nothing),
        Side(TWO, lambda: runner(2), share, warm_up=_nothing),
    ]
    if not tiny:
        sides.append(Side(JOBLIB, by_joblib, share, warm_up=_nothing))
    return Prepared(sides, errors, floor)


def _nothing() -> None:
    """No warm-up: a process starts anew each time."""


def _level(case: Mapping[str, Any]) -> float:
    """The whole of a case, and its level for an answer."""
    return float(run_case(case, "benchmark", 0).summary.level or np.nan)


ROW = Row(
    "sweep",
    "a sweep: overhead beside the kernels",
    [Goal(ONE, KERNELS, 1.1, at_most=True), Goal(TWO, ONE, 1.85), Goal(TWO, JOBLIB, 1.1, at_most=True)],
    _prepare,
    needs=("joblib",),
    missed_because={
        KERNELS: f"the start of the worker and the figures weigh {OF / CASES:.3g} times as much as over 2 000 cases, "
        "where a single round gave 1.05 (results/whole)",
        ONE: "the start of a run and its results file, 8 ms a case, are not shared by the workers; "
        "over 2 000 cases 1.82",
        JOBLIB: "joblib keeps its answers in memory and writes nothing, where the parent stores every case for good "
        "and writes one file of all; over 2 000 cases 1.18",
    },
)

"""The real command on a study whose cases take no time: what the campaigns on the runner have in common.

A run is a process of its own, forked from this one so that nothing is imported twice; its workers are fresh processes
as always. Only what a case computes is replaced, by ``answer``.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import random
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from magbear_cli.errors import Status
from magbear_cli.study.outcome import CaseOutcome, PoleStudy, StepOutcome, Summary

HERE = Path(__file__).parent
STUDY = """\
magbear: 1
name: quick
bearing: thesis_thrust
mass_kg: [3.0, 4.5]
performance: {{dc_gain: 10, corner_rad_s: 200}}
bandwidth: {{omega_c_rad_s: 20000}}
controller: {{method: lqg}}
sweep: {{controller.r: {values}}}
report: {{figures: [{figures}]}}
"""
WORKER = "magbear_cli.study.worker"
VOLATILE = {"log.jsonl", ".lock"}  # of a run directory: times, hosts and attempts


def study_text(cases: int, figures: str = "limitation") -> str:
    """A legal study of so many cases, whose report has a figure (unless QUICK_FIGURES is 0)."""
    return STUDY.format(values=[float(f"{1e-9 * (1 + number):.12g}") for number in range(cases)], figures=figures)


def answer(inputs: Mapping[str, Any], case_id: str, index: int) -> CaseOutcome:
    """A small outcome that depends on the inputs alone; QUICK_SECONDS makes it take a while."""
    time.sleep(float(os.environ.get("QUICK_SECONDS", "0.03")))
    r = float(inputs["controller"]["r"])
    draw = random.Random(case_id)  # noqa: S311 - numbers that follow from the identity
    time_s = np.linspace(0.0, 0.01, 50)
    curves = [np.array([draw.random() for _ in time_s]) for _ in range(5)]
    step = StepOutcome(3.0, 1e-5, "nonlinear", "lqg", {"step_m": 1e-5}, "finished", "", 1e-3, r, None, 2.0, 0.0,
                       time_s, *curves)  # fmt: skip
    rows = np.array([[-100.0 + 1j, -100.0 - 1j], [-90.0 + 1j, -90.0 - 1j]])
    poles = PoleStudy(np.array([3.0, 4.5]), np.ones(2), np.ones(2), rows)
    order = 2 if index < 2 and os.environ.get("QUICK_FIGURES", "1") == "1" else None  # two controllers: one figure
    summary = Summary(level=r, worst_case=1.0 + draw.random(), peak_mu=2.0, order=order)
    return CaseOutcome(case_id, index, inputs, Status.NOT_ACHIEVED, "as asked", summary, poles=poles, steps=(step,))


def use_quick_cases() -> None:
    """Let every run that is started from this process compute ``answer``."""
    from magbear_cli.study import runner

    os.environ["PYTHONPATH"] = os.pathsep.join([str(HERE), *filter(None, [os.environ.get("PYTHONPATH")])])
    options = functools.partial(runner.RunnerOptions, target="quick_run:answer", warm_modules=())
    runner.RunnerOptions = options  # type: ignore[misc, assignment]


def compute_here(cases: Sequence[Any], *_: object) -> Iterator[Any]:
    """The runner without workers, where their part is not asked for and a call should have one place."""
    from magbear_cli.study.events import CaseEnded

    for case in cases:
        yield CaseEnded(answer(case.inputs, case.id, case.index), 1, 0.0)


def preload() -> None:
    """Import what a run needs, once: by a run in this process, whose streams go nowhere."""
    from magbear_cli.cli.main import main
    from magbear_cli.study import runner

    ours, runner.run_cases = runner.run_cases, compute_here  # type: ignore[assignment]
    with (
        tempfile.TemporaryDirectory() as folder,
        open(os.devnull, "w", encoding="utf-8") as nowhere,  # noqa: PTH123 - a device
        contextlib.redirect_stdout(nowhere),
        contextlib.redirect_stderr(nowhere),
        contextlib.suppress(SystemExit),
    ):
        study = Path(folder) / "study.yaml"
        study.write_text(study_text(2), "utf-8")
        main(["run", str(study), "-o", str(Path(folder) / "out")])
    runner.run_cases = ours


def start(arguments: list[str], output: Path, prepare: Callable[[], None] = lambda: None) -> int:
    """Start the command in a process and session of its own; what it says goes to a file. The answer is its pid."""
    pid = os.fork()
    if pid:
        return pid
    code = 99
    try:
        os.setsid()
        said = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
        for descriptor in (1, 2):
            os.dup2(said, descriptor)
        prepare()
        from magbear_cli.cli.main import main

        main(arguments)
    except SystemExit as end:
        code = int(end.code or 0)
    except BaseException:  # noqa: BLE001 - this process is ours, whatever happened in it
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def ended(pid: int, within_s: float = 120.0) -> int | None:
    """The exit code of a process started above, negative for a signal; None if it has not ended in time."""
    until = time.monotonic() + within_s
    while time.monotonic() < until:
        found, status = os.waitpid(pid, os.WNOHANG)
        if found:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.002)
    return None


def workers_of(pid: int) -> list[psutil.Process]:
    """The living worker processes of a run, whether or not it is alive itself: they are told its pid."""
    found = []
    for process in psutil.process_iter():
        try:
            line = process.cmdline()
            told = line[line.index(WORKER) + 2] if WORKER in line else ""
            if told == str(pid) and process.status() != "zombie":
                found.append(process)
        except psutil.Error:
            continue
    return found


def gone_within(pid: int, seconds: float) -> bool:
    """Whether no worker of a run is alive after so long at most."""
    until = time.monotonic() + seconds
    while workers_of(pid):
        if time.monotonic() > until:
            return False
        time.sleep(0.02)
    return True


def fingerprint(folder: Path) -> dict[str, str]:
    """The digests of all files of a run directory that must not depend on how the run went."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name not in VOLATILE
    }

"""``magbear run``: from a study to its results and its report, whatever comes in between."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import psutil
import pytest

import magbear_cli as magbear
from magbear_cli.cli.main import Terminated
from magbear_cli.errors import ResumableError
from magbear_cli.library.planning import planned_cases
from magbear_cli.spec import read_study
from magbear_cli.store.lock import DirectoryLock
from magbear_cli.store.results import read_results
from magbear_cli.store.run_directory import RunDirectory

Command = Callable[..., Any]
Process = Callable[..., Any]

CASE_KEYS = [
    *("id", "status", "method", "mass_kg", "omega_c_rad_s", "peak_mu", "worst_case", "order"),
    *("peak_gain_a_per_m", "peak_ks_a_per_m", "verified", "sentence", "steps"),
]
STEP_KEYS = [
    *("mass_kg", "step_m", "model", "controller"),
    *("settling_time_s", "overshoot", "peak_current_a", "touched_down"),
]

SLOW_SECOND = """\
magbear: 1
name: slow_second
bearing: thesis_thrust
mass_kg: [3.0, 4.5]
performance: {dc_gain: 10, corner_rad_s: 200}
bandwidth: {omega_c_rad_s: 20000}
controller: {method: lqg}
report: {figures: [controller_gain]}
sweep: {controller: [{method: lqg}, {method: mu_convex, max_order: 100}]}
"""


@pytest.fixture
def slow_second(tmp_path: Path) -> Path:
    """A study whose first case is quick and whose second is not."""
    path = tmp_path / "slow.yaml"
    path.write_text(SLOW_SECOND, "utf-8")
    return path


def test_the_document_has_its_public_keys(finished: Path) -> None:
    """``--json`` is one document with the keys that other programs rely on."""
    document = json.loads((finished.parent / "done.json").read_text("utf-8"))
    assert document["study"] == "tiny"
    assert (document["results"], document["report"]) == ("done/results.h5", "done/report/index.html")
    assert len(document["cases"]) == 2
    for case in document["cases"]:
        assert list(case)[: len(CASE_KEYS)] == CASE_KEYS
        assert all(list(step)[: len(STEP_KEYS)] == STEP_KEYS for step in case["steps"])


def test_the_run_directory_holds_what_was_promised(finished: Path, tiny: Path) -> None:
    """The study as given, a results file, a report, a shard a case, and a log."""
    assert (finished / "study.yaml").read_text("utf-8") == tiny.read_text("utf-8")
    assert (finished / "report" / "index.html").is_file()
    assert len(list((finished / "cases").rglob("*.case"))) == 2
    events = [json.loads(line)["event"] for line in (finished / "log.jsonl").read_text("utf-8").splitlines()]
    assert events == ["run began", "case ended", "case ended", "run ended"]


@pytest.mark.usefixtures("quick_report")
def test_a_second_run_reuses_the_first(command: Command, tiny: Path, tmp_path: Path) -> None:
    """What is stored is not computed again, and the results are the same bytes; a changed study reuses what it can."""
    out = tmp_path / "out" / "tiny"
    first = command("run", tiny)
    assert first.code == 0
    assert "2 cases to compute" in first.err
    assert f"results: {out.relative_to(tmp_path) / 'results.h5'}" in first.out
    content = (out / "results.h5").read_bytes()
    again = command("run", tiny)
    assert "2 of 2 cases reused, nothing to compute" in again.err
    assert again.out == first.out
    assert (out / "results.h5").read_bytes() == content
    wider = command("run", tiny, "--set", "sweep={controller.r: [3.0e-9, 9.0e-9, 6.0e-9]}")
    assert "2 of 3 cases reused, 1 to compute" in wider.err
    fresh = command("run", tiny, "--fresh", "--json", "-j", "1")
    assert "2 cases to compute, 1 at a time" in fresh.err
    assert (out / "results.h5").read_bytes() == content


@pytest.mark.usefixtures("quick_report")
@pytest.mark.parametrize("most_whole", [1, 2])  # under and at the number of cases
def test_a_run_keeps_every_controller_and_has_the_bytes_of_the_library(
    command: Command, tiny: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, most_whole: int
) -> None:
    """However many cases are held for the report, the results file holds all of each, as that of a run from Python."""
    monkeypatch.setattr("magbear_cli.store.run_directory.MOST_WHOLE", most_whole)
    assert command("run", tiny, "-o", "out", "-j", "1").code == 0
    for outcome in read_results(tmp_path / "out" / "results.h5").outcomes:
        assert outcome.controller is not None
        assert outcome.frequency is not None
        assert all(step.position_m.size for step in outcome.steps)
    magbear.run(tiny, tmp_path / "python", jobs=1)
    assert (tmp_path / "python" / "results.h5").read_bytes() == (tmp_path / "out" / "results.h5").read_bytes()


@pytest.mark.usefixtures("quick_report")
@pytest.mark.parametrize("name", ["two words/π 🧲/a'b\"c", "-o"])
def test_odd_directories_are_directories(
    command: Command, finished: Path, tiny: Path, tmp_path: Path, name: str
) -> None:
    """Blanks, emoji, dashes and quotes do not disturb."""
    shutil.copytree(finished / "cases", tmp_path / name / "cases")
    ended = command("run", tiny, f"--output={name}")
    assert ended.code == 0, ended.err
    assert "2 of 2 cases reused" in ended.err
    assert (tmp_path / name / "results.h5").is_file()
    assert f"report:  {name}/report/index.html" in ended.out


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["-j", "0"], "jobs must be at least 1"),
        (["-j", "-3"], "jobs must be at least 1"),
        (["--timeout", "0"], "time limit of a case must be positive"),
        (["--timeout", "nan"], "time limit of a case must be positive"),
        (["-o", "tiny.yaml"], "tiny.yaml is a file, not a directory"),
        (["-o", "tiny.yaml/below"], "tiny.yaml is a file, not a directory"),
        (["-o", "a" * 300], "name too long"),
        (["--case", "zz"], "no case of this study has that identity"),
        (["--case", ""], "no case of this study has that identity"),
        (["--set", "mass_kg"], "E118"),
        (["--set", "contrller.r=1"], "did you mean"),
        (["--set", "controller.r=-1"], "E105"),
        (["--set", "controller={method: stored, path: gone.json}"], "gone.json"),
        (["--max-failures", "0"], "--max-failures"),
        (["--executor", "dask"], "needs --scheduler HOST:PORT"),
        (["--scheduler", "127.0.0.1:8786"], "give both, or neither"),
        (["--executor", "dask", "--scheduler", "127.0.0.1:8786", "-j", "2"], "--jobs is for workers on this machine"),
        (["--events", "-", "--json"], "both want standard output"),
    ],
)
def test_wrong_options_are_told_and_nothing_is_written(
    command: Command, tiny: Path, tmp_path: Path, arguments: list[str], says: str
) -> None:
    """A mistake is one sentence and exit code 2, before anything is made."""
    ended = command("run", tiny, *arguments)
    assert (ended.code, ended.out) == (2, "")
    assert says.lower() in ended.err.lower()
    assert "Traceback" not in ended.err
    assert list(tmp_path.iterdir()) == [tiny]


def test_a_place_that_cannot_be_written_is_told(command: Command, tiny: Path) -> None:
    """A directory that the system refuses is a sentence and exit code 4."""
    ended = command("run", tiny, "-o", "/proc/nowhere")
    assert ended.code == 4
    assert "cannot be written" in ended.err


def test_a_directory_in_use_is_left_alone(command: Command, tiny: Path, tmp_path: Path) -> None:
    """Two runs cannot hold one directory: the second is told by whom, exit code 4."""
    (tmp_path / "busy").mkdir()
    lock = DirectoryLock(tmp_path / "busy")
    try:
        ended = command("run", tiny, "-o", "busy")
    finally:
        lock.release()
    assert ended.code == 4
    assert f"process {os.getpid()}" in ended.err


@pytest.mark.usefixtures("quick_report")
def test_a_run_without_locks_is_done_on_request(
    command: Command, finished: Path, tiny: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the file system cannot lock, run, sweep and merge are refused with 4, and done with ``--no-lock``."""

    def flock(_descriptor: int, _operation: int) -> NoReturn:
        raise OSError(errno.EOPNOTSUPP, "Operation not supported")

    monkeypatch.setattr(fcntl, "flock", flock)
    shutil.copytree(finished / "cases", tmp_path / "out" / "cases")
    for arguments in (["run", tiny, "-o", "out"], ["sweep", tiny, "-o", "out"], ["merge", "out", "-o", "whole"]):
        refused = command(*arguments)
        assert (refused.code, refused.out) == (4, "")
        assert "give --no-lock" in refused.err
        done = command(*arguments, "--no-lock")
        assert done.code == 0, done.err
        assert done.err.count("out is on a file system that cannot lock (Operation not supported)") == 1
    assert len(magbear.run(tiny, tmp_path / "out", must_lock=False).outcomes) == 2
    with pytest.raises(ResumableError, match="cannot lock"):
        magbear.run(tiny, tmp_path / "out")


def test_a_case_that_takes_too_long_does_not_stop_the_others(
    command: Command, slow_second: Path, tmp_path: Path
) -> None:
    """A timeout is a status with a sentence and a line that repeats it; the report is there and the exit code is 3."""
    first = command("run", slow_second, "-o", "out", "--set", "sweep={controller: [{method: lqg}]}")
    assert first.code == 0, first.err
    ended = command("run", slow_second, "-o", "out", "--timeout", "0.2", "--json", "--progress")
    assert ended.code == 3, ended.err
    assert "1 of 2 cases reused, 1 to compute" in ended.err
    assert "drawing the report" in ended.err
    quick, slow = json.loads(ended.out)["cases"]
    assert quick["status"] == "not_achieved"
    assert slow["status"] == "timeout"
    assert "time limit of 0.2 s" in slow["sentence"]
    assert slow["id"] in slow["repro"]
    assert "timeout" in (tmp_path / "out" / "report" / "index.html").read_text("utf-8")
    alone = command("run", slow_second, "-o", "out", "--timeout", "0.2", "--case", quick["id"][:5])
    assert alone.code == 0
    assert "1 of 1 case reused" in alone.err
    stopped = command("run", slow_second, "-o", "out", "--timeout", "0.2", "--fail-fast", "--fresh", "-j", "1")
    assert stopped.code == 3
    assert "report:" in stopped.out


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 143)])
def test_an_interrupted_run_keeps_what_was_finished(
    slow_second: Path, tmp_path: Path, number: signal.Signals, code: int
) -> None:
    """Ctrl-C, SIGTERM and a lost terminal end the run soon, leave no process, and the next run goes on from there."""
    line = [sys.executable, "-m", "magbear_cli", "run", str(slow_second), "-o", "out", "-j", "1"]
    running = subprocess.Popen(line, cwd=tmp_path, stderr=subprocess.PIPE, stdout=subprocess.PIPE, encoding="utf-8")
    log = tmp_path / "out" / "log.jsonl"
    until = time.monotonic() + 60
    while time.monotonic() < until and not (log.is_file() and "case ended" in log.read_text("utf-8")):
        time.sleep(0.02)
    children = psutil.Process(running.pid).children(recursive=True)
    running.send_signal(number)
    out, err = running.communicate(timeout=30)
    assert (running.returncode, out) == (code, "")
    assert "interrupted: 1 of 2 cases are stored in out" in err
    assert "Traceback" not in err
    assert psutil.wait_procs(children, timeout=5)[1] == []
    assert len(read_results(tmp_path / "out" / "results.h5").outcomes) == 1
    study = read_study(slow_second)
    with RunDirectory(tmp_path / "out", study.text) as directory:
        assert [case.index for case in directory.missing(planned_cases(study))] == [1]


@pytest.mark.parametrize("end", [(KeyboardInterrupt(), 130), (Terminated(), 143), (ResumableError("it is full"), 4)])
def test_an_end_while_the_report_is_drawn_costs_the_report_only(
    command: Command, finished: Path, tiny: Path, monkeypatch: pytest.MonkeyPatch, end: tuple[BaseException, int]
) -> None:
    """The results are there, the directory is free again, and the user knows how to go on."""

    def write_report(*_: object, **__: object) -> NoReturn:
        raise end[0]

    monkeypatch.setattr("magbear_cli.report.writing.write_report", write_report)
    shutil.copytree(finished / "cases", tiny.parent / "out" / "cases")
    ended = command("run", tiny, "-o", "out")
    assert (ended.code, ended.out) == (end[1], "")
    assert "it is full" in ended.err or "run the same command again to go on" in ended.err
    assert len(read_results(tiny.parent / "out" / "results.h5").outcomes) == 2
    DirectoryLock(tiny.parent / "out").release()


def test_a_full_disk_keeps_what_was_stored(
    command: Command, tiny: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """When a case cannot be stored the run ends with 4, and no worker goes on without it."""

    def keep(*_: object) -> NoReturn:
        raise ResumableError("no space is left")

    monkeypatch.setattr("magbear_cli.store.run_directory.RunDirectory.keep", keep)
    before = set(psutil.Process().children(recursive=True))
    ended = command("run", tiny, "-o", "out")
    assert (ended.code, ended.out) == (4, "")
    assert "no space is left" in ended.err
    assert set(psutil.Process().children(recursive=True)) <= before
    DirectoryLock(tmp_path / "out").release()


@pytest.mark.parametrize("home", [None, "/proc/nowhere"])
def test_a_homeless_user_gets_a_report(process: Process, finished: Path, tmp_path: Path, home: str | None) -> None:
    """Without HOME, or with one that cannot be written, the report is drawn."""
    changed = {"HOME": home, "XDG_CACHE_HOME": None, "MPLCONFIGDIR": None}
    ended = process("report", finished, "-o", "page", changed=changed)
    assert ended.code == 0, ended.err
    assert (tmp_path / "page" / "index.html").is_file()


def test_a_study_comes_through_standard_input(process: Process, tiny: Path) -> None:
    """``-`` reads the study from a pipe."""
    ended = process("plan", "-", "--set", "controller.r=3e-9", through=f"< '{tiny}'")
    assert ended.code == 0, ended.err
    assert len(ended.out.splitlines()) == 1


@pytest.mark.usefixtures("quick_report")
def test_a_stored_controller_is_judged_like_the_rest(command: Command, finished: Path, tiny: Path) -> None:
    """A controller out of a results file gives the figures it had there."""
    was = read_results(finished / "results.h5").outcomes[0]
    stored = f"controller={{method: stored, path: {json.dumps(str(finished))}, case: {was.case_id}}}"
    ended = command("run", tiny, "--set", stored, "--json")
    assert ended.code == 0, ended.err
    (case,) = json.loads(ended.out)["cases"]
    assert case["method"] == "stored"
    assert case["worst_case"] == pytest.approx(was.summary.worst_case, rel=1e-12)
    assert case["steps"][0]["peak_current_a"] == pytest.approx(was.steps[0].peak_current_a, rel=1e-12)


def test_debug_shows_what_happened_inside_of_a_failed_case(command: Command, tiny: Path) -> None:
    """A case that ended in an error of its worker is shown with its traceback."""
    ended = command("run", tiny, "--set", "controller.r=3e-9", "--debug", "--timeout", "0.001")
    assert ended.code == 3
    assert "timeout" in ended.out

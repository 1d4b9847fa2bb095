"""A Dask cluster, a real scheduler with real workers, gives the outcomes of this machine and outlives what cases do."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil
import pytest

from magbear_cli.errors import InputError, ResumableError, Status
from magbear_cli.study.cluster import Cluster, run_on_cluster
from magbear_cli.study.events import CaseEnded, RunStopped
from magbear_cli.study.plan import Case
from magbear_cli.study.runner import RunnerOptions

pytest.importorskip("distributed")

MakeCases = Callable[..., tuple[Case, ...]]
Options = Callable[..., RunnerOptions]
TARGETS = Path(__file__).parent / "targets"


def toolchain() -> str:
    """What a Dask worker computes with; it imports this module by its name."""
    return os.environ.get("TOOLCHAIN", "ours")


@dataclass
class Machines:
    """A scheduler and its workers, each a process."""

    address: str
    scheduler: subprocess.Popen[bytes]
    workers: list[subprocess.Popen[bytes]]

    def cluster(self) -> Cluster:
        """The cluster as the runner is told of it."""
        return Cluster(self.address, toolchain, lambda before, now: f"{before} -> {now}")


@pytest.fixture
def machines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Machines]:
    """A scheduler on this machine with two workers of one thread."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(TARGETS), str(Path(__file__).parent)]))
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    monkeypatch.setattr(toolchain, "__module__", "test_cluster")
    file, logs = tmp_path / "scheduler.json", (tmp_path / "log").open("wb")

    def start(program: str, *more: str) -> subprocess.Popen[bytes]:
        line = [sys.executable, "-m", f"distributed.cli.{program}", "--scheduler-file", str(file), "--no-dashboard"]
        return subprocess.Popen([*line, *more], stdout=logs, stderr=logs, cwd=tmp_path)

    scheduler = start("dask_scheduler", "--host", "127.0.0.1", "--port", "0")
    workers = [start("dask_worker", "--nthreads", "1", "--no-nanny") for _ in range(2)]
    try:
        yield Machines(_address(file), scheduler, workers)
    finally:
        for process in (*workers, scheduler):
            process.kill()
            process.wait()
        logs.close()


def _address(file: Path) -> str:
    import json

    until = time.monotonic() + 60
    while time.monotonic() < until:
        if file.is_file() and file.read_text("utf-8").strip():
            address: str = json.loads(file.read_text("utf-8"))["address"]
            return address
        time.sleep(0.05)
    pytest.fail("the scheduler did not start")


def test_a_killed_machine_and_bad_cases_change_no_outcome(
    machines: Machines, make_cases: MakeCases, run: Callable[..., Any], outcomes: Callable[..., Any], options: Options
) -> None:
    """With one of two Dask workers killed, a hang and a crash among the cases, every outcome is that of a local run."""
    cases = make_cases(*["sleep:0.2"] * 6, "hang", "segfault", *["sleep:0.2"] * 6)
    limits = {"timeout_s": 2.0}
    alone = outcomes(run(cases, **limits))
    events = []
    for event in run_on_cluster(cases, options(**limits), machines.cluster()):
        events.append(event)
        if isinstance(event, CaseEnded) and machines.workers[0].poll() is None:
            machines.workers[0].kill()
    assert list(map(repr, outcomes(events))) == list(map(repr, alone))  # NaN is not itself
    assert [outcome.status for outcome in alone].count(Status.OK) == 12


def test_nothing_is_left_on_the_cluster(machines: Machines, make_cases: MakeCases, options: Options) -> None:
    """Two seconds after a run is stopped, or its process is killed, none of its processes is alive."""
    asked: list[bool] = []
    seen: list[psutil.Process] = []
    stopped: list[RunStopped] = []
    cases = make_cases("answer", "hang", "hang", "answer")
    began = time.monotonic()
    for event in run_on_cluster(cases, options(grace_s=0.1), machines.cluster(), lambda: bool(asked)):
        if isinstance(event, CaseEnded):
            seen = _children(machines)
            asked.append(True)
            began = time.monotonic()
        stopped += [event] if isinstance(event, RunStopped) else []
    assert seen
    assert stopped[0].cases_left >= 2
    assert psutil.wait_procs(seen, timeout=max(0.0, began + 2.0 - time.monotonic()))[1] == []

    script = textwrap.dedent(PARENT).format(tests=str(Path(__file__).parent), address=machines.address)
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        assert parent.stdout.readline() == b"ended\n"
        hung = _children(machines)
        assert hung
        parent.kill()
    assert psutil.wait_procs(hung, timeout=2)[1] == []


PARENT = """
import sys
sys.path.insert(0, {tests!r})
from test_cluster import toolchain
from magbear_cli.study.cluster import Cluster, run_on_cluster
from magbear_cli.study.plan import plan_cases
from magbear_cli.study.runner import RunnerOptions
cases = plan_cases({{"act": act, "number": n, "controller": {{"method": "x"}}}} for n, act in enumerate(["hang"] * 3 + ["answer"] * 3))
options = RunnerOptions(target="misbehaving:act", warm_modules=(), timeout_s=600.0)
import threading, time
threading.Timer(3.0, lambda: print("ended", flush=True)).start()
for event in run_on_cluster(cases, options, Cluster("{address}", toolchain, lambda a, b: "")):
    pass
"""  # noqa: E501 - a script


def _children(machines: Machines) -> list[psutil.Process]:
    """The processes under the Dask workers that are alive."""
    living = [psutil.Process(worker.pid) for worker in machines.workers if worker.poll() is None]
    return list(itertools.chain.from_iterable(worker.children(recursive=True) for worker in living))


def test_a_lost_scheduler_ends_the_run_with_a_sentence(
    machines: Machines, make_cases: MakeCases, options: Options
) -> None:
    """What was stored stays; running again, on another cluster or here, goes on."""
    cases = make_cases(*["sleep:0.1"] * 30)
    ended = []

    def run() -> None:
        for event in run_on_cluster(cases, options(), machines.cluster()):
            ended.append(event)
            machines.scheduler.kill()

    with pytest.raises(ResumableError, match=r"the Dask scheduler at .* (is gone|dropped a case)"):
        run()
    assert ended


def test_a_machine_of_another_kind_is_refused(
    machines: Machines, make_cases: MakeCases, options: Options, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Outcomes of other versions would be mixed in silently; the run stops and names what differs."""
    monkeypatch.setenv("TOOLCHAIN", "newer")
    with pytest.raises(ResumableError, match=r"another toolchain than this machine .*ours -> newer"):
        list(run_on_cluster(make_cases("answer"), options(), machines.cluster()))


def test_a_wrong_address_is_told(make_cases: MakeCases, options: Options, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is no address is a mistake; one where nobody answers is told after a while."""
    monkeypatch.setattr("magbear_cli.study.cluster.CONNECT_LIMIT_S", 0.5)
    for address, error, words in (
        ("nonsense://x:1", InputError, "this is no address"),
        ("127.0.0.1:9", ResumableError, "no Dask scheduler answers"),
    ):
        with pytest.raises(error, match=words):
            list(run_on_cluster(make_cases("answer"), options(), Cluster(address, toolchain, lambda _a, _b: "")))

"""Whatever a case does to its worker, it ends with a status and a sentence, and the other cases end as if alone."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil
import pytest

from magbear_cli.errors import InputError, ResumableError, Status
from magbear_cli.study.events import CaseEnded, CaseRetried, CaseStarted, RunStopped
from magbear_cli.study.plan import Case
from magbear_cli.study.runner import RunnerOptions, run_cases

Run = Callable[..., list[Any]]
MakeCases = Callable[..., tuple[Case, ...]]
Options = Callable[..., RunnerOptions]


def test_good_cases_end_ok_in_any_number_of_workers(make_cases: MakeCases, run: Run, outcomes: Run) -> None:
    """The outcomes, drawn numbers included, do not depend on how many workers there are or who computed what."""
    cases = make_cases(*["answer"] * 12)
    alone = outcomes(run(cases, jobs=1))
    together = outcomes(run(cases, jobs=3))
    assert [outcome.status for outcome in alone] == [Status.OK] * 12
    assert alone == together
    assert alone == outcomes(run(cases[::-1], jobs=2))
    assert len({outcome.summary.worst_case for outcome in alone}) == 12


@pytest.mark.parametrize(
    ("act", "status", "words"),
    [
        ("segfault", Status.CRASHED, "killed by SIGSEGV"),
        ("signal:SIGABRT", Status.CRASHED, "killed by SIGABRT"),
        ("signal:SIGKILL", Status.CRASHED, "killed by SIGKILL"),
        ("exit:0", Status.CRASHED, "ended by itself with exit code 0"),
        ("exit:9", Status.CRASHED, "ended by itself with exit code 9"),
        ("garbage", Status.CRASHED, "not an answer"),
        ("memory_error", Status.CRASHED, "ran out of memory"),
        ("leave", Status.FAILED, "SystemExit"),
        ("panic", Status.FAILED, "PanicException"),
        ("raise:ours", Status.FAILED, "two numbers disagree"),
        ("raise:input", Status.FAILED, "no such thing"),
        ("raise:other", Status.FAILED, "KeyError at misbehaving.py:"),
        ("number", Status.FAILED, "gave a int and no outcome"),
        ("lambda", Status.FAILED, "cannot leave its process"),
        ("print:200", Status.OK, ""),
    ],
)
def test_a_case_that_misbehaves_is_named_and_stops_no_other(
    act: str, status: Status, words: str, make_cases: MakeCases, run: Run, outcomes: Run
) -> None:
    """A bad case among good ones ends with its own status, one sentence and its id; the good ones end ok."""
    cases = make_cases("answer", act, "answer", "answer")
    ended = outcomes(run(cases))
    assert [outcome.status for outcome in ended] == [Status.OK, status, Status.OK, Status.OK]
    assert words in ended[1].sentence
    assert "\n" not in ended[1].sentence
    if status is not Status.OK:
        assert f"--case {cases[1].id}" in ended[1].sentence


def test_a_hang_in_native_code_is_killed_at_its_limit(make_cases: MakeCases, run: Run, outcomes: Run) -> None:
    """A case that holds the interpreter lock for ever is a timeout, tried once, while others go on."""
    events = run(make_cases("hang", "answer", "answer", "hang"), timeout_s=0.5)
    ended = outcomes(events)
    assert [outcome.status for outcome in ended] == [Status.TIMEOUT, Status.OK, Status.OK, Status.TIMEOUT]
    assert "time limit of 0.5 s" in ended[0].sentence
    assert not [event for event in events if isinstance(event, CaseRetried)]
    assert all(event.elapsed_s < 2.5 for event in events if isinstance(event, CaseEnded))


def test_a_case_that_eats_memory_is_killed_and_tried_once_more(make_cases: MakeCases, run: Run, outcomes: Run) -> None:
    """Growing past the limit ends in ``crashed`` with the limit named, after a second attempt."""
    events = run(make_cases("allocate:40", "answer"), memory_bytes=1 << 30)
    ended = outcomes(events)
    assert [outcome.status for outcome in ended] == [Status.CRASHED, Status.OK]
    assert "memory limit of 1 GiB" in ended[0].sentence
    assert sum(isinstance(event, CaseRetried) for event in events) == 1


def test_the_address_space_is_a_backstop(make_cases: MakeCases, run: Run, outcomes: Run) -> None:
    """An allocation far beyond the limit fails in the worker before a byte of it is touched."""
    ended = outcomes(run(make_cases("reserve:10", "reserve:1"), memory_bytes=1 << 30))
    assert [outcome.status for outcome in ended] == [Status.CRASHED, Status.OK]
    assert "ran out of memory" in ended[0].sentence


def test_a_crash_that_does_not_repeat_leaves_no_trace(
    make_cases: MakeCases, run: Run, outcomes: Run, tmp_path: Path
) -> None:
    """A case whose first worker was killed is computed by another process and ends as if nothing had happened."""
    events = run(make_cases(f"once:{tmp_path / 'mark'}", "answer"), jobs=1)
    assert [outcome.status for outcome in outcomes(events)] == [Status.OK, Status.OK]
    starts = [event for event in events if isinstance(event, CaseStarted) and event.case.index == 0]
    assert [event.attempt for event in starts] == [1, 2]
    assert starts[0].pid != starts[1].pid


def test_a_retry_goes_to_a_worker_without_a_past(
    make_cases: MakeCases, run: Run, outcomes: Run, tmp_path: Path
) -> None:
    """The second attempt is made by a process that computed nothing before, even when others are idle."""
    acts = ["answer", "answer", f"once:{tmp_path / 'mark'}"]
    events = run(make_cases(*acts), jobs=2)
    pids = [event.pid for event in events if isinstance(event, CaseStarted)]
    assert outcomes(events)[2].status is Status.OK
    assert pids[-1] not in pids[:-1]


def test_equal_cases_are_computed_once_and_end_everywhere(run: Run, outcomes: Run, make_cases: MakeCases) -> None:
    """One computation serves every place of the study with the same inputs, each with its own index."""
    case = make_cases("answer")[0]
    twins = tuple(type(case)(case.id, index, case.inputs) for index in range(3))
    events = run(twins)
    assert [outcome.index for outcome in outcomes(events)] == [0, 1, 2]
    assert sum(isinstance(event, CaseStarted) for event in events) == 1


def test_what_a_case_prints_is_kept_for_the_log_only(make_cases: MakeCases, run: Run) -> None:
    """The end of the printed text reaches the event of its own case and of no other."""
    events = [event for event in run(make_cases("print:1", "answer"), jobs=1) if isinstance(event, CaseEnded)]
    assert "SB10AD" in events[0].detail
    assert "SB10AD" not in events[1].detail
    assert len(events[0].detail) <= 8192


def test_the_callers_surroundings_do_not_reach_the_cases(
    make_cases: MakeCases, run: Run, outcomes: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Whatever the environment asks for, a worker has one thread; modules in the working directory are not imported."""
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "64")
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    (tmp_path / "random.py").write_text("raise SystemExit")
    monkeypatch.chdir(tmp_path)
    ended = outcomes(run(make_cases("threads"), jobs=1, warm_modules=("scipy.linalg", "slycot", "clarabel", "nothing")))
    assert [outcome.status for outcome in ended] == [Status.OK], ended[0].sentence


def test_a_worker_with_more_threads_refuses_to_work(options: Options) -> None:
    """A numerical library that came with several threads is named."""
    options()
    script = (
        "import sys\nfrom threadpoolctl import threadpool_info\nfrom magbear_cli.study import worker\n"
        "from magbear_cli.errors import MagbearError\nimport numpy\n"
        "if all(pool['num_threads'] == 1 for pool in threadpool_info()): sys.exit(7)\n"
        "try: worker._load('misbehaving:act', [])\n"
        "except MagbearError as error: sys.exit(0 if 'a worker must have one' in str(error) else 1)\n"
        "sys.exit(2)"
    )
    environment = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    code = subprocess.run([sys.executable, "-c", script], env=environment, check=False).returncode
    if code == 7:
        pytest.skip("on a machine with one core every library has one thread")
    assert code == 0


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ("unimportable:act", "libgfortran"),
        ("nowhere:act", "nowhere"),
        ("sleepy:act", "not ready after 0.2 s"),
        ("doomed:act", "exit code 3"),
    ],
)
def test_workers_that_cannot_start_end_the_run_with_a_sentence(
    target: str, words: str, make_cases: MakeCases, run: Run
) -> None:
    """A target that does not import, hangs in its import or ends its process stops the run, resumable."""
    with pytest.raises(ResumableError, match=words):
        run(make_cases("answer"), target=target, start_limit_s=0.2 if "sleepy" in target else 60.0)


@pytest.mark.parametrize(("limits", "ended"), [({"max_failures": 2}, 2), ({"fail_fast": True}, 1)])
def test_failures_stop_the_run_when_asked(limits: dict[str, Any], ended: int, make_cases: MakeCases, run: Run) -> None:
    """After the given number of failed cases nothing more is handed out, and what is left is counted."""
    events = run(make_cases(*["raise:ours"] * 5), jobs=1, **limits)
    assert sum(isinstance(event, CaseEnded) for event in events) == ended
    assert isinstance(events[-1], RunStopped)
    assert events[-1].cases_left == 5 - ended


def test_a_stopped_run_gives_running_cases_a_moment(make_cases: MakeCases, options: Options) -> None:
    """When asked to stop, the run keeps what ends within the grace, kills the rest and says how many are left."""
    asked: list[bool] = []
    events = []
    cases = make_cases("sleep:0.3", "hang", "answer")
    for event in run_cases(cases, options(grace_s=1.5), lambda: bool(asked)):
        events.append(event)
        if isinstance(event, CaseStarted):
            asked.append(True)
    ended = [event.outcome for event in events if isinstance(event, CaseEnded)]
    assert all(outcome.status is Status.OK for outcome in ended)
    assert isinstance(events[-1], RunStopped)
    assert events[-1].cases_left == 3 - len(ended)


def test_closing_the_iterator_kills_every_worker(make_cases: MakeCases, options: Options) -> None:
    """A consumer that stops half-way leaves no process behind."""
    events = run_cases(make_cases("hang", "hang", "hang"), options(jobs=3))
    started = [event for event in itertools.islice(events, 3) if isinstance(event, CaseStarted)]
    pids = [event.pid for event in started]
    assert len(pids) == 3
    assert all(psutil.pid_exists(pid) for pid in pids)
    events.close()
    assert not any(psutil.pid_exists(pid) for pid in pids)


def test_an_idle_worker_that_is_killed_costs_no_attempt(make_cases: MakeCases, options: Options) -> None:
    """A worker killed while it has no case disturbs nobody."""
    events, pids = [], {}
    for event in run_cases(make_cases("sleep:0.5", "answer"), options(jobs=2)):
        events.append(event)
        if isinstance(event, CaseStarted):
            pids[event.case.index] = event.pid
        if isinstance(event, CaseEnded) and event.outcome.index == 1:
            os.kill(pids[1], signal.SIGKILL)
    assert sorted(event.outcome.index for event in events if isinstance(event, CaseEnded)) == [0, 1]
    assert {event.attempt for event in events if isinstance(event, CaseStarted)} == {1}


@pytest.mark.parametrize("limits", [{"jobs": 0}, {"timeout_s": 0.0}, {"timeout_s": float("nan")}, {"memory_bytes": 1}])
def test_limits_under_which_nothing_can_run_are_refused(limits: dict[str, Any]) -> None:
    """Nonsense limits are an input error at once."""
    with pytest.raises(InputError):
        RunnerOptions(**limits)


PARENT = """
import signal
import sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # a test run in the background inherits that it is ignored
sys.path.insert(0, {tests!r})
from magbear_cli.study.plan import plan_cases
from magbear_cli.study.plan import Case
from magbear_cli.study.runner import RunnerOptions, run_cases
from magbear_cli.study.events import CaseStarted
acts = ["hang", "sleep:0.05", "hang"] + ["sleep:0.02"] * 50
cases = plan_cases({{"act": act, "number": n, "controller": {{"method": "x"}}}} for n, act in enumerate(acts))
for event in run_cases(cases, RunnerOptions(jobs=3, target="misbehaving:act", warm_modules=())):
    if isinstance(event, CaseStarted):
        print(event.pid, flush=True)
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_no_worker_outlives_the_parent(number: signal.Signals, options: Options) -> None:
    """However the parent dies, hung workers are gone within two seconds."""
    options()
    script = textwrap.dedent(PARENT).format(tests=str(Path(__file__).parent))
    parent = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    assert parent.stdout is not None
    pids = {int(parent.stdout.readline()) for _ in range(6)}
    workers = [psutil.Process(pid) for pid in pids if psutil.pid_exists(pid)]
    parent.send_signal(number)
    parent.wait(10)
    parent.stdout.close()
    _, alive = psutil.wait_procs(workers, timeout=2)
    assert not alive

"""Run cases in worker processes: each ends as an outcome, whatever it does, and none stops the others.

The parent is a supervisor. It hands one case at a time to each worker, waits on their sockets, and kills from outside
what hangs or grows too large. Which worker computes a case, and when, has no influence on its outcome.
"""

from __future__ import annotations

import contextlib
import os
import selectors
import time
from collections import defaultdict, deque
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from magbear_cli.errors import InputError, ResumableError, Status
from magbear_cli.study.chores import Chores
from magbear_cli.study.events import CaseEnded, CaseRetried, CaseStarted, Event, RunStopped
from magbear_cli.study.plan import Case, canonical_json
from magbear_cli.study.protocol import Answer, Chore, ChoreDone, GarbledError, Ready, Request, StartFailed
from magbear_cli.study.supervision import Worker, WorkerSettings, interrupts_held

if TYPE_CHECKING:
    from magbear_cli.study.outcome import CaseOutcome

SMALLEST_MEMORY_BYTES = 1 << 30  # below this OpenBLAS aborts or hangs in place of failing
POLL_S = 0.1
ABSENCE_S = 1.0  # a parent away for longer (stopped, or busy storing) does not charge the cases for it
ATTEMPTS = 2
FAILED_STARTS = 5
CHORES_WORTH_A_START = 8  # for fewer a further worker, which takes a second to start, does not pay
CHORE_LIMIT_S = 120.0


@dataclass(frozen=True)
class RunnerOptions:
    """How a run is limited.

    ``timeout_s`` and ``memory_bytes`` are per case (None: no limit); ``max_failures`` stops handing out cases after so
    many failed ones, ``fail_fast`` stops at the first and does not wait for the others; ``grace_s`` is what running
    cases get after an interruption. ``target`` is the function that computes a case, ``warm_modules`` what a worker
    imports once beside it.
    """

    jobs: int = 1
    timeout_s: float | None = 300.0
    memory_bytes: int | None = 4 << 30
    max_failures: int | None = None
    fail_fast: bool = False
    grace_s: float = 1.0
    start_limit_s: float = 120.0
    target: str = "magbear_cli.study.pipeline:run_case"
    warm_modules: tuple[str, ...] = ("scipy.linalg", "slycot", "clarabel")

    def __post_init__(self) -> None:
        """Refuse limits under which nothing can be computed."""
        if self.jobs < 1:
            raise InputError(f"the number of jobs must be at least 1, not {self.jobs}")
        if self.timeout_s is not None and not self.timeout_s > 0:
            raise InputError(f"the time limit of a case must be positive, not {self.timeout_s} s")
        if self.memory_bytes is not None and self.memory_bytes < SMALLEST_MEMORY_BYTES:
            raise InputError(f"a worker needs at least 1 GiB of memory, not {self.memory_bytes / (1 << 30):.3g} GiB")


@dataclass
class _Task:
    """A computation that may stand at several places of the study."""

    cases: list[Case]
    attempts: int = 0

    @property
    def case(self) -> Case:
        return self.cases[0]


@dataclass(eq=False)
class _Desk:
    """A worker with what it is doing now."""

    worker: Worker
    ready: bool = False
    served: int = 0
    task: _Task | None = None
    chore: Chore | None = None
    since_s: float = field(default_factory=time.monotonic)

    @property
    def is_fresh(self) -> bool:
        return self.served == 0 and self.task is None and self.chore is None

    @property
    def is_idle(self) -> bool:
        return self.ready and self.task is None and self.chore is None


def available_cores() -> int:
    """The cores this process may use, as a batch system or container limits them."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1


def run_cases(
    cases: Sequence[Case],
    options: RunnerOptions,
    should_stop: Callable[[], bool] = lambda: False,
    chores: Chores | None = None,
) -> Generator[Event, None, None]:
    """Compute the cases and yield what happens, outcomes as they end.

    Equal cases are computed once and end at each of their places. ``should_stop`` is asked ten times a second; when it
    says yes, running cases get ``grace_s`` to end and the rest is left. Closing the iterator, or an exception in it,
    kills every worker, unless ``chores`` take them over.

    Raises
    ------
    ResumableError
        when workers cannot be started at all.
    """
    shift = Shift(cases, options, should_stop)
    if chores is not None:
        chores.lend(shift)
    try:
        yield from shift.events()
    finally:
        if chores is None:
            shift.close()


class Shift:
    """The loop over the workers of one run; they stay until ``close``, so that more cases can be taken on."""

    def __init__(self, cases: Sequence[Case], options: RunnerOptions, should_stop: Callable[[], bool]) -> None:
        """Take these cases on; nothing is started yet."""
        self.chores = Chores()
        self.options = options
        self.should_stop = should_stop
        self.waiting: deque[_Task] = deque()
        self.retries: deque[_Task] = deque()
        self.desks: list[_Desk] = []
        self.selector = selectors.DefaultSelector()
        self.failed_starts = 0
        self.failures = 0
        self.seen_s = time.monotonic()
        self.settings = WorkerSettings(options.target, options.warm_modules, options.memory_bytes)
        self.take_on(cases)

    def take_on(self, cases: Sequence[Case]) -> None:
        """Add cases to compute; equal ones are computed once."""
        places: defaultdict[str, list[Case]] = defaultdict(list)
        for case in cases:
            places[case.id].append(case)
        self.waiting.extend(_Task(same) for same in places.values())

    def events(self) -> Iterator[Event]:
        """Everything that happens until no case is left, or the run is stopped.

        Freed workers get their next case before the reader hears of the last one, so they work while it is stored.
        """
        happened: list[Event] = []
        while self.waiting or self.retries or self._busy():
            stop = self._reason_to_stop()
            if stop:
                yield from happened
                yield from self._wind_down(stop)
                return
            self._staff()
            happened += self._hand_out()
            yield from happened
            happened = list(self._watch())
        yield from happened

    def do_chores(self, patience_s: float | None) -> None:
        """Hand out and take in chores, for so long (None: until something happens); there are no more cases.

        Raises
        ------
        ResumableError
            when workers cannot be started.
        """
        self.waiting.clear()
        self.retries.clear()
        for desk in self._busy():  # of a run that was stopped
            self._dismiss(desk)
        self._staff()
        for _ in (*self._hand_out(), *self._watch(POLL_S if patience_s is None else patience_s)):
            """Nothing but chores is done, and they are no events."""

    def close(self) -> None:
        """Kill every worker; a second interruption cannot stop this half-way."""
        with interrupts_held():
            for desk in self.desks:
                with contextlib.suppress(OSError):
                    desk.worker.process.kill()
            while self.desks:
                self.desks.pop().worker.close()
            self.selector.close()

    def _busy(self) -> list[_Desk]:
        return [desk for desk in self.desks if desk.task]

    def _reason_to_stop(self) -> str:
        if self.should_stop():
            return "interrupted"
        limit = 1 if self.options.fail_fast else self.options.max_failures
        if limit is not None and self.failures >= limit:
            return f"stopped after {self.failures} failed case{'s' if self.failures > 1 else ''}"
        return ""

    def _wind_down(self, sentence: str) -> Iterator[Event]:
        """Wait for running cases as long as they may run on, hand out nothing, say what is left."""
        interrupted = self.should_stop()
        patience_s = self.options.grace_s if interrupted else 0.0 if self.options.fail_fast else float("inf")
        until_s = time.monotonic() + patience_s
        while self._busy() and time.monotonic() < until_s:
            if not interrupted and self.should_stop():
                interrupted, until_s = True, time.monotonic() + self.options.grace_s
            yield from self._watch(min(POLL_S, max(0.0, until_s - time.monotonic())))
        left = [*self.waiting, *self.retries, *(desk.task for desk in self._busy() if desk.task)]
        yield RunStopped(sentence, sum(len(task.cases) for task in left))

    def _staff(self) -> None:
        """Start the workers that the waiting cases can use; a case that lost its worker gets a new one."""
        used = [desk for desk in self.desks if desk.is_idle and desk.served]
        fresh = sum(desk.is_fresh for desk in self.desks)
        wanted = len(self.retries) + max(0, len(self.waiting) - len(used)) or self._helpers_wanted(fresh)
        if self.retries and not fresh and used and len(self.desks) >= self.options.jobs:
            self._dismiss(used[0])
        while fresh < wanted and len(self.desks) < self.options.jobs:
            with interrupts_held():
                try:
                    self.desks.append(_Desk(Worker(self.settings, self.selector)))
                except OSError as error:
                    raise ResumableError(f"a worker process cannot be started: {error.strerror}") from error
            fresh += 1

    def _helpers_wanted(self, fresh: int) -> int:
        """How many workers more would be of use to the chores, which have those that are there."""
        there = len(self.desks) - fresh
        return max(len(self.chores) // CHORES_WORTH_A_START - there, int(there == 0 and len(self.chores) > 0))

    def _dismiss(self, desk: _Desk) -> None:
        """Close a worker; noted as gone only after it is."""
        desk.worker.close()
        self.desks.remove(desk)

    def _hand_out(self) -> Iterator[Event]:
        for desk in self.desks:
            if not desk.is_idle or not desk.worker.is_running:
                continue
            if self.retries and desk.is_fresh:
                task = self.retries.popleft()
            elif self.waiting:
                task = self.waiting.popleft()
            else:
                self._hand_out_chore(desk)
                continue
            task.attempts += 1
            desk.task, desk.since_s = task, time.monotonic()
            desk.worker.forget_printed()
            desk.worker.send(Request(task.case.id, task.case.index, canonical_json(task.case.inputs)))
            yield CaseStarted(task.case, task.attempts, desk.worker.pid)

    def _hand_out_chore(self, desk: _Desk) -> None:
        desk.chore = self.chores.take()
        if desk.chore is not None:
            desk.since_s = time.monotonic()
            desk.worker.forget_printed()
            desk.worker.send(desk.chore)

    def _watch(self, patience_s: float = POLL_S) -> Iterator[Event]:
        """Wait for something to happen, then look at every worker: its words first, its limits after."""
        self.selector.select(patience_s)
        now_s, before_s = time.monotonic(), self.seen_s
        self.seen_s = now_s
        for desk in tuple(self.desks):
            if now_s - before_s > ABSENCE_S:
                desk.since_s = min(now_s, desk.since_s + now_s - before_s)
            yield from self._listen(desk)
        for desk in tuple(self.desks):
            yield from self._enforce_limits(desk)

    def _listen(self, desk: _Desk) -> Iterator[Event]:
        try:
            messages, is_alive = desk.worker.poll()
        except GarbledError as error:
            yield from self._lose(desk, str(error))
            return
        for message in messages:
            if isinstance(message, Ready) and not desk.ready:
                desk.ready, self.failed_starts = True, 0
            elif isinstance(message, ChoreDone) and desk.chore and message.number == desk.chore.number:
                self.chores.end(message.number, message.result)
                desk.chore = None
                desk.served += 1
            elif isinstance(message, StartFailed):
                raise ResumableError(f"the worker processes cannot start: {message.sentence}")
            elif isinstance(message, Answer) and desk.task and message.case_id == desk.task.case.id:
                yield from self._take(desk, message)
                if message.retire:
                    self._dismiss(desk)
                    return
            else:
                yield from self._lose(desk, "what the worker sent is not an answer")
                return
        if not is_alive:
            yield from self._lose(desk, desk.worker.how_it_died())

    def _take(self, desk: _Desk, answer: Answer) -> Iterator[Event]:
        """The end of a case whose worker could say how it ended."""
        task, desk.task = desk.task, None
        desk.served += 1
        if task is None:
            return
        elapsed_s = time.monotonic() - desk.since_s
        detail = "\n".join(part for part in (answer.detail, desk.worker.printed_tail) if part)
        if answer.out_of_memory:
            yield from self._try_again(task, f"the case {answer.sentence}", detail, elapsed_s)
        elif answer.outcome is None:
            yield from self._end(task, failed_outcome(task.case, Status.FAILED, answer.sentence), detail, elapsed_s)
        else:
            yield from self._end(task, _believed(task.case, answer.outcome), detail, elapsed_s)

    def _lose(self, desk: _Desk, cause: str) -> Iterator[Event]:
        """A worker is gone or not to be trusted; its case, if it had one, is tried once more."""
        task, elapsed_s = desk.task, time.monotonic() - desk.since_s
        self._dismiss(desk)
        if desk.chore:
            self.chores.end(desk.chore.number, None)
        elif task:
            yield from self._try_again(task, cause, desk.worker.printed_tail, elapsed_s)
        elif not desk.ready:
            self._count_failed_start(cause, desk.worker.printed_tail)

    def _try_again(self, task: _Task, cause: str, detail: str, elapsed_s: float) -> Iterator[Event]:
        if task.attempts < ATTEMPTS:
            self.retries.append(task)
            yield CaseRetried(task.case, cause, detail)
        else:
            sentence = f"{cause}; this was the second attempt"
            yield from self._end(task, failed_outcome(task.case, Status.CRASHED, sentence), detail, elapsed_s)

    def _end(self, task: _Task, outcome: CaseOutcome, detail: str, elapsed_s: float) -> Iterator[Event]:
        for case in task.cases:
            self.failures += not outcome.status.is_answer
            yield CaseEnded(replace(outcome, index=case.index), task.attempts, elapsed_s, detail)

    def _enforce_limits(self, desk: _Desk) -> Iterator[Event]:
        elapsed_s = time.monotonic() - desk.since_s
        limit_s, memory_bytes, task = self.options.timeout_s, self.options.memory_bytes, desk.task
        if not desk.ready and elapsed_s > self.options.start_limit_s:
            self._dismiss(desk)
            self._count_failed_start(f"not ready after {self.options.start_limit_s:g} s", desk.worker.printed_tail)
        elif task and limit_s is not None and elapsed_s > limit_s:
            self._dismiss(desk)
            outcome = failed_outcome(task.case, Status.TIMEOUT, f"stopped at its time limit of {limit_s:g} s")
            yield from self._end(task, outcome, desk.worker.printed_tail, elapsed_s)
        elif desk.chore and elapsed_s > CHORE_LIMIT_S:
            yield from self._lose(desk, "")
        elif (task or desk.chore) and memory_bytes is not None and desk.worker.resident_bytes() > memory_bytes:
            cause = f"the case grew past its memory limit of {memory_bytes / (1 << 30):.3g} GiB"
            yield from self._lose(desk, cause)

    def _count_failed_start(self, cause: str, printed: str) -> None:
        self.failed_starts += 1
        if self.failed_starts >= FAILED_STARTS:
            last = printed.strip().splitlines()[-1:]
            told = f" ({last[0].strip()})" if last else ""
            raise ResumableError(
                f"the worker processes cannot start, {FAILED_STARTS} in a row were lost: {cause}{told}"
            )


def failed_outcome(case: Case, status: Status, cause: str) -> CaseOutcome:
    """The outcome of a case that gave no answer, with what to do to see it alone."""
    from magbear_cli.study.outcome import CaseOutcome  # noqa: PLC0415 - loads numpy, which a quick command does not need

    return CaseOutcome(case.id, case.index, case.inputs, status, f"{cause}; --case {case.id} repeats it alone")


def _believed(case: Case, outcome: object) -> CaseOutcome:
    """The outcome under the parent's own identity and inputs, if it is an outcome at all."""
    from magbear_cli.study.outcome import CaseOutcome  # noqa: PLC0415 - the same

    if not isinstance(outcome, CaseOutcome):
        return failed_outcome(case, Status.FAILED, f"the computation gave a {type(outcome).__name__} and no outcome")
    return replace(outcome, case_id=case.id, index=case.index, inputs=case.inputs)

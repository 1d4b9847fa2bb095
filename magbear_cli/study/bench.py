"""What a thread of a Dask worker keeps from case to case: a supervisor with its worker process.

The process dies with the thread, when a case is no longer wanted, and after a moment without a case; so nothing of a
run is left on a cluster soon after the run has ended, however it ended.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

from magbear_cli.study.events import Event, RunStopped
from magbear_cli.study.plan import Case
from magbear_cli.study.runner import RunnerOptions, Shift

IDLE_S = 1.0  # a process without a case for longer is ended

_own = threading.local()
_fingerprints: dict[Callable[[], str], str] = {}


@dataclass(frozen=True)
class Account:
    """What became of a case on a machine, the machine, and what it computes with."""

    events: tuple[Event, ...]
    place: str
    fingerprint: str


def supervised(case: Case, options: RunnerOptions, fingerprint: Callable[[], str], expected: str) -> Account:
    """Compute a case as a task of a Dask worker; with another toolchain than expected nothing is computed."""
    from distributed import get_worker  # noqa: PLC0415 - an extra

    worker = get_worker()
    key = worker.get_current_task()
    if fingerprint not in _fingerprints:
        _fingerprints[fingerprint] = fingerprint()
    events: tuple[Event, ...] = ()
    if _fingerprints[fingerprint] == expected:

        def is_unwanted() -> bool:
            task = worker.state.tasks.get(key)
            return task is None or task.state != "executing"

        events = tuple(_bench().compute(case, options, is_unwanted))
    return Account(events, worker.address, _fingerprints[fingerprint])


def _bench() -> _Bench:
    """The bench of this thread."""
    if not hasattr(_own, "bench"):
        _own.bench = _Bench()
    bench: _Bench = _own.bench
    return bench


class _Bench:
    """A supervisor over one process, and the timer that ends it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._shift: Shift | None = None
        self._timer: threading.Timer | None = None

    def compute(self, case: Case, options: RunnerOptions, is_unwanted: Callable[[], bool]) -> list[Event]:
        """Everything that happens until the case has ended, or is no longer wanted."""
        if self._timer is not None:
            self._timer.cancel()
        with self._lock:
            shift = self._shift
            if shift is None or shift.options != options:
                self._close()
                shift = self._shift = Shift((), options, is_unwanted)
            shift.should_stop = is_unwanted
            shift.take_on([case])
            try:
                events = list(shift.events())
            except BaseException:
                self._close()
                raise
            if any(isinstance(event, RunStopped) for event in events):
                self._close()
        self._timer = threading.Timer(IDLE_S, self._rest)
        self._timer.daemon = True
        self._timer.start()
        return events

    def _rest(self) -> None:
        """End the process, unless a case has come meanwhile."""
        if self._lock.acquire(blocking=False):
            try:
                self._close()
            finally:
                self._lock.release()

    def _close(self) -> None:
        if self._shift is not None:
            self._shift.close()
            self._shift = None

"""Run cases on the machines of a Dask cluster: each in the same watched process as here, with the same outcome.

A Dask worker only holds the watch: a thread of it runs the supervisor of ``study.runner`` over a process of its own and
waits with the interpreter lock free, so a case that hangs or crashes costs the cluster nothing. When a Dask worker is
lost the scheduler gives its cases to others; outcomes are stored by this process alone, as they arrive.
"""

from __future__ import annotations

import logging
import queue
import time
from collections import defaultdict, deque
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from magbear_cli.errors import InputError, MagbearError, ResumableError, Status
from magbear_cli.study.bench import Account, supervised
from magbear_cli.study.events import CaseEnded, CaseRetried, Event, RunStopped
from magbear_cli.study.plan import Case
from magbear_cli.study.runner import POLL_S, RunnerOptions, failed_outcome

CONNECT_LIMIT_S = 15.0
PER_THREAD = 3  # cases handed to the scheduler for each thread, so that none waits for this process
KEY_PREFIX = "magbear"


@dataclass(frozen=True)
class Cluster:
    """A Dask cluster: the scheduler's address, and how its machines are known to compute as this one does.

    ``fingerprint`` is called in each Dask worker and here; ``difference`` puts two answers that differ into words.
    """

    address: str
    fingerprint: Callable[[], str]
    difference: Callable[[str, str], str]


def run_on_cluster(
    cases: Sequence[Case], options: RunnerOptions, cluster: Cluster, should_stop: Callable[[], bool] = lambda: False
) -> Generator[Event, None, None]:
    """Compute the cases on a cluster and yield what happens, as ``run_cases`` does here.

    ``options.jobs`` does not matter: each thread of the cluster computes one case at a time. Running cases are left
    when the run stops, after ``grace_s`` if it was interrupted.

    Raises
    ------
    InputError
        when the address is none, or Dask is not installed.
    ResumableError
        when the scheduler does not answer or is lost, or a machine computes with another toolchain.
    """
    client = _connected(cluster.address)
    try:
        yield from _Dispatch(client, cases, options, cluster, should_stop).events()
    except OSError as error:  # what distributed raises when a connection breaks
        raise ResumableError(f"the Dask scheduler at {cluster.address} is gone") from error
    finally:
        client.close(timeout=2)


class _Dispatch:
    """The cases of one run on their way to the cluster and back."""

    def __init__(
        self,
        client: Any,  # noqa: ANN401 - a distributed.Client, which is imported late
        cases: Sequence[Case],
        options: RunnerOptions,
        cluster: Cluster,
        should_stop: Callable[[], bool],
    ) -> None:
        places: defaultdict[str, list[Case]] = defaultdict(list)
        for case in cases:
            places[case.id].append(case)
        self.client, self.options, self.should_stop = client, options, should_stop
        self.cluster, self.expected = cluster, cluster.fingerprint()
        self.waiting = deque(places.values())
        self.running: dict[Any, list[Case]] = {}  # by future
        self.done: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self.failures = 0
        self.run_key = f"{KEY_PREFIX}-{time.time_ns():x}"
        self.abroad = replace(options, jobs=1, grace_s=0.0, fail_fast=False, max_failures=None)

    def events(self) -> Iterator[Event]:
        """Everything that happens until no case is left, or the run is stopped."""
        self._wait_for_machines()
        while self.waiting or self.running:
            stop = self._reason_to_stop()
            if stop:
                yield from self._wind_down(stop)
                return
            self._hand_out()
            yield from self._collect(POLL_S)

    def _wait_for_machines(self) -> None:
        until_s = time.monotonic() + self.options.start_limit_s
        while not self.client.nthreads() and not self.should_stop():
            if time.monotonic() > until_s:
                raise ResumableError(
                    f"the Dask scheduler at {self.cluster.address} has no workers; start some with dask worker"
                )
            time.sleep(POLL_S)

    def _reason_to_stop(self) -> str:
        if self.should_stop():
            return "interrupted"
        limit = 1 if self.options.fail_fast else self.options.max_failures
        if limit is not None and self.failures >= limit:
            return f"stopped after {self.failures} failed case{'s' if self.failures > 1 else ''}"
        return ""

    def _hand_out(self) -> None:
        """Keep every thread of the cluster, as many as it has now, supplied."""
        if not self.waiting:
            return
        threads = sum(self.client.nthreads().values())
        while self.waiting and len(self.running) < PER_THREAD * max(1, threads):
            same = self.waiting.popleft()
            future = self.client.submit(
                supervised, same[0], self.abroad, self.cluster.fingerprint, self.expected,
                key=f"{self.run_key}-{same[0].id}", pure=False,
            )  # fmt: skip
            self.running[future] = same
            future.add_done_callback(self.done.put)

    def _collect(self, patience_s: float) -> Iterator[Event]:
        """What came back: the first with patience, the rest without."""
        try:
            yield from self._take(self.done.get(timeout=patience_s))
            while True:
                yield from self._take(self.done.get_nowait())
        except queue.Empty:
            if self.client.status not in {"running", "connecting"}:
                raise ResumableError(f"the Dask scheduler at {self.cluster.address} is gone") from None

    def _take(self, future: Any) -> Iterator[Event]:  # noqa: ANN401 - a distributed.Future
        same = self.running.pop(future, None)
        if same is None:
            return
        for event in self._answer(future, same):
            if isinstance(event, CaseRetried):
                yield event
            if not isinstance(event, CaseEnded):
                continue
            for case in same:
                self.failures += not event.outcome.status.is_answer
                yield replace(event, outcome=replace(event.outcome, index=case.index, inputs=case.inputs))

    def _answer(self, future: Any, same: list[Case]) -> Sequence[Event]:  # noqa: ANN401 - the same
        """What the supervisor there saw of a case; a case that no machine survived has crashed."""
        from distributed import CancelledError  # noqa: PLC0415 - an extra
        from distributed.scheduler import KilledWorker  # noqa: PLC0415 - the same

        try:
            told: Account = future.result()
        except KilledWorker as error:
            cause = f"the Dask workers that were given it were lost, the last one at {error.last_worker.address}"
            return [CaseEnded(failed_outcome(same[0], Status.CRASHED, cause), 1, 0.0, str(error))]
        except CancelledError as error:
            raise ResumableError(f"the Dask scheduler at {self.cluster.address} dropped a case: {error}") from error
        except MagbearError as error:
            raise ResumableError(f"on a Dask worker {error}") from error
        except Exception as error:
            if isinstance(error, OSError) and future.status != "error":  # not the call failed, but fetching its answer
                raise
            raise ResumableError(f"a Dask worker cannot run magbear: {type(error).__name__}: {error}") from error
        if told.fingerprint != self.expected:
            change = self.cluster.difference(told.fingerprint, self.expected)
            raise ResumableError(
                f"the Dask worker {told.place} computes with another toolchain than this machine ({change}); "
                "install the same versions there, on machines of the same kind"
            )
        return told.events

    def _wind_down(self, sentence: str) -> Iterator[Event]:
        """After an interruption take what comes within the grace; then let go of the rest."""
        until_s = time.monotonic() + (self.options.grace_s if self.should_stop() else 0.0)
        while self.running and time.monotonic() < until_s:
            yield from self._collect(min(POLL_S, max(0.0, until_s - time.monotonic())))
        left = [*self.waiting, *self.running.values()]
        self.client.cancel(list(self.running), force=True)
        yield RunStopped(sentence, sum(len(same) for same in left))


def _connected(address: str) -> Any:  # noqa: ANN401 - a distributed.Client
    """A client of the scheduler, which keeps its own talk to itself."""
    try:
        from distributed import Client  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise InputError(
            "--executor dask needs the extra of that name: pip install 'magbear[dask]', here and on the workers"
        ) from error
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        return Client(address, timeout=CONNECT_LIMIT_S, set_as_default=False)
    except ValueError as error:
        raise InputError(f"--scheduler {address}: this is no address: {error}; write HOST:PORT") from error
    except OSError as error:
        raise ResumableError(f"no Dask scheduler answers at {address}") from error

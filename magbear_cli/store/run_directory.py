"""The directory of a run: the study as given, a shard a finished case, a lock, a log, and what is made of them.

::

    DIR/.lock                                    held while a run works here
    DIR/study.yaml                               the study as given
    DIR/cases/ab/abcdef0123456789.<digest>.case  one finished case
    DIR/log.jsonl                                times, hosts, attempts: everything that changes from run to run
    DIR/results.h5                               all cases, written when the run ends
    DIR/report/index.html                        the report

Running again computes what is missing: cases never finished, cases that ended without an answer (``timeout``,
``crashed``, ``failed``: stored for the report, and tried again), damaged shards, and cases of another toolchain.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import socket
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from magbear_cli.errors import ResumableError
from magbear_cli.store.durable import AGAIN, MEGABYTE, make_directory, told_as_sentence, write_durably
from magbear_cli.store.forms import grow_provenance, harvest_provenance
from magbear_cli.store.lock import DirectoryLock
from magbear_cli.store.results import write_outcomes
from magbear_cli.store.shards import (
    DamagedShardError,
    ShardHead,
    UnreadableShardError,
    copy_shard,
    read_head,
    read_shard,
    take_inventory,
    write_shard,
)
from magbear_cli.store.toolchain import Toolchain, provenance, this_toolchain
from magbear_cli.study.outcome import CaseOutcome, StudyResults
from magbear_cli.study.plan import Case

CASE_ESTIMATE_BYTES = 500_000  # 400 frequencies, 3 masses and 3 steps of 1001 samples take 290 kB
COPIES = 2  # shards and results
MOST_WHOLE = 200  # cases held with their samples when a run ends, for the figures of its report


class RunDirectory:
    """A run's directory, locked for this process; a context manager.

    ``notes`` are sentences about what was found and not used, for the user.
    """

    def __init__(
        self,
        path: Path,
        study_text: str,
        toolchain: Toolchain | None = None,
        *,
        accept_mixed: bool = False,
        must_lock: bool = True,
    ) -> None:
        """Make or take over the directory, lock it, and keep the study as given.

        With ``accept_mixed`` answers that another toolchain computed are good; the results then name it. Without
        ``must_lock`` a file system that cannot lock is a note.

        Raises
        ------
        ResumableError
            when another run holds the directory or the system refuses.
        """
        self.path = path
        self.toolchain = this_toolchain() if toolchain is None else toolchain
        self.is_mixed_accepted = accept_mixed
        self.notes: list[str] = []
        self._text = study_text
        self._cases = path / "cases"
        make_directory(path)
        self._lock = DirectoryLock(path, must_lock=must_lock)
        self.notes += [self._lock.warning] if self._lock.warning else []
        try:
            self._settle()
        except BaseException:
            self._lock.release()
            raise

    @property
    def results_path(self) -> Path:
        """Where the results file belongs."""
        return self.path / "results.h5"

    @property
    def report_path(self) -> Path:
        """Where the report's page belongs."""
        return self.path / "report" / "index.html"

    @property
    def log_path(self) -> Path:
        """Where the log is."""
        return self.path / "log.jsonl"

    def __enter__(self) -> Self:
        """Give the directory."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Let another run take it."""
        self._lock.release()

    def missing(self, cases: Sequence[Case]) -> tuple[Case, ...]:
        """The cases that must be computed; sentences on the others that cannot be used go to ``notes``."""
        reasons: Counter[str] = Counter()
        kept = {case.id: self._is_answered(case, reasons) for case in {case.id: case for case in cases}.values()}
        self.notes += [f"{reason} ({count_of(count)})" for reason, count in sorted(reasons.items())]
        return tuple(case for case in cases if not kept[case.id])

    def reserve(self, cases: int) -> None:
        """Make sure that so many more cases fit onto the disk.

        Raises
        ------
        ResumableError
            with the space that is needed, when they do not.
        """
        needed = cases * COPIES * self._bytes_per_case()
        with told_as_sentence(self.path, 0):
            free = shutil.disk_usage(self.path).free
        if needed > free:
            has = f"{needed / MEGABYTE:.3g} MB are needed for {cases} cases and {free / MEGABYTE:.3g} MB are free"
            raise ResumableError(f"{self.path}: {has}; make room and {AGAIN}")

    def keep(self, outcome: CaseOutcome) -> None:
        """Store a finished case for good; when this returns, nothing takes it back.

        Raises
        ------
        ResumableError
            when the system refuses; what was kept before is not touched.
        """
        self._inventory[outcome.case_id] = (write_shard(self._cases, outcome, self.toolchain),)

    def adopt(self, other: RunDirectory, cases: Iterable[Case]) -> None:
        """Take over what another directory has stored of these cases, as it is, with the toolchain it names.

        Raises
        ------
        ResumableError
            when the system refuses; what was taken before stays.
        """
        for case in cases:
            chosen = other._chosen(case, Counter())
            if chosen:
                path = copy_shard(chosen[0], self._cases)
                self._inventory[case.id] = (*self._inventory.get(case.id, ()), path)

    def outcomes(self, cases: Iterable[Case]) -> Iterator[CaseOutcome]:
        """What is stored of these cases, answers and failures, in their order, each read when it is asked for.

        Raises
        ------
        ResumableError
            when the system does not give what is stored, or a shard cannot be read although its name proves its
            content.
        """
        for case in cases:
            try:
                chosen = self._chosen(case, Counter(), is_patient=False)
                outcome = read_shard(chosen[0], case) if chosen else None
            except UnreadableShardError as error:
                raise ResumableError(f"{self._cases}: {error}; {AGAIN}") from error
            except DamagedShardError as error:
                raise ResumableError(f"{self._cases}: {error}; delete it and {AGAIN}") from error
            if outcome is not None:
                yield outcome

    def gather(
        self,
        cases: Sequence[Case],
        name: str,
        report: Mapping[str, Any],
        meanwhile: Callable[[], object] = lambda: None,
    ) -> StudyResults:
        """Write the results file of the study as far as it was computed, and give what it holds.

        One case is in memory at a time. Of the first ``MOST_WHOLE`` the answer has everything, of the others all but
        the samples. ``meanwhile`` is called after each case, for what must not wait for all of them.

        Raises
        ------
        ResumableError
            when the system refuses; an older results file then stands as it was.
        """
        told = StudyResults(name, self._text, (), report, self._origin(cases))
        about = harvest_provenance(grow_provenance(told))  # what is shown is what the file says
        kept: list[CaseOutcome] = []

        def passed_on() -> Iterator[CaseOutcome]:
            for outcome in self.outcomes(cases):
                kept.append(outcome if len(kept) < MOST_WHOLE else outcome.without_samples())
                yield outcome
                meanwhile()

        write_outcomes(self.results_path, about, passed_on(), len(cases) * self._bytes_per_case())
        return replace(about, outcomes=tuple(kept))

    def log(self, event: str, **facts: object) -> None:
        """Add a line to the log, with the time and the host.

        Raises
        ------
        ResumableError
            when the system refuses.
        """
        line = json.dumps({"time": time.time(), "host": socket.gethostname(), "event": event, **facts}, default=str)
        content = (line + "\n").encode("ascii")
        with told_as_sentence(self.log_path, len(content)):
            descriptor = os.open(self.log_path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o666)
            try:
                if (size := os.fstat(descriptor).st_size) and os.pread(descriptor, 1, size - 1) != b"\n":
                    content = b"\n" + content  # the last writer was killed within a line
                os.write(descriptor, content)
            finally:
                os.close(descriptor)

    def _settle(self) -> None:
        """Keep the study, see what is there, clear away what killed writers left."""
        study_path = self.path / "study.yaml"
        content = self._text.encode("utf-8", "surrogateescape")
        if not study_path.is_file() or study_path.read_bytes() != content:
            write_durably(study_path, content)
        make_directory(self._cases)
        inventory = take_inventory(self._cases)
        self._inventory = dict(inventory.paths)
        for leftover in (*inventory.leftovers, *self.path.glob(".tmp-*")):
            with contextlib.suppress(OSError):
                leftover.unlink()
        if inventory.leftovers:
            self.notes.append(f"removed {len(inventory.leftovers)} unfinished files of a run that was killed")
        if inventory.foreign:
            self.notes.append(f"left alone {len(inventory.foreign)} files in {self._cases} that are not magbear's")

    def _is_answered(self, case: Case, reasons: Counter[str]) -> bool:
        chosen = self._chosen(case, reasons)
        if chosen is None:
            return False
        status = chosen[1].status
        if not status.is_answer:
            reasons[f"ended as {status.value} before, will be tried again"] += 1
        return status.is_answer

    def _chosen(self, case: Case, reasons: Counter[str], *, is_patient: bool = True) -> tuple[Path, ShardHead] | None:
        """The shard of a case: this toolchain's answer, else another's if that is accepted, else a failure, or None.

        What the system does not give is taken for damaged, by a patient reader.
        """
        failure, other, excuses = None, None, []
        for path in self._inventory.get(case.id, ()):
            try:
                head = read_head(path)
            except DamagedShardError as error:
                if isinstance(error, UnreadableShardError) and not is_patient:
                    raise
                excuses.append("stored and damaged, will be computed again")
                continue
            if head.toolchain.fingerprint != self.toolchain.fingerprint:
                change = self.toolchain.differences(head.toolchain)
                if self.is_mixed_accepted and head.status.is_answer:
                    other = path, head
                    excuses.append(f"computed by another toolchain ({change}), taken all the same")
                else:
                    excuses.append(
                        f"computed by another toolchain ({change}), will be computed again "
                        "(--accept-mixed takes it as it is)"
                    )
            elif head.status.is_answer:
                return path, head
            else:
                failure = path, head
        if failure is None:
            reasons.update(excuses[:1])
        return other or failure

    def _origin(self, cases: Iterable[Case]) -> dict[str, str]:
        """What computed the cases; other toolchains that were let in are named."""
        mixed: Counter[str] = Counter()
        if self.is_mixed_accepted:
            chosen = (self._chosen(case, Counter()) for case in cases)
            mixed.update(self.toolchain.differences(head.toolchain) for _, head in filter(None, chosen))
        told = "; ".join(f"{count_of(count)}: {change}" for change, count in sorted(mixed.items()) if change)
        return provenance(self.toolchain) | ({"computed_by_other_toolchains": told} if told else {})

    def _bytes_per_case(self) -> int:
        """The size of a stored case here, or an estimate before there is one."""
        for paths in self._inventory.values():
            with contextlib.suppress(OSError):
                return max(path.stat().st_size for path in paths)
        return CASE_ESTIMATE_BYTES


def count_of(cases: int) -> str:
    """So many cases, in words."""
    return f"{cases} case{'' if cases == 1 else 's'}"

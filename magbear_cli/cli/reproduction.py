"""Many studies computed as one run, each into a directory of its own: what ``reproduce`` stands on."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from magbear_cli.cli.output import tell
from magbear_cli.cli.session import Request, announcement, compute
from magbear_cli.errors import ExitCode
from magbear_cli.library.ending import end_run

if TYPE_CHECKING:
    from magbear_cli.spec import Study
    from magbear_cli.store.run_directory import RunDirectory
    from magbear_cli.study.outcome import CaseOutcome, StudyResults
    from magbear_cli.study.plan import Case


@dataclass(frozen=True)
class _Member:
    """A study with its cases and the directory that keeps them."""

    study: Study
    cases: tuple[Case, ...]
    directory: RunDirectory


@dataclass(frozen=True)
class _Several:
    """Directories that together keep a run: each the cases of its own study."""

    members: Sequence[_Member]

    def keep(self, outcome: CaseOutcome, /) -> None:
        """Store a finished case in the directory of each study that has it."""
        for member in self.members:
            if any(case.id == outcome.case_id for case in member.cases):
                member.directory.keep(outcome)

    def log(self, event: str, **facts: object) -> None:
        """Add a line to the logs: to those of the case's studies, or to all."""
        for member in self.members:
            if "case" not in facts or any(case.id == facts["case"] for case in member.cases):
                member.directory.log(event, **facts)


def compute_studies(
    studies: Mapping[str, Study], output: Path, request: Request
) -> tuple[dict[str, StudyResults], ExitCode]:
    """The results of all studies, what is stored reused; the code tells of a signal that stopped the run.

    A case that stands in two studies is computed once. Each study's ``results.h5`` is in its folder of the output.
    """
    with _opened(studies, output, must_lock=not request.no_lock) as members:
        cases = {case.id: case for member in members for case in member.cases}
        missing: dict[str, Case] = {}
        for member in members:
            wanted = member.cases if request.fresh else member.directory.missing(member.cases)
            missing |= {case.id: case for case in wanted}
            member.directory.reserve(len(wanted))
            for note in member.directory.notes:
                tell(f"note: {member.study.name}: {note}")
        options = _options([member.study for member in members], request)
        tell(f"{len(studies)} stud{'y' if len(studies) == 1 else 'ies'}, "
             f"{announcement(len(cases), len(missing), options.jobs)}")  # fmt: skip
        interrupted = compute(tuple(missing.values()), options, _Several(members), request)
        results = {}
        for name, member in zip(studies, members, strict=True):
            _share(member, members)
            results[name] = end_run(member.study, member.cases, member.directory)
    return results, interrupted


def _share(member: _Member, members: Sequence[_Member]) -> None:
    """Take over the cases that are missing here and stored in another study's directory."""
    for case in member.directory.missing(member.cases):
        for other in members:
            if other is not member and any(known.id == case.id for known in other.cases):
                for outcome in other.directory.outcomes([case]):
                    member.directory.keep(outcome)


@contextmanager
def _opened(studies: Mapping[str, Study], output: Path, *, must_lock: bool) -> Iterator[list[_Member]]:
    """The studies with their directories, locked; what was finished is told of when the run is broken off."""
    from magbear_cli.library.planning import planned_cases
    from magbear_cli.store.run_directory import RunDirectory

    planned = [planned_cases(study) for study in studies.values()]
    with ExitStack() as stack:
        directories = [
            stack.enter_context(RunDirectory(output / name, study.text, must_lock=must_lock))
            for name, study in studies.items()
        ]
        try:
            yield [_Member(*parts) for parts in zip(studies.values(), planned, directories, strict=True)]
        except BaseException as end:
            if not isinstance(end, Exception):
                tell(f"what was finished is stored in {output}; run the same command again to go on")
            raise


def _options(studies: Sequence[Study], request: Request) -> RunnerOptions:
    from magbear_cli.study.runner import RunnerOptions, available_cores

    return RunnerOptions(
        jobs=available_cores() if request.jobs is None else request.jobs,
        timeout_s=max(study.run.timeout_s for study in studies) if request.timeout is None else request.timeout,
        memory_bytes=int(max(study.run.memory_gib for study in studies) * (1 << 30)),
        max_failures=request.max_failures,
        fail_fast=request.fail_fast,
    )


if TYPE_CHECKING:
    from magbear_cli.study.runner import RunnerOptions

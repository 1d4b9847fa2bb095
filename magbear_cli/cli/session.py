"""A run from a legal study to its report: what ``run`` and ``sweep`` do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from magbear_cli.cli.options import usable_directory
from magbear_cli.cli.output import put, put_json, tell
from magbear_cli.errors import ExitCode, InputError

if TYPE_CHECKING:
    from magbear_cli.spec import Study
    from magbear_cli.store.run_directory import RunDirectory
    from magbear_cli.study.events import CaseEnded
    from magbear_cli.study.outcome import CaseOutcome, StudyResults
    from magbear_cli.study.plan import Case
    from magbear_cli.study.runner import RunnerOptions


Present = Callable[["StudyResults", Path, Path, "Request"], ExitCode]  # results, their path, the page's path


class Keeper(Protocol):
    """What keeps finished cases and a log of the run."""

    def keep(self, outcome: CaseOutcome, /) -> None:
        """Store a finished case for good."""

    def log(self, event: str, **facts: object) -> None:
        """Add a line to the log."""


@dataclass(frozen=True)
class Request:
    """The options of ``run`` and ``sweep``."""

    output: Path | None = None
    jobs: int | None = None
    timeout: float | None = None
    only: tuple[str, ...] = ()
    shard: tuple[int, int] | None = None
    fresh: bool = False
    max_failures: int | None = None
    fail_fast: bool = False
    progress: bool | None = None
    as_json: bool = False
    debug: bool = False


def run_session(study: Study, request: Request, present: Present | None = None) -> int:
    """Plan, compute what is missing, store, report, print (as ``present`` does it); the answer is the exit code."""
    from magbear_cli.cli.planning import planned_cases
    from magbear_cli.store.run_directory import RunDirectory

    cases = planned_cases(study)
    asked = _asked(cases, request.only, request.shard)
    options = _limits(study, request)
    output = usable_directory(default_output(study.name, request.shard) if request.output is None else request.output)
    with RunDirectory(output, study.text) as directory:
        try:
            return _work(study, (cases, asked), options, directory, (request, present or _present))
        except BaseException as end:
            if not isinstance(end, Exception):
                tell(f"what was finished is stored in {output}; run the same command again to go on")
            raise


def _work(
    study: Study,
    planned: tuple[tuple[Case, ...], tuple[Case, ...]],
    options: RunnerOptions,
    directory: RunDirectory,
    wishes: tuple[Request, Present],
) -> ExitCode:
    """What happens in the locked directory, to the table on the terminal."""
    (cases, asked), (request, present) = planned, wishes
    missing = asked if request.fresh else directory.missing(asked)
    for note in directory.notes:
        tell(f"note: {note}")
    directory.reserve(len(missing))
    tell(announcement(len(asked), len(missing), options.jobs))
    interrupted = compute(missing, options, directory, request)
    if interrupted is not ExitCode.DONE:
        results = directory.gather(cases, study.name, study.report)
        tell(f"interrupted: {len(results.outcomes)} of {len(cases)} cases are stored in {directory.path}")
        tell(f"run the same command again to go on; magbear report {directory.path} draws what is there")
        return interrupted
    return conclude(study, (cases, asked), directory, request, present)


def conclude(
    study: Study,
    planned: tuple[tuple[Case, ...], tuple[Case, ...]],
    directory: RunDirectory,
    request: Request,
    present: Present | None = None,
) -> ExitCode:
    """From what is stored to the results file, the report and what is printed; a case without an answer has a code."""
    cases, asked = planned
    results = directory.gather(cases, study.name, study.report)
    report = _report(results, directory.report_path.parent, request)
    shown = (present or _present)(results, directory.results_path, report, request)
    answered = {outcome.case_id for outcome in results.outcomes if outcome.status.is_answer}
    return shown if all(case.id in answered for case in asked) else ExitCode.SOME_FAILED


def _limits(study: Study, request: Request) -> RunnerOptions:
    from magbear_cli.study.runner import RunnerOptions, available_cores

    return RunnerOptions(
        jobs=available_cores() if request.jobs is None else request.jobs,
        timeout_s=study.run.timeout_s if request.timeout is None else request.timeout,
        memory_bytes=int(study.run.memory_gib * (1 << 30)),
        max_failures=request.max_failures,
        fail_fast=request.fail_fast,
    )


def default_output(name: str, shard: tuple[int, int] | None = None) -> Path:
    """Where a study's run goes when nobody says: a part of it into a directory of its own."""
    return Path("out") / (name if shard is None else f"{name}-{shard[0]}-of-{shard[1]}")


def _asked(cases: tuple[Case, ...], only: Sequence[str], shard: tuple[int, int] | None) -> tuple[Case, ...]:
    """The cases whose identity begins as asked, of the part asked for; all of them without a wish."""
    for wish in only:
        if not wish or not any(case.id.startswith(wish) for case in cases):
            raise InputError(f"--case '{wish}': no case of this study has that identity; magbear plan lists them")
    part, parts = shard or (0, 1)
    return tuple(
        case
        for case in cases
        if case.index % parts == part and (not only or any(case.id.startswith(wish) for wish in only))
    )


def announcement(asked: int, missing: int, jobs: int) -> str:
    """What is about to be computed, in a line."""
    cases = f"{asked} case{'' if asked == 1 else 's'}"
    if not missing:
        return f"{asked} of {cases} reused, nothing to compute"
    at_a_time = f"{min(missing, jobs)} at a time"
    if missing == asked:
        return f"{cases} to compute, {at_a_time}"
    return f"{asked - missing} of {cases} reused, {missing} to compute, {at_a_time}"


def compute(missing: tuple[Case, ...], options: RunnerOptions, directory: Keeper, request: Request) -> ExitCode:
    """Run the missing cases and keep each as it ends; the code tells of a signal that stopped the run."""
    from magbear_cli.cli.progress import open_progress
    from magbear_cli.study.events import CaseEnded, CaseRetried, RunStopped
    from magbear_cli.study.interruption import Interruption
    from magbear_cli.study.runner import run_cases

    directory.log("run began", missing=len(missing), jobs=options.jobs)
    with Interruption() as stop, open_progress(len(missing), wanted=request.progress) as progress:

        def should_stop() -> bool:  # asked ten times a second
            progress.tick()
            return stop()

        for event in run_cases(missing, options, should_stop):
            if isinstance(event, CaseEnded):
                directory.keep(event.outcome)
                directory.log("case ended", **_facts(event))
                progress.ended(event.outcome.status.value)
                if request.debug and event.detail:
                    progress.say(f"{event.outcome.case_id}: {event.outcome.sentence}\n{event.detail}")
            elif isinstance(event, CaseRetried):
                directory.log("case retried", case=event.case.id, sentence=event.sentence, detail=event.detail)
                progress.say(f"{event.case.id}: {event.sentence}; trying once more")
            elif isinstance(event, RunStopped) and stop.signal is None:
                progress.say(f"{event.sentence}, {event.cases_left} not computed")
    directory.log("run ended", signal=None if stop.signal is None else stop.signal.name)
    return stop.exit_code


def _facts(event: CaseEnded) -> dict[str, object]:
    """What the log keeps of a case that ended."""
    outcome = event.outcome
    facts: dict[str, object] = {"case": outcome.case_id, "status": outcome.status.value, "attempts": event.attempts}
    facts["seconds"] = round(event.elapsed_s, 3)
    return facts | {key: text for key, text in (("sentence", outcome.sentence), ("detail", event.detail)) if text}


def _report(results: StudyResults, folder: Path, request: Request) -> Path:
    from magbear_cli.cli.progress import open_activity
    from magbear_cli.report.writing import write_report

    with open_activity("drawing the report", wanted=request.progress) as activity:
        return write_report(results, folder, progress=activity)


def _present(results: StudyResults, results_path: Path, report: Path, request: Request) -> ExitCode:
    """Every case, in a table or as a document."""
    if request.as_json:
        from magbear_cli.study.summary import study_document

        put_json(study_document(results, results_path, report))
        return ExitCode.DONE
    from magbear_cli.cli.tables import study_tables

    put(study_tables(results))
    put(f"results: {results_path}")
    put(f"report:  {report}")
    return ExitCode.DONE

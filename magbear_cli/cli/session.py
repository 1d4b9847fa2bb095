"""A run from a legal study to its report: what ``run`` and ``sweep`` do."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from magbear_cli.cli.early_figures import EarlyFigures
from magbear_cli.cli.event_stream import EventStream, open_events
from magbear_cli.cli.options import usable_directory
from magbear_cli.cli.output import put, put_json, tell
from magbear_cli.errors import ExitCode, InputError
from magbear_cli.library.ending import end_run

if TYPE_CHECKING:
    from magbear_cli.cli.progress import Progress
    from magbear_cli.report.sheet import Print
    from magbear_cli.spec import Study
    from magbear_cli.store.run_directory import RunDirectory
    from magbear_cli.study.chores import Chores
    from magbear_cli.study.events import CaseEnded, Event
    from magbear_cli.study.outcome import CaseOutcome, StudyResults
    from magbear_cli.study.plan import Case
    from magbear_cli.study.runner import RunnerOptions


INTERRUPTED = "interrupted"  # the runner's word for a stop that was asked for

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
    executor: str = "local"
    scheduler: str | None = None
    accept_mixed: bool = False
    no_lock: bool = False
    events: str | None = None
    fresh: bool = False
    max_failures: int | None = None
    fail_fast: bool = False
    progress: bool | None = None
    as_json: bool = False
    debug: bool = False


def run_session(study: Study, request: Request, present: Present | None = None) -> int:
    """Plan, compute what is missing, store, report, print (as ``present`` does it); the answer is the exit code."""
    from magbear_cli.library.planning import planned_cases
    from magbear_cli.store.run_directory import RunDirectory

    refuse_contradictions(request)
    if present is not None and request.events == "-":
        raise InputError("--events - wants standard output, which has the answer here; give --events a file")
    cases = planned_cases(study)
    asked = _asked(cases, request.only, request.shard)
    options = _limits(study, request)
    output = usable_directory(default_output(study.name, request.shard) if request.output is None else request.output)
    with (
        RunDirectory(output, study.text, accept_mixed=request.accept_mixed, must_lock=not request.no_lock) as directory,
        open_events(request.events) as events,
    ):
        try:
            code = _work(study, (cases, asked), options, directory, (request, present or _present, events))
            events.tell("run ended", exit_code=int(code))
        except BaseException as end:
            if not isinstance(end, Exception):
                tell(f"what was finished is stored in {output}; run the same command again to go on")
            raise
    return code


def _work(
    study: Study,
    planned: tuple[tuple[Case, ...], tuple[Case, ...]],
    options: RunnerOptions,
    directory: RunDirectory,
    wishes: tuple[Request, Present, EventStream],
) -> ExitCode:
    """What happens in the locked directory, to the table on the terminal."""
    (cases, asked), (request, present, events) = planned, wishes
    missing = asked if request.fresh else directory.missing(asked)
    for note in directory.notes:
        tell(f"note: {note}")
    directory.reserve(len(missing))
    at_a_time = options.jobs if request.executor == "local" else None
    tell(announcement(len(asked), len(missing), at_a_time))
    events.tell("run began", study=study.name, output=str(directory.path), cases=len(asked), missing=len(missing))
    with EarlyFigures(study, planned, missing, directory, options.jobs) as figures:
        interrupted = compute(missing, options, figures, request, events, figures.chores)
        if interrupted is ExitCode.DONE:
            return conclude(study, planned, directory, request, present, figures)
    results = end_run(study, cases, directory)
    tell(f"interrupted: {len(results.outcomes)} of {len(cases)} cases are stored in {directory.path}")
    tell(f"run the same command again to go on; magbear report {directory.path} draws what is there")
    return interrupted


def conclude(
    study: Study,
    planned: tuple[tuple[Case, ...], tuple[Case, ...]],
    directory: RunDirectory,
    request: Request,
    present: Present | None = None,
    figures: EarlyFigures | None = None,
) -> ExitCode:
    """From what is stored to the results file, the report and what is printed; a case without an answer has a code."""
    cases, asked = planned
    meanwhile = (lambda: None) if figures is None else figures.chores.glance
    results = end_run(study, cases, directory, meanwhile)
    sheets = None if figures is None else figures.sheets(results)
    report = _report(results, directory.report_path.parent, request, sheets)
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


def announcement(asked: int, missing: int, jobs: int | None) -> str:
    """What is about to be computed, in a line; ``jobs`` None: on a cluster."""
    cases = f"{asked} case{'' if asked == 1 else 's'}"
    if not missing:
        return f"{asked} of {cases} reused, nothing to compute"
    at_a_time = "on the cluster" if jobs is None else f"{min(missing, jobs)} at a time"
    if missing == asked:
        return f"{cases} to compute, {at_a_time}"
    return f"{asked - missing} of {cases} reused, {missing} to compute, {at_a_time}"


def compute(
    missing: tuple[Case, ...],
    options: RunnerOptions,
    directory: Keeper,
    request: Request,
    events: EventStream | None = None,
    chores: Chores | None = None,
) -> ExitCode:
    """Run the missing cases and keep each as it ends; the code tells of a signal that stopped the run.

    Workers without a case do ``chores``, which keep the workers.
    """
    from magbear_cli.cli.progress import open_progress
    from magbear_cli.study.interruption import Interruption

    directory.log("run began", missing=len(missing), jobs=options.jobs)
    stream = EventStream(None, is_wanted=False) if events is None else events
    with Interruption() as stop, open_progress(len(missing), wanted=request.progress) as progress:

        def should_stop() -> bool:  # asked ten times a second
            progress.tick()
            return stop()

        for event in _happenings(missing, options, request, should_stop, chores):
            _note(event, directory, progress, stream, request)
    directory.log("run ended", signal=None if stop.signal is None else stop.signal.name)
    return stop.exit_code


def _happenings(
    missing: tuple[Case, ...],
    options: RunnerOptions,
    request: Request,
    should_stop: Callable[[], bool],
    chores: Chores | None,
) -> Iterator[Event]:
    """The events of the cases, computed here or on a cluster."""
    if request.executor == "local" or not missing:
        from magbear_cli.study.runner import run_cases

        return run_cases(missing, options, should_stop, chores if missing else None)
    from magbear_cli.store.toolchain import difference_of, toolchain_text
    from magbear_cli.study.cluster import Cluster, run_on_cluster

    cluster = Cluster(request.scheduler or "", toolchain_text, difference_of)
    return run_on_cluster(missing, options, cluster, should_stop)


def _note(event: Event, directory: Keeper, progress: Progress, stream: EventStream, request: Request) -> None:
    """Keep what came of an event, and tell those who follow the run."""
    from magbear_cli.study.events import CaseEnded, CaseRetried, CaseStarted, RunStopped

    if isinstance(event, CaseStarted):
        stream.tell("case started", case=event.case.id, index=event.case.index, attempt=event.attempt)
    elif isinstance(event, CaseEnded):
        directory.keep(event.outcome)
        directory.log("case ended", **_facts(event))
        stream.tell("case ended", index=event.outcome.index, **_facts(event))
        progress.ended(event.outcome.status.value)
        if request.debug and event.detail:
            progress.say(f"{event.outcome.case_id}: {event.outcome.sentence}\n{event.detail}")
    elif isinstance(event, CaseRetried):
        directory.log("case retried", case=event.case.id, sentence=event.sentence, detail=event.detail)
        stream.tell("case retried", case=event.case.id, index=event.case.index, sentence=event.sentence)
        progress.say(f"{event.case.id}: {event.sentence}; trying once more")
    elif isinstance(event, RunStopped):
        stream.tell("run stopped", sentence=event.sentence, cases_left=event.cases_left)
        if event.sentence != INTERRUPTED:
            progress.say(f"{event.sentence}, {event.cases_left} not computed")


def refuse_contradictions(request: Request) -> None:
    """Refuse options that do not go together.

    Raises
    ------
    InputError
        with the two of them and what to do.
    """
    if request.executor == "dask" and not request.scheduler:
        raise InputError("--executor dask needs --scheduler HOST:PORT, the address that dask scheduler prints")
    if request.executor == "dask" and request.jobs is not None:
        raise InputError("--jobs is for workers on this machine; with --executor dask the cluster has its own")
    if request.executor == "local" and request.scheduler:
        raise InputError("--scheduler is for --executor dask; give both, or neither")
    if request.events == "-" and request.as_json:
        raise InputError("--events - and --json both want standard output; give --events a file")


def _facts(event: CaseEnded) -> dict[str, object]:
    """What the log keeps of a case that ended."""
    outcome = event.outcome
    facts: dict[str, object] = {"case": outcome.case_id, "status": outcome.status.value, "attempts": event.attempts}
    facts["seconds"] = round(event.elapsed_s, 3)
    return facts | {key: text for key, text in (("sentence", outcome.sentence), ("detail", event.detail)) if text}


def _report(results: StudyResults, folder: Path, request: Request, sheets: Iterable[Print] | None) -> Path:
    from magbear_cli.cli.progress import open_activity
    from magbear_cli.report.writing import write_report
    from magbear_cli.study.runner import available_cores

    processes = available_cores() if request.jobs is None else request.jobs
    with open_activity("drawing the report", wanted=request.progress) as activity:
        return write_report(results, folder, processes=processes, sheets=sheets, progress=activity)


def _present(results: StudyResults, results_path: Path, report: Path, request: Request) -> ExitCode:
    """Every case, in a table or as a document; nothing where standard output has the events."""
    if request.events == "-":
        return ExitCode.DONE
    if request.as_json:
        from magbear_cli.study.summary import study_document

        put_json(study_document(results, results_path, report))
        return ExitCode.DONE
    from magbear_cli.cli.tables import study_tables

    put(study_tables(results))
    put(f"results: {results_path}")
    put(f"report:  {report}")
    return ExitCode.DONE

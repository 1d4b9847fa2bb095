"""A run from a legal study to its report: what ``run`` and ``sweep`` do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from magbear_cli.errors import ExitCode, InputError

if TYPE_CHECKING:
    from magbear_cli.spec import Study
    from magbear_cli.store.run_directory import RunDirectory
    from magbear_cli.study.outcome import StudyResults
    from magbear_cli.study.plan import Case
    from magbear_cli.study.runner import RunnerOptions


@dataclass(frozen=True)
class Request:
    """The options of ``run`` and ``sweep``."""

    output: Path | None = None
    jobs: int | None = None
    timeout: float | None = None
    only: tuple[str, ...] = ()
    fresh: bool = False
    max_failures: int | None = None
    fail_fast: bool = False
    progress: bool | None = None
    as_json: bool = False


def run_session(study: Study, request: Request) -> int:
    """Plan, compute what is missing, store, report, print; the answer is the exit code."""
    from magbear_cli.cli.stored import with_stored_controllers
    from magbear_cli.store.results import write_results
    from magbear_cli.store.run_directory import RunDirectory
    from magbear_cli.study.plan import plan_cases

    cases = plan_cases(with_stored_controllers(inputs, study.folder) for inputs in study.cases())
    asked = _asked(cases, request.only)
    options = _limits(study, request)
    output = Path("out") / study.name if request.output is None else request.output
    if output.exists() and not output.is_dir():
        raise InputError(f"{output} is not a directory: give another one with -o")
    with RunDirectory(output, study.text) as directory:
        missing = asked if request.fresh else directory.missing(asked)
        directory.reserve(len(missing))
        for note in directory.notes:
            click.echo(f"note: {note}", err=True)
        _announce(len(asked), len(missing), options.jobs)
        code, sentence = _compute(missing, options, directory, request)
        results = directory.gather(cases, study.name, study.report)
        write_results(directory.results_path, results)
        if code is not ExitCode.DONE:
            click.echo(f"{sentence}; {len(results.outcomes)} of {len(cases)} cases are stored in {output}", err=True)
            click.echo("run it again to go on", err=True)
            return code
        report = _report(results, directory.report_path.parent, request)
    _present(results, directory.results_path, report, request)
    return ExitCode.DONE if all(outcome.status.is_answer for outcome in results.outcomes) else ExitCode.SOME_FAILED


def _limits(study: Study, request: Request) -> RunnerOptions:
    from magbear_cli.study.runner import RunnerOptions, available_cores

    return RunnerOptions(
        jobs=available_cores() if request.jobs is None else request.jobs,
        timeout_s=study.run.timeout_s if request.timeout is None else request.timeout,
        memory_bytes=int(study.run.memory_gib * (1 << 30)),
        max_failures=request.max_failures,
        fail_fast=request.fail_fast,
    )


def _asked(cases: tuple[Case, ...], only: Sequence[str]) -> tuple[Case, ...]:
    """The cases whose identity begins as asked; all of them without a wish."""
    for wish in only:
        if not any(case.id.startswith(wish) for case in cases):
            raise InputError(f"--case {wish}: no case of this study has that identity; magbear plan lists them")
    return tuple(case for case in cases if not only or any(case.id.startswith(wish) for wish in only))


def _announce(asked: int, missing: int, jobs: int) -> None:
    reused = f", {asked - missing} of {asked} reused" if missing < asked else ""
    click.echo(f"{missing} case{'' if missing == 1 else 's'} to compute{reused}, {jobs} at a time", err=True)


def _compute(
    missing: tuple[Case, ...], options: RunnerOptions, directory: RunDirectory, request: Request
) -> tuple[ExitCode, str]:
    """Run the missing cases and keep each as it ends; the code says whether all were given their turn."""
    from magbear_cli.cli.progress import open_progress
    from magbear_cli.study.events import CaseEnded, CaseRetried, RunStopped
    from magbear_cli.study.interruption import Interruption
    from magbear_cli.study.runner import run_cases

    stopped = ""
    with Interruption() as stop, open_progress(len(missing), wanted=request.progress) as progress:
        for event in run_cases(missing, replace(options, jobs=min(options.jobs, max(len(missing), 1))), stop):
            if isinstance(event, CaseEnded):
                directory.keep(event.outcome)
                facts = {"case": event.outcome.case_id, "status": event.outcome.status.value}
                directory.log("case ended", **facts, attempts=event.attempts, seconds=round(event.elapsed_s, 3))
                progress.ended(event.outcome.status.value)
            elif isinstance(event, CaseRetried):
                directory.log("case retried", case=event.case.id, sentence=event.sentence, detail=event.detail)
                progress.say(f"{event.case.id}: {event.sentence}; trying once more")
            elif isinstance(event, RunStopped):
                stopped = event.sentence
    if stop.signal is not None:
        return stop.exit_code, "interrupted"
    if stopped:
        return ExitCode.SOME_FAILED, stopped
    return ExitCode.DONE, ""


def _report(results: StudyResults, folder: Path, request: Request) -> Path:
    from magbear_cli.cli.progress import open_activity
    from magbear_cli.report.writing import write_report

    with open_activity("drawing the report", wanted=request.progress) as activity:
        return write_report(results, folder, progress=activity)


def _present(results: StudyResults, results_path: Path, report: Path, request: Request) -> None:
    if request.as_json:
        import json

        from magbear_cli.study.summary import study_document

        click.echo(json.dumps(study_document(results, results_path, report), indent=2, allow_nan=False))
        return
    from magbear_cli.cli.tables import print_study

    print_study(results)
    click.echo(f"results: {results_path}")
    click.echo(f"report:  {report}")

"""``magbear export``: hand a controller to MATLAB, Octave, Python, firmware or ROSS."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from magbear_cli.cli.options import RESULTS, as_json
from magbear_cli.errors import InputError

if TYPE_CHECKING:
    from magbear_cli.study.outcome import CaseOutcome, StudyResults
    from magbear_cli.study.sampling import SampledDesign, SamplingOptions

FORMATS = ("mat", "json", "c", "python", "ross")
POSITIVE = click.FloatRange(min=0.0, min_open=True)


@click.command()
@click.argument("results", type=RESULTS)
@click.option("--case", "case", metavar="ID", help="The case; its first digits do. Not needed where only one has one.")
@click.option("--format", "form", type=click.Choice(FORMATS), required=True, help="What to write.")
@click.option("-o", "--output", type=RESULTS, default=Path(), help="Directory of the files.  [default: here]")
@click.option("--sample-time", type=POSITIVE, metavar="SECONDS", help="Sample the controller; needed for c.")
@click.option(
    "--delay", type=click.FloatRange(min=0.0), metavar="SECONDS",
    help="From sample to new current.  [default: one sample time]",
)  # fmt: skip
@click.option("--prewarp", type=POSITIVE, metavar="RAD_S", help="Where the sampled response is exact.")
@click.option(
    "--limit", type=POSITIVE, metavar="LEVEL",
    help="Largest worst case of the sampled loop.  [default: 1, or a tenth above the loop's own]",
)  # fmt: skip
@click.option("--name", help="Name of the controller and its files.  [default: STUDY_CASE]")
@as_json
def export(  # noqa: PLR0913, PLR0917 - click hands the options over by name
    results: Path,
    case: str | None,
    form: str,
    output: Path,
    sample_time: float | None,
    delay: float | None,
    prewarp: float | None,
    limit: float | None,
    name: str | None,
    *,
    as_json: bool,
) -> None:
    """Write a controller of RESULTS for other tools; print the files.

    RESULTS is a results.h5, or the directory of a run.

    With --sample-time it is sampled by Tustin's rule and its loop verified anew, with the plant held between samples
    and the delay in it; what that costs is told. A sampling that is too slow is refused with the slowest that would do.

    \b
    Example:  magbear export out/quickstart --case 3f0a --format c --sample-time 2e-5 -o firmware
    """
    from magbear_cli.cli.options import usable_directory
    from magbear_cli.cli.output import put, put_json, tell
    from magbear_cli.export.handover import Handover, identifier
    from magbear_cli.export.writing import write_export
    from magbear_cli.library.stored import results_file
    from magbear_cli.store.results import read_results

    study = read_results(results_file(results), only=() if case is None else (case,))
    outcome = _chosen(study, case)
    directory = usable_directory(output)
    own = identifier(name or f"{study.name}_{outcome.case_id[:7]}")
    sampled = _sampled(outcome, _sampling(form, sample_time, delay, prewarp, limit))
    if outcome.controller is None:
        raise InputError(f"case {outcome.case_id} has no linear controller")
    if not outcome.summary.verified:
        tell(f"note: this case is {outcome.status.value}, not verified: {outcome.sentence}")
    files = write_export(Handover(own, study.name, outcome, outcome.controller, sampled), form, directory)
    if sampled is not None:
        for line in _losses(outcome, sampled):
            tell(line)
    if as_json:
        judged = None if sampled is None else sampled.document()
        put_json({"case": outcome.case_id, "name": own, "files": [str(path) for path in files], "sampled": judged})
        return
    for path in files:
        put(str(path))


def _chosen(study: StudyResults, case: str | None) -> CaseOutcome:
    """The case that is meant."""
    holders = {outcome.case_id: outcome for outcome in study.outcomes if outcome.controller is not None}
    if len(holders) == 1 and case != "":
        return next(iter(holders.values()))
    known = ", ".join(f"{key[:7]} ({own.method}, order {own.summary.order})" for key, own in list(holders.items())[:8])
    wish = "name one with --case" if case is None else f"--case '{case}' is no single case; magbear show lists them"
    raise InputError(f"{wish}; cases with a controller{'' if case is None else ' among those'}: {known or 'none'}")


def _sampling(
    form: str, sample_time: float | None, delay: float | None, prewarp: float | None, limit: float | None
) -> SamplingOptions | None:
    from magbear_cli.study.sampling import SamplingOptions

    if sample_time is not None:
        return SamplingOptions(sample_time, delay, prewarp or 0.0, limit)
    if form == "c":
        raise InputError("C code runs at a fixed rate: give --sample-time SECONDS")
    if not (delay is None and prewarp is None and limit is None):
        raise InputError("--delay, --prewarp and --limit say how to sample: give --sample-time too")
    return None


def _sampled(outcome: CaseOutcome, options: SamplingOptions | None) -> SampledDesign | None:
    """The sampled controller, if that was asked for.

    Raises
    ------
    InputError
        when its loop does not hold, with the slowest sampling that would do.
    """
    from magbear_cli.errors import NumericsError
    from magbear_cli.study.sampling import sample_design, slowest_sample_time

    if options is None:
        return None
    try:
        sampled = sample_design(outcome, options)
    except NumericsError as error:
        raise InputError(str(error)) from error
    if sampled.is_accepted:
        return sampled
    slowest = slowest_sample_time(outcome, options)
    late = "a delay of one sample" if options.delay_s is None else f"a delay of {options.delay_s:g} s"
    would_do = f"{slowest:g} s would do" if slowest is not None else "no faster one was found that would do"
    raise InputError(
        f"sampling every {options.sample_time_s:g} s with {late} is too slow: {sampled.sentence}; {would_do}"
    )


def _losses(outcome: CaseOutcome, sampled: SampledDesign) -> list[str]:
    """What the controller had in continuous time, and what is left of it."""
    had, left = outcome.summary, sampled.document()
    lines = [
        f"sampled every {sampled.sampling.sample_time_s:g} s, delay {sampled.sampling.delay_s:g} s: {sampled.sentence}"
    ]
    for words, key, unit in (
        ("worst case", "worst_case", ""),
        ("gain may fall to", "gain_margin_low", ""),
        ("gain may rise to", "gain_margin_high", ""),
        ("phase margin", "phase_margin_deg", " deg"),
        ("disk margin", "disk_margin", ""),
    ):
        before, after = getattr(had, key), left[key]
        lines.append(f"  {words:<17} {_told(before)}{unit} -> {_told(after)}{unit}")
    return lines


def _told(value: float | None) -> str:
    return "no end" if value is None or value == float("inf") else f"{value:.4g}"

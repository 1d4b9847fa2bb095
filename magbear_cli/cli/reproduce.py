"""``magbear reproduce``: recompute what the thesis claims."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from magbear_cli.cli.options import as_json, no_lock, overrides, usable_directory
from magbear_cli.errors import ExitCode, InputError

if TYPE_CHECKING:
    from magbear_cli.cli.session import Request
    from magbear_cli.spec import Study
    from magbear_cli.spec.thesis import ClaimEntry
    from magbear_cli.study.outcome import StudyResults

DEFAULT_OUTPUT = Path("out") / "reproduce"


@click.command()
@click.argument("ids", nargs=-1, metavar="[ID]...")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help=f"Directory of the ledger.  [default: {DEFAULT_OUTPUT}]"
)
@click.option("-j", "--jobs", type=int, help="Worker processes.  [default: usable cores]")
@click.option("--timeout", type=float, metavar="SECONDS", help="Limit of one case, above the studies' own.")
@click.option("--fresh", is_flag=True, help="Compute every case again, stored or not.")
@no_lock
@click.option("--figures/--no-figures", default=True, help="Draw the counterparts of the thesis's figures.")
@click.option("--progress/--no-progress", default=None, help="Show progress.  [default: on a terminal]")
@overrides
@as_json
@click.option("--debug", is_flag=True, help="Show the traceback of an error, and of a failed case.")
def reproduce(ids: tuple[str, ...], overrides: tuple[str, ...], **wishes: Any) -> int:  # noqa: ANN401 - click's
    """Recompute the claims of the 1997 thesis and print the ledger.

    The studies behind the claims run, each into its own directory below the output; what is stored is reused. Every
    claim is judged by the numbers stored there, and the ledger is printed and written as a page with the figures. IDs
    such as C17 choose claims; without them all are judged. --set changes every study, to see which verdicts hang on it.

    \b
    Example:  magbear reproduce C17 C18 C19 -o out/limits-of-the-thesis
    """
    from magbear_cli.claims.judging import studies_needed
    from magbear_cli.cli.reproduction import compute_studies
    from magbear_cli.cli.session import Request
    from magbear_cli.spec.thesis import read_claims, read_comparison

    draws = wishes.pop("figures")
    claims = _chosen(read_claims(), ids)
    compared = () if ids else tuple(str(where["study"]) for where in read_comparison())
    studies = _studies(tuple(dict.fromkeys((*studies_needed(claims), *compared))), overrides)
    output = usable_directory(wishes.pop("output") or DEFAULT_OUTPUT)
    request = Request(output=output, **wishes)
    results, interrupted = compute_studies(studies, output, request)
    if interrupted is not ExitCode.DONE:
        return interrupted
    return _concluded(claims, results, request, draws=draws)


def _chosen(claims: Sequence[ClaimEntry], ids: Sequence[str]) -> tuple[ClaimEntry, ...]:
    """The claims asked for, in the order of the ledger; all of them without a wish."""
    known = {claim.id: claim for claim in claims}
    for wish in ids:
        if wish.upper() not in known:
            raise InputError(f"there is no claim '{wish}': there are {claims[0].id} to {claims[-1].id}")
    wanted = {wish.upper() for wish in ids} or set(known)
    return tuple(claim for claim in claims if claim.id in wanted)


def _studies(names: Sequence[str], overrides: Sequence[str]) -> dict[str, Study]:
    from magbear_cli.spec import read_study
    from magbear_cli.spec.thesis import thesis_study

    return {name: read_study(thesis_study(name), overrides) for name in names}


def _concluded(
    claims: Sequence[ClaimEntry], results: dict[str, StudyResults], request: Request, *, draws: bool
) -> ExitCode:
    """Judge, write the page, print the ledger."""
    from magbear_cli.claims.comparison import compare
    from magbear_cli.claims.judging import judge_claims
    from magbear_cli.claims.ledger import Verdict
    from magbear_cli.cli.output import put, put_json
    from magbear_cli.cli.progress import open_activity
    from magbear_cli.report.writing import write_ledger
    from magbear_cli.spec.thesis import read_comparison, read_figures

    judged = judge_claims(claims, results)
    comparison = compare(read_comparison(), results)
    figures = [entry for entry in read_figures() if entry.studies <= set(results)] if draws else []
    with open_activity("drawing the figures", wanted=request.progress) as activity:
        page = write_ledger(judged, comparison, figures, results, request.output or DEFAULT_OUTPUT, progress=activity)
    if request.as_json:
        beside = {} if comparison is None else {"comparison": comparison.document()}
        put_json({"claims": [claim.document() for claim in judged], **beside, "page": str(page)})
    else:
        from magbear_cli.cli.tables import ledger_table

        put(ledger_table(judged))
        if comparison is not None:
            put(f"When is adaptive control needed? {comparison.sentence}")
        put(f"page: {page}")
    is_whole = all(claim.finding.verdict is not Verdict.NOT_EVALUATED for claim in judged)
    return ExitCode.DONE if is_whole else ExitCode.SOME_FAILED

"""``magbear limits``: where linear control ends, proven from both sides."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from magbear_cli.cli.options import RESULTS, STUDY, running
from magbear_cli.errors import ExitCode, InputError

if TYPE_CHECKING:
    from magbear_cli.cli.session import Request
    from magbear_cli.spec import Study
    from magbear_cli.study.limit_curves import Comparison
    from magbear_cli.study.outcome import StudyResults

DEFAULT_TOLERANCE = 0.01


@click.command()
@click.argument("study", type=STUDY, required=False)
@click.option(
    "--mass", "masses", multiple=True, metavar="LOW:HIGH", help="A range of masses in kg, or one. Repeatable."
)
@click.option(
    "--over",
    multiple=True,
    metavar="KEY[=GRID]",
    help="Another key to draw the limit over: LOW:HIGH:N, a,b,c, or the study's own sweep of it. Repeatable.",
)
@click.option(
    "--tol", type=click.FloatRange(1e-3, 0.5), help=f"Relative width of the brackets.  [default: {DEFAULT_TOLERANCE}]"
)
@click.option("--check", type=RESULTS, metavar="BASELINE", help="Compare with stored curves; exit 1 if one moved.")
@click.option("--summary", type=RESULTS, metavar="FILE", help="Add what --check found to this file, in Markdown.")
@running
def limits(  # noqa: PLR0913, PLR0917 - click hands them over by name
    study: Path | None,
    masses: tuple[str, ...],
    over: tuple[str, ...],
    tol: float | None,
    check: Path | None,
    summary: Path | None,
    overrides: tuple[str, ...],
    **request: Any,  # noqa: ANN401 - click hands them over by name
) -> int:
    """Bracket the smallest ω_c that linear control can meet.

    One bracket for each mass range. Above it a controller is proven to meet the specification for every mass and every
    frequency; below it a checked certificate proves that no linear controller does. Without STUDY, for the thesis's
    thrust bearing. The study's own bandwidth limits, controllers, reductions, simulations and figures do not matter
    here.

    A BASELINE is what --json printed before. A curve has moved when one of its sides differs by more than --tol. Curves
    of the baseline that were not asked for with --mass do not count.

    \b
    Example:  magbear limits --mass 3.0:3.5 --mass 3.0:4.5
              magbear limits --mass 3.0:4.5 --over performance.corner_rad_s=50:400:4
    """
    from magbear_cli.cli.session import Request, run_session
    from magbear_cli.spec import compile_limits, parse_mass, read_study, read_study_text
    from magbear_cli.study.limit_curves import compare_curves

    if summary is not None and check is None:
        raise InputError("--summary tells what --check found: give --check BASELINE too")
    baseline = None if check is None else _baseline(check)
    base = None if study is None else read_study(study, for_limits=True)
    text = compile_limits(
        [parse_mass(mass) for mass in masses],
        over,
        tol,
        None if base is None else base.text,
        None if base is None else base.folder,
    )
    compiled = read_study_text(text, "the limits", overrides)

    def present(results: StudyResults, results_path: Path, report: Path, request: Request) -> ExitCode:
        curves = _curves(compiled, results)
        _show(curves, results_path, report, as_json=request.as_json)
        if check is None:
            return ExitCode.DONE
        found = compare_curves(curves, baseline, tol or DEFAULT_TOLERANCE, is_part=bool(masses))
        _tell(found, check, summary)
        return ExitCode.DIFFERENCE if found.moved else ExitCode.DONE

    return run_session(compiled, Request(**request), present)


def _baseline(path: Path) -> object:
    """The document of a baseline, read before anything is computed."""
    import json

    from magbear_cli.study.limit_curves import compare_curves

    try:
        document = json.loads(path.read_text("utf-8"))
        compare_curves([], document, 0.0)
    except OSError as error:
        raise InputError(f"--check {path}: it cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"--check {path}: this is not JSON: {error}") from error
    except InputError as error:
        raise InputError(f"--check {path}: {error}") from error
    return document


def _curves(study: Study, results: StudyResults) -> list[dict[str, Any]]:
    """The brackets in the order of the study, each with what is swept beside the mass."""
    from itertools import product

    from magbear_cli.study.limit_curves import curve_document

    keys = list(study.sweep)
    rows = [dict(zip(keys, values, strict=True)) for values in product(*study.sweep.values())]
    return [
        curve_document(outcome, {key: value for key, value in rows[outcome.index].items() if key != "mass_kg"})
        for outcome in results.outcomes
    ]


def _show(curves: list[dict[str, Any]], results_path: Path, report: Path, *, as_json: bool) -> None:
    from magbear_cli.cli.output import put, put_json
    from magbear_cli.study.limit_curves import curve_line

    if as_json:
        put_json({"curves": curves, "results": str(results_path), "report": str(report)})
        return
    for curve in curves:
        put(curve_line(curve))
    put(f"results: {results_path}")
    put(f"report:  {report}")


def _tell(found: Comparison, path: Path, summary: Path | None) -> None:
    """The differences on standard error, and all of the comparison at the end of the summary's file."""
    from magbear_cli.cli.output import tell

    for text in found.moved:
        tell(text)
    count = len(found.moved)
    tell(f"{path}: {count or 'no'} difference{'' if count == 1 else 's'} beyond {100.0 * found.tolerance:g} %")
    if summary is not None:
        try:
            with summary.open("a", encoding="utf-8") as file:
                file.write(found.markdown(str(path)))
        except OSError as error:
            raise InputError(f"--summary {summary}: it cannot be written: {error.strerror}") from error

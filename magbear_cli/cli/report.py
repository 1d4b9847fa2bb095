"""``magbear report``: the page and the figures of a results file, written again."""

from __future__ import annotations

from pathlib import Path

import click

from magbear_cli.cli.options import RESULTS


@click.command()
@click.argument("results", type=RESULTS)
@click.option("-o", "--output", type=RESULTS, help="Directory of the report.  [default: report/ beside the results]")
def report(results: Path, output: Path | None) -> None:
    """Write the report of RESULTS again and print where it is.

    RESULTS is a results.h5, or the directory of a run.

    \b
    Example:  magbear report out/quickstart -o page
    """
    from magbear_cli.cli.options import usable_directory
    from magbear_cli.cli.output import put
    from magbear_cli.cli.progress import open_activity
    from magbear_cli.cli.stored import results_file
    from magbear_cli.report.writing import write_report
    from magbear_cli.store.results import read_results

    path = results_file(results)
    directory = usable_directory(path.parent / "report" if output is None else output)
    study = read_results(path)
    with open_activity("drawing the report", wanted=None) as activity:
        page = write_report(study, directory, progress=activity)
    put(str(page))

"""``magbear report``: the page and the figures of a results file, written again."""

from __future__ import annotations

from pathlib import Path

import click

from magbear_cli.cli.options import RESULTS


@click.command()
@click.argument("results", type=RESULTS)
@click.option("-o", "--output", type=RESULTS, help="Directory of the report.  [default: report/ beside the results]")
@click.option("--case", "only", multiple=True, metavar="ID", help="Report this case alone, beside it. Repeatable.")
def report(results: Path, output: Path | None, only: tuple[str, ...]) -> None:
    """Write the report of RESULTS again and print where it is.

    RESULTS is a results.h5, or the directory of a run. A study of many cases has figures of its first ones; --case
    writes a report of the cases whose identity begins so, by itself into the directory report-ID.

    \b
    Example:  magbear report out/quickstart -o page
              magbear report out/quickstart --case 3fa2
    """
    from magbear_cli.cli.options import usable_directory
    from magbear_cli.cli.output import put
    from magbear_cli.cli.progress import open_activity
    from magbear_cli.errors import InputError
    from magbear_cli.library.stored import results_file
    from magbear_cli.report.writing import write_report
    from magbear_cli.store.results import read_results
    from magbear_cli.store.run_directory import MOST_WHOLE
    from magbear_cli.study.runner import available_cores

    path = results_file(results)
    name = "-".join(["report", *only])
    directory = usable_directory(path.parent / name if output is None else output)
    study = read_results(path, MOST_WHOLE, only)
    if only and not study.outcomes:
        raise InputError(f"--case '{only[0]}': no case of {path} has that identity; magbear show lists them")
    with open_activity("drawing the report", wanted=None) as activity:
        page = write_report(study, directory, processes=available_cores(), progress=activity)
    put(str(page))

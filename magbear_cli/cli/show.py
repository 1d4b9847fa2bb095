"""``magbear show``: the table of a results file."""

from __future__ import annotations

from pathlib import Path

import click

from magbear_cli.cli.options import RESULTS, as_json


@click.command()
@click.argument("results", type=RESULTS)
@as_json
def show(results: Path, *, as_json: bool) -> None:
    """Print the cases of RESULTS (a results.h5 or its directory).

    \b
    Example:  magbear show out/quickstart
    """
    from magbear_cli.cli.output import put, put_json
    from magbear_cli.library.stored import results_file
    from magbear_cli.store.results import read_results

    path = results_file(results)
    study = read_results(path, 0)
    if as_json:
        from magbear_cli.study.summary import study_document

        page = path.parent / "report" / "index.html"
        put_json(study_document(study, path, page if page.exists() else None))
        return
    from magbear_cli.cli.tables import study_tables

    put(study_tables(study))

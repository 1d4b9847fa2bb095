"""``magbear compare``: whether two results files say the same."""

from __future__ import annotations

from pathlib import Path

import click

from magbear_cli.cli.options import RESULTS, as_json
from magbear_cli.errors import ExitCode


@click.command()
@click.argument("first", type=RESULTS)
@click.argument("second", type=RESULTS)
@click.option("--rtol", default=1e-6, show_default=True, type=click.FloatRange(min=0), help="Relative tolerance.")
@as_json
def compare(first: Path, second: Path, rtol: float, *, as_json: bool) -> int:
    """List where FIRST and SECOND (results.h5 files or run directories) differ beyond a tolerance; exit 1 if they do.

    \b
    Example:  magbear compare out/before out/after --rtol 1e-3
    """
    import json

    from magbear_cli.cli.stored import results_file
    from magbear_cli.store.results import read_results
    from magbear_cli.study.comparison import compare_studies

    found = compare_studies(read_results(results_file(first)), read_results(results_file(second)), rtol)
    if as_json:
        listed = [difference.document() for difference in found]
        click.echo(
            json.dumps({"first": str(first), "second": str(second), "rtol": rtol, "differences": listed}, indent=2)
        )
    else:
        for difference in found:
            click.echo(str(difference))
        count = len(found)
        click.echo(f"{count} difference{'' if count == 1 else 's'} beyond a relative {rtol:g}", err=True)
    return ExitCode.DIFFERENCE if found else ExitCode.DONE

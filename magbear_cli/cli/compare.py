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
    """List where two results differ beyond a tolerance; exit 1 if so.

    FIRST and SECOND are results.h5 files or directories of runs. Cases are matched by method and options, masses and
    bandwidth limit; a case that only one of them has is a difference.

    \b
    Example:  magbear compare out/before out/after --rtol 1e-3
    """
    from magbear_cli.cli.output import put, put_json, tell
    from magbear_cli.library.stored import results_file
    from magbear_cli.store.results import read_results
    from magbear_cli.study.comparison import compare_studies

    found = compare_studies(read_results(results_file(first)), read_results(results_file(second)), rtol)
    if as_json:
        differences = [difference.document() for difference in found]
        put_json({"first": str(first), "second": str(second), "rtol": rtol, "differences": differences})
    else:
        for difference in found:
            put(str(difference))
    tell(f"{len(found)} difference{'' if len(found) == 1 else 's'} beyond a relative {rtol:g}")
    return ExitCode.DIFFERENCE if found else ExitCode.DONE

"""``magbear verify``: check the stored proofs again, from the stored numbers alone."""

from __future__ import annotations

from pathlib import Path

import click

from magbear_cli.cli.options import RESULTS, as_json
from magbear_cli.errors import ExitCode


@click.command()
@click.argument("results", type=RESULTS)
@as_json
def verify(results: Path, *, as_json: bool) -> int:
    """Prove again what RESULTS claims; exit 1 if a proof fails.

    Nothing is designed: each controller is proven to meet its level for every mass and frequency, and each certificate
    of impossibility is checked, both from the matrices and coefficients in the file. RESULTS is a results.h5 file or
    the directory of a run.

    \b
    Example:  magbear verify out/limits
    """
    from magbear_cli.cli.output import put, put_json, tell
    from magbear_cli.library.stored import results_file
    from magbear_cli.store.results import read_results
    from magbear_cli.study.checking import check_proofs

    checks = [check for outcome in read_results(results_file(results)).outcomes for check in check_proofs(outcome)]
    if as_json:
        put_json({"results": str(results), "proofs": [check.document() for check in checks]})
    else:
        for check in checks:
            put(str(check))
    failed = sum(not check.holds for check in checks)
    tell(f"{len(checks)} proof{'' if len(checks) == 1 else 's'} checked, {failed or 'none'} failed")
    return ExitCode.DIFFERENCE if failed else ExitCode.DONE

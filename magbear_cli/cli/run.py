"""``magbear run``: compute a study."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from magbear_cli.cli.options import STUDY, running


@click.command()
@click.argument("study", type=STUDY)
@running
def run(study: Path, overrides: tuple[str, ...], **request: Any) -> int:  # noqa: ANN401 - click hands them over by name
    """Compute a STUDY and write its results and report.

    The cases are planned, what is stored is skipped, the others run, and each is stored as it ends. Running again goes
    on where the last run stopped; a changed study reuses the cases that did not change. STUDY may be - for standard
    input.

    \b
    Example:  magbear run study.yaml --set bandwidth.omega_c_rad_s=15000 -o out/wide
    """
    from magbear_cli.cli.session import Request, run_session
    from magbear_cli.spec import read_study

    return run_session(read_study(study, overrides), Request(**request))

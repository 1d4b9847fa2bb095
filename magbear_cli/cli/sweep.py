"""``magbear sweep``: compute a grid given on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from magbear_cli.cli.options import STUDY, running


@click.command()
@click.argument("study", type=STUDY, required=False)
@click.option("--wc", metavar="GRID", help="Bandwidth limits in rad/s: LOW:HIGH:N (log-spaced) or a,b,c.")
@click.option(
    "--mass", "masses", multiple=True, metavar="LOW:HIGH", help="A range of masses in kg, or one. Repeatable."
)
@click.option("--method", "methods", multiple=True, metavar="METHOD", help="A synthesis method. Repeatable.")
@running
def sweep(
    study: Path | None,
    wc: str | None,
    masses: tuple[str, ...],
    methods: tuple[str, ...],
    overrides: tuple[str, ...],
    **request: Any,  # noqa: ANN401 - click hands them over by name
) -> int:
    """Compute a grid of bandwidth limits, masses and methods.

    What is not given is taken from STUDY; without STUDY the bearing is the thesis's thrust bearing. The sweep is saved
    as study.yaml in the output directory, so it can be run again.

    \b
    Example:  magbear sweep --wc 5000:20000:8 --mass 3.0:4.5 --mass 3.0:4.0 --method mu_convex
    """
    from magbear_cli.cli.session import Request, run_session
    from magbear_cli.spec import compile_sweep, parse_grid, parse_mass, read_study, read_study_text

    base = None if study is None else read_study(study)
    text = compile_sweep(
        [] if wc is None else parse_grid(wc),
        [parse_mass(mass) for mass in masses],
        methods,
        None if base is None else base.text,
        None if base is None else base.folder,
    )
    return run_session(read_study_text(text, "the sweep", overrides), Request(**request))

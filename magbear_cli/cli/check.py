"""``magbear check``: whether a study is legal."""

from __future__ import annotations

from pathlib import Path

import click

from magbear_cli.cli.options import STUDY, overrides


@click.command()
@click.argument("study", type=STUDY)
@overrides
def check(study: Path, overrides: tuple[str, ...]) -> None:
    """Say whether a STUDY (a file, or - for standard input) is legal.

    Every mistake is told at once, each with its line, key and remedy; exit 2 if there is one.

    \b
    Example:  magbear check study.yaml
    """
    from magbear_cli.cli.output import put
    from magbear_cli.library.planning import planned_cases
    from magbear_cli.spec import read_study

    read = read_study(study, overrides)
    count = len(planned_cases(read))
    put(f"{read.source}: legal, {count} case{'' if count == 1 else 's'}")

"""``magbear check``: whether a study is legal."""

from __future__ import annotations

from pathlib import Path

import click

from magbear_cli.cli.options import STUDY, overrides


@click.command()
@click.argument("study", type=STUDY)
@overrides
def check(study: Path, overrides: tuple[str, ...]) -> None:
    """Say whether a STUDY is legal: every mistake at once, each with its line, key and remedy.

    \b
    Example:  magbear check study.yaml
    """
    from magbear_cli.spec import read_study

    read = read_study(study, overrides)
    count = read.case_count
    click.echo(f"{read.source}: legal, {count} case{'' if count == 1 else 's'}")

"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])

STUDY = click.Path(path_type=Path, allow_dash=True)
RESULTS = click.Path(path_type=Path)


def overrides(command: Command) -> Command:
    """``--set KEY=VALUE``, repeatable."""
    return click.option(
        "--set", "overrides", multiple=True, metavar="KEY=VALUE",
        help="Set a dotted key of the study, e.g. bandwidth.omega_c_rad_s=15000. Repeatable.",
    )(command)  # fmt: skip


def as_json(command: Command) -> Command:
    """``--json``."""
    return click.option("--json", "as_json", is_flag=True, help="Print one JSON document and nothing else.")(command)


def running(command: Command) -> Command:
    """All that ``run`` and ``sweep`` have in common."""
    for option in reversed(
        [
            click.option("-o", "--output", type=RESULTS, help="Directory of the run.  [default: out/STUDY_NAME]"),
            click.option("-j", "--jobs", type=int, help="Worker processes.  [default: usable cores]"),
            click.option("--timeout", type=float, metavar="SECONDS", help="Limit of one case, above the study's own."),
            click.option("--case", "only", multiple=True, metavar="ID", help="Only this case. Repeatable."),
            click.option("--fresh", is_flag=True, help="Compute every case again, stored or not."),
            click.option("--max-failures", type=click.IntRange(min=1), metavar="N", help="Stop after N failed cases."),
            click.option("--fail-fast", is_flag=True, help="Stop at the first failed case."),
            click.option("--progress/--no-progress", default=None, help="Show progress.  [default: on a terminal]"),
            overrides,
            as_json,
        ]
    ):
        command = option(command)
    return command

"""Options that several commands share, and what is asked of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from magbear_cli.errors import InputError

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


def no_lock(command: Command) -> Command:
    """``--no-lock``."""
    return click.option(
        "--no-lock", is_flag=True,
        help="Run also where the file system cannot lock: see to it that no other run works in the directory.",
    )(command)  # fmt: skip


def running(command: Command) -> Command:
    """All that ``run`` and ``sweep`` have in common."""
    for option in reversed(
        [
            overrides,
            click.option("-o", "--output", type=RESULTS, help="Directory of the run.  [default: out/STUDY_NAME]"),
            click.option("-j", "--jobs", type=int, help="Worker processes.  [default: usable cores]"),
            click.option("--timeout", type=float, metavar="SECONDS", help="Limit of one case, above the study's own."),
            click.option("--case", "only", multiple=True, metavar="ID", help="Compute only this case. Repeatable."),
            click.option(
                "--shard", callback=_part, metavar="I/N", help="Compute every N-th case, from the I-th (0, 1, …)."
            ),
            click.option(
                "--executor",
                type=click.Choice(["local", "dask"]),
                default="local",
                show_default=True,
                help="Compute here, or on the machines of a Dask cluster.",
            ),
            click.option("--scheduler", metavar="HOST:PORT", help="The scheduler of that cluster."),
            click.option(
                "--accept-mixed", is_flag=True, help="Take stored cases of another toolchain; the results name it."
            ),
            no_lock,
            click.option("--events", metavar="FILE", help="Write what happens as JSON lines; - is standard output."),
            click.option("--fresh", is_flag=True, help="Compute every case again, stored or not."),
            click.option("--max-failures", type=click.IntRange(min=1), metavar="N", help="Stop after N failed cases."),
            click.option("--fail-fast", is_flag=True, help="Stop at the first failed case."),
            click.option("--progress/--no-progress", default=None, help="Show progress.  [default: on a terminal]"),
            as_json,
            click.option("--debug", is_flag=True, help="Show the traceback of an error, and of a failed case."),
        ]
    ):
        command = option(command)
    return command


def _part(_context: click.Context, parameter: click.Parameter, value: str | None) -> tuple[int, int] | None:
    """``I/N`` as two numbers: the I-th of N parts of a study, counted from 0."""
    if value is None:
        return None
    first, _, second = value.partition("/")
    if not (first.isdecimal() and second.isdecimal() and int(first) < int(second)):
        raise click.BadParameter(f"'{value}' is no part: write I/N with I from 0 to N - 1, as 0/3", param=parameter)
    return int(first), int(second)


def usable_directory(path: Path) -> Path:
    """The path, if a directory can stand there.

    Raises
    ------
    InputError
        when a file is in its way, or the system does not take it for a path.
    """
    try:
        standing = next((place for place in (path, *path.parents) if place.exists()), Path())
        in_the_way = not standing.is_dir()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError(f"--output {str(path)[:80]}: {reason}") from error
    if in_the_way:
        raise InputError(f"--output {path}: {standing} is a file, not a directory; choose another one")
    return path

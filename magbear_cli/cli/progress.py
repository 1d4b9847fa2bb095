"""Progress on stderr: a bar on a terminal, a line now and then elsewhere when it is asked for."""

from __future__ import annotations

import os
import sys
import time
from collections import Counter
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Protocol

import click

LINE_EVERY_S = 10.0


class Progress(Protocol):
    """What a run tells of itself."""

    def ended(self, status: str) -> None:
        """A case ended like this."""

    def say(self, sentence: str) -> None:
        """Something the user should know meanwhile."""


def _is_lively() -> bool:
    """Whether stderr can show a bar that moves."""
    return sys.stderr.isatty() and os.environ.get("TERM", "") != "dumb"


class _Quiet:
    """Only what must be said."""

    def ended(self, status: str) -> None:
        """Keep silent."""

    def say(self, sentence: str) -> None:
        """Say it."""
        click.echo(sentence, err=True)


class _Lines(_Quiet):
    """A line every ten seconds, and one at the end."""

    def __init__(self, total: int) -> None:
        self._total, self._counts, self._last = total, Counter[str](), time.monotonic()

    def ended(self, status: str) -> None:
        """Count it."""
        self._counts[status] += 1
        done = self._counts.total()
        if done == self._total or time.monotonic() - self._last >= LINE_EVERY_S:
            self._last = time.monotonic()
            click.echo(f"{done} of {self._total} cases: {_told(self._counts)}", err=True)


def _told(counts: Counter[str]) -> str:
    return ", ".join(f"{count} {status}" for status, count in sorted(counts.items()))


@contextmanager
def open_progress(total: int, *, wanted: bool | None) -> Generator[Progress]:
    """The progress of a run of so many cases; ``wanted`` None shows a bar on a terminal and nothing elsewhere."""
    if wanted is False or total == 0 or (wanted is None and not _is_lively()):
        yield _Quiet()
        return
    if not _is_lively():
        yield _Lines(total)
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (BarColumn(bar_width=24), MofNCompleteColumn(), TextColumn("{task.description}"))
    with Bar(*columns, TimeElapsedColumn(), TimeRemainingColumn(), console=Console(stderr=True)) as bar:
        task, counts = bar.add_task("", total=total), Counter[str]()

        class Lively:
            def ended(self, status: str) -> None:
                counts[status] += 1
                bar.update(task, advance=1, description=_told(counts))

            def say(self, sentence: str) -> None:
                bar.console.print(sentence, markup=False)

        yield Lively()


@contextmanager
def open_activity(what: str, *, wanted: bool | None) -> Generator[Callable[[str], None] | None]:
    """A spinner with the name of what is being done, on a terminal."""
    if wanted is False or not _is_lively():
        yield None
        return
    from rich.console import Console

    with Console(stderr=True).status(what) as status:
        yield lambda name: status.update(f"{what}: {name}")

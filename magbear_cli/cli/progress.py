"""Progress on stderr: a bar on a terminal, a line now and then elsewhere when it is asked for."""

from __future__ import annotations

import os
import sys
import time
from collections import Counter
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Protocol

from magbear_cli.cli.output import tell

LINE_EVERY_S = 10.0


class Progress(Protocol):
    """What a run tells of itself."""

    def ended(self, status: str) -> None:
        """A case ended like this."""

    def say(self, sentence: str) -> None:
        """Something the user should know meanwhile."""

    def tick(self) -> None:
        """Time goes by."""


def _can_animate() -> bool:
    """Whether stderr is a screen on which a bar can move."""
    return sys.stderr.isatty() and os.environ.get("TERM", "") != "dumb"


class Quiet:
    """Only what must be said."""

    def ended(self, status: str) -> None:
        """Keep silent."""

    def say(self, sentence: str) -> None:
        """Say it."""
        tell(sentence)

    def tick(self) -> None:
        """Keep silent."""


class Lines(Quiet):
    """A line every ten seconds, and one at the end."""

    def __init__(self, total: int, clock: Callable[[], float] = time.monotonic) -> None:
        """Count from now."""
        self._total, self._counts, self._clock = total, Counter[str](), clock
        self._last = self._began = clock()

    def ended(self, status: str) -> None:
        """Count it."""
        self._counts[status] += 1
        if self._counts.total() == self._total:
            self._tell()

    def tick(self) -> None:
        """Say how far the run is when nothing was said for a while."""
        if self._clock() - self._last >= LINE_EVERY_S:
            self._tell()

    def _tell(self) -> None:
        self._last = self._clock()
        done, told = self._counts.total(), _told(self._counts)
        pace = _pace(done, self._total, self._last - self._began)
        tell(f"{done} of {self._total} cases{': ' if told else ''}{told}{'; ' if pace else ''}{pace}")


def _told(counts: Counter[str]) -> str:
    return ", ".join(f"{count} {status}" for status, count in sorted(counts.items()))


def _rate(done: int, seconds: float) -> str:
    """How many cases end in a second, a minute or an hour, whichever gives a number to read; empty before the first."""
    if not done or seconds <= 0:
        return ""
    unit_s, unit = next(
        ((size, name) for size, name in ((1.0, "s"), (60.0, "min")) if done * size / seconds >= 1), (3600.0, "h")
    )
    return f"{done * unit_s / seconds:.3g}/{unit}"


def _pace(done: int, total: int, seconds: float) -> str:
    """The rate, and what is left at that rate; empty before the first case and after the last."""
    rate = _rate(done, seconds)
    if not rate or done == total:
        return ""
    left_s = seconds / done * (total - done)
    minutes, hours = left_s / 60.0, left_s / 3600.0
    left = f"{left_s:.0f} s" if minutes < 2 else f"{minutes:.0f} min" if hours < 2 else f"{hours:.1f} h"
    return f"{rate}, {left} left"


@contextmanager
def open_progress(total: int, *, wanted: bool | None) -> Generator[Progress]:
    """The progress of a run of so many cases; ``wanted`` None shows it on a terminal and nowhere else."""
    if total == 0 or wanted is False or (wanted is None and not sys.stderr.isatty()):
        yield Quiet()
    elif _can_animate():
        with _bar(total) as bar:
            yield bar
    else:
        yield Lines(total)


@contextmanager
def _bar(total: int) -> Generator[Progress]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as RichProgress

    columns = (BarColumn(bar_width=24), MofNCompleteColumn(), TextColumn("{task.description} {task.fields[rate]}"))
    times = (TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn())
    with RichProgress(*columns, *times, console=Console(stderr=True)) as rich_progress:
        task, counts = rich_progress.add_task("", total=total, rate=""), Counter[str]()
        began = time.monotonic()

        class Bar:
            def ended(self, status: str) -> None:
                counts[status] += 1
                rate = _rate(counts.total(), time.monotonic() - began)
                rich_progress.update(task, advance=1, description=_told(counts), rate=rate)

            def say(self, sentence: str) -> None:
                rich_progress.console.print(sentence, markup=False, highlight=False)

            def tick(self) -> None:
                """The bar moves by itself."""

        yield Bar()


@contextmanager
def open_activity(what: str, *, wanted: bool | None) -> Generator[Callable[[str], None] | None]:
    """What is being done: a spinner on a terminal, a line elsewhere when progress is asked for."""
    if wanted is False or not _can_animate():
        if wanted:
            tell(what)
        yield None
        return
    from rich.console import Console

    with Console(stderr=True).status(what) as status:
        yield lambda name: status.update(f"{what}: {name}")

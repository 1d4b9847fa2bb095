"""Events of a run as JSON lines, for programs that follow it."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TextIO

from magbear_cli.cli.output import put
from magbear_cli.errors import InputError, ResumableError

SCHEMA = 1  # raised when a key changes its meaning


class EventStream:
    """A stream of events, one JSON object a line, each with ``schema``, ``time`` (s since 1970) and ``event``."""

    def __init__(self, file: TextIO | None, *, is_wanted: bool = True) -> None:
        """Write to this file, or to standard output where there is none."""
        self._file, self._is_wanted = file, is_wanted

    def tell(self, event: str, **facts: object) -> None:
        """Write an event, at once.

        Raises
        ------
        ResumableError
            when the system does not take it.
        """
        if not self._is_wanted:
            return
        line = json.dumps({"schema": SCHEMA, "time": time.time(), "event": event, **facts}, default=str)
        if self._file is None:
            put(line)
            sys.stdout.flush()
            return
        try:
            self._file.write(f"{line}\n")
            self._file.flush()
        except BrokenPipeError:  # its reader has gone; the run goes on
            self._is_wanted = False
        except OSError as error:
            raise ResumableError(f"the events cannot be written: {error.strerror}") from error


@contextmanager
def open_events(target: str | None) -> Iterator[EventStream]:
    """The stream into a file (or a pipe that has a name), to standard output for ``-``, or to nobody.

    Raises
    ------
    InputError
        when the file cannot be opened.
    """
    if target is None or target == "-":
        yield EventStream(None, is_wanted=target is not None)
        return
    try:
        file = Path(target).open("w", encoding="utf-8")  # noqa: SIM115 - closed below; an error here is the user's
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError(f"--events {target}: {reason}") from error
    try:
        yield EventStream(file)
    finally:
        with suppress(OSError):
            file.close()

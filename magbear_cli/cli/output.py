"""The two doors of the command: data on standard output, talk on standard error."""

from __future__ import annotations

import io
import os
import sys
from typing import TextIO

import click

from magbear_cli.errors import ResumableError


def put(text: str) -> None:
    """Write a line, or lines, of data to standard output; a reader that has gone is no error.

    Raises
    ------
    ResumableError
        when standard output does not take it, as a file on a full disk.
    """
    try:
        click.echo(text)
    except BrokenPipeError:
        silence(sys.stdout)
    except OSError as error:
        silence(sys.stdout)
        raise ResumableError(f"standard output cannot be written: {error.strerror}") from error


def put_json(document: object) -> None:
    """Write one JSON document to standard output."""
    import json

    put(json.dumps(document, indent=2, allow_nan=False))


def tell(text: str) -> None:
    """Say something on standard error; nothing ends because nobody listens."""
    try:
        click.echo(text, err=True)
    except (OSError, ValueError):
        silence(sys.stderr)


def settle_streams() -> None:
    """Give the process three streams that can be written, whatever it was started with.

    A closed descriptor would be given to the next file that is opened, and text would end up in it; a character that
    the terminal does not know must not end a command.
    """
    for descriptor in (0, 1, 2):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest free descriptor is this one
    if sys.stdout is None:
        sys.stdout = _nowhere()
    if sys.stderr is None:
        sys.stderr = _nowhere()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            is_utf8 = stream.encoding.lower().replace("-", "") == "utf8"
            stream.reconfigure(errors="surrogateescape" if is_utf8 else "replace")


def silence(stream: TextIO) -> None:
    """Point a stream that nobody reads at nothing, so that the interpreter's own flush at exit is quiet."""
    null = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(null, stream.fileno())
    except (OSError, ValueError):
        pass
    finally:
        os.close(null)


def _nowhere() -> TextIO:
    return open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123 - a stream for the life of the process

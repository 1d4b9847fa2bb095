"""The text of a study file, read without ever waiting for a pipe or reading without end."""

from __future__ import annotations

import codecs
import os
import re
import stat
import sys
from pathlib import Path
from typing import Final

from magbear_cli.spec.nodes import Mark
from magbear_cli.spec.problems import Faults

LARGEST_BYTES: Final = 1 << 20
STDIN_NAME: Final = "<stdin>"
LINE_BREAK: Final = re.compile("\r\n|[\r\n\x85\u2028\u2029]")  # as YAML counts lines
_FORBIDDEN = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_OTHER_ENCODINGS = ((codecs.BOM_UTF32_LE, "UTF-32"), (codecs.BOM_UTF32_BE, "UTF-32"), (codecs.BOM_UTF16_LE, "UTF-16"))


def read_text(path: Path | str, faults: Faults) -> str | None:
    """The text of a file, or of standard input for ``-``; None when a fault was noted."""
    if str(path) == "-":
        name, data = STDIN_NAME, _read_stdin(faults)
    else:
        name, data = str(path), _read_file(path, faults)
    if data is None:
        return None
    if len(data) > LARGEST_BYTES:
        faults.add(Mark(name), "E110", "the file is larger than 1 MiB", "a study holds lists of numbers, not data")
        return None
    return decode(data, name, faults)


def _read_stdin(faults: Faults) -> bytes | None:
    """What stands on standard input, at most a little more than is allowed."""
    try:
        return sys.stdin.buffer.read(LARGEST_BYTES + 1)
    except (OSError, ValueError, AttributeError):
        faults.add(Mark(STDIN_NAME), "E100", "standard input cannot be read", "give the name of a file")
        return None


def _read_file(path: Path | str, faults: Faults) -> bytes | None:
    """The bytes of a regular file, at most a little more than is allowed."""
    mark = Mark(str(path))
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
    try:
        descriptor = os.open(path, flags)
    except FileNotFoundError:
        dangling = Path(path).is_symlink()
        sentence = "the link points to a file that does not exist" if dangling else "there is no such file"
        faults.add(mark, "E100", sentence, "" if dangling else _beside(path))
        return None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        faults.add(mark, "E100", f"the file cannot be opened: {reason.lower()}")
        return None
    try:
        mode = os.fstat(descriptor).st_mode
        if stat.S_ISDIR(mode):
            faults.add(mark, "E100", "this is a directory, not a study file", "name a .yaml file in it")
            return None
        if not stat.S_ISREG(mode):
            faults.add(mark, "E100", "this is a pipe or a device, not a file", "use - to read standard input")
            return None
        with os.fdopen(os.dup(descriptor), "rb") as stream:
            return stream.read(LARGEST_BYTES + 1)
    except OSError as error:
        faults.add(mark, "E100", f"the file cannot be read: {(error.strerror or str(error)).lower()}")
        return None
    finally:
        os.close(descriptor)


def _beside(path: Path | str) -> str:
    """A hint at a YAML file that was probably meant."""
    from magbear_cli.spec.problems import nearest  # noqa: PLC0415 - only on the way to an error

    try:
        names = sorted(item.name for item in Path(path).parent.iterdir() if item.suffix in {".yaml", ".yml"})
    except OSError:
        return ""
    found = nearest(Path(path).name, names)
    return f"did you mean '{Path(path).parent / found}'?" if found else ""


def decode(data: bytes, name: str, faults: Faults) -> str | None:
    """UTF-8 bytes as text without a byte order mark; None when a fault was noted."""
    for mark, encoding in (*_OTHER_ENCODINGS, (codecs.BOM_UTF16_BE, "UTF-16")):
        if data.startswith(mark):
            faults.add(Mark(name, 1, 1), "E111", f"the file is {encoding}, not UTF-8", "save it as UTF-8")
            return None
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        before = data[: error.start].decode("utf-8")
        after = data[error.start : error.start + 200].decode("utf-8", "backslashreplace")
        place = place_of(before + after, len(before), name)
        faults.add(place, "E111", f"the byte 0x{data[error.start]:02x} is not UTF-8 text", "save the file as UTF-8")
        return None
    return clean(text, name, faults)


def clean(text: str, name: str, faults: Faults, everywhere: Mark | None = None) -> str | None:
    """The text without a byte order mark; None when it holds characters that no text holds."""
    text = text.removeprefix("\ufeff")
    found = _FORBIDDEN.search(text)
    if found:
        what = "a NUL character" if found.group() == "\0" else f"the character U+{ord(found.group()):04X}"
        faults.add(
            everywhere or place_of(text, found.start(), name),
            "E111",
            f"{what} does not belong into a text",
            "remove it",
        )
        return None
    return text


def place_of(text: str, offset: int, name: str) -> Mark:
    """The line and column of a character of a text."""
    start, line = 0, 1
    for found in LINE_BREAK.finditer(text, 0, offset):
        start, line = found.end(), line + 1
    following = LINE_BREAK.search(text, offset)
    return Mark(name, line, offset - start + 1, 1, text[start : following.start() if following else len(text)])

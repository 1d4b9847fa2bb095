"""Plain data as YAML text that is read back as the same data."""

from __future__ import annotations

import re
from typing import Any, Final

from magbear_cli.spec.scalars import ScalarError, plain_scalar

_PLAIN_TEXT: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_./+-]*")
_ESCAPES: Final = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}


def written(document: dict[str, Any]) -> str:
    """The YAML text of a study: one key a line; the sections ``simulate`` and ``sweep`` one entry a line."""
    return "".join(_top(key, value) for key, value in document.items())


def _top(key: str, value: Any) -> str:  # noqa: ANN401 - YAML holds anything
    """A top-level key with its value."""
    if key == "simulate" and isinstance(value, list) and value:
        return f"{key}:\n" + "".join(f"  - {inline(entry)}\n" for entry in value)
    if key == "sweep" and isinstance(value, dict) and value:
        return f"{key}:\n" + "".join(f"  {_axis(name, values)}" for name, values in value.items())
    return f"{_text(key)}: {inline(value)}\n"


def _axis(key: str, values: Any) -> str:  # noqa: ANN401 - YAML holds anything
    """A swept key with its list; mappings in it stand on lines of their own."""
    if isinstance(values, list) and values and all(isinstance(value, dict) for value in values):
        return f"{_text(key)}:\n" + "".join(f"    - {inline(value)}\n" for value in values)
    return f"{_text(key)}: {inline(values)}\n"


def inline(value: Any) -> str:  # noqa: ANN401 - YAML holds anything
    """A value on one line."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_text(str(key))}: {inline(child)}" for key, child in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(inline(child) for child in value) + "]"
    return repr(value)


def _text(text: str) -> str:
    """Text, quoted unless it is a plain word."""
    try:
        if _PLAIN_TEXT.fullmatch(text) and plain_scalar(text) == text:
            return text
    except ScalarError:
        pass
    escaped = "".join(_ESCAPES.get(char) or (char if char.isprintable() else _escape(char)) for char in text)
    return f'"{escaped}"'


def _escape(char: str) -> str:
    """A character as an escape of double-quoted YAML."""
    return f"\\U{ord(char):08x}"

"""Plain scalars by the core schema of YAML 1.2: ``1e3`` is a number, ``on`` is text, ``010`` is refused."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Final

_NULLS: Final = frozenset({"", "~", "null", "Null", "NULL"})
_TRUTHS: Final = {
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_INTEGER = re.compile(r"[-+]?(?:0|[1-9][0-9]*)")
_BASED = re.compile(r"0x[0-9a-fA-F]+|0o[0-7]+")
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_LEADING_ZERO = re.compile(r"[-+]?0[0-9]")
_NOT_FINITE = re.compile(r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)")
_LONGEST_NUMBER: Final = 400  # characters; no float needs more


class ScalarError(Exception):
    """A plain scalar that is refused: a sentence and a remedy."""

    def __init__(self, sentence: str, remedy: str = "") -> None:
        """Keep both."""
        super().__init__(sentence)
        self.sentence, self.remedy = sentence, remedy


def plain_scalar(text: str) -> bool | int | float | str | None:
    """The value of an unquoted scalar.

    Raises
    ------
    ScalarError
        For a number that begins with a zero, is not finite, or is too large or too small for a float.
    """
    if text in _NULLS:
        return None
    if text in _TRUTHS:
        return _TRUTHS[text]
    if _NOT_FINITE.fullmatch(text):
        raise ScalarError(f"'{text}' is not a finite number", "give a finite number, or leave the key out")
    if not (_FLOAT.fullmatch(text) or _BASED.fullmatch(text)):
        return text
    if len(text) > _LONGEST_NUMBER:
        raise ScalarError(f"a number of {len(text)} characters is too long", "a float holds 17 digits")
    if _BASED.fullmatch(text):
        return _bounded(int(text, 0), text)
    if _LEADING_ZERO.match(text):
        better = re.sub(r"^([-+]?)0+(?=[0-9])", r"\1", text)
        raise ScalarError(
            f"'{text}' begins with a zero, which some programs read as octal", f"write {better}, or '{text}' for text"
        )
    return _bounded(int(text), text) if _INTEGER.fullmatch(text) else _float(text)


def _bounded(number: int, text: str) -> int:
    """An integer that a float can hold."""
    _float(str(number), text)
    return number


def _float(text: str, shown: str | None = None) -> float:
    """A finite float; a number that would be read as zero without being it is refused."""
    number, shown = float(text), shown or text
    short = shown if len(shown) <= 30 else shown[:27] + "..."
    if math.isinf(number):
        raise ScalarError(f"'{short}' is larger than any float", "the largest is about 1.8e308")
    if number == 0 and re.search(r"[1-9]", re.split(r"[eE]", text)[0]):
        raise ScalarError(f"'{short}' is smaller than any float", "the smallest is about 5e-324")
    return number or 0.0


def number_hint(text: str) -> str:
    """What to write instead of a text that was probably meant as a number; empty when there is no telling."""
    stripped = text.strip()
    if stripped == text and is_number(text):
        return f"remove the quotes: {text}"
    for pattern, hint in _HINTS:
        found = pattern.fullmatch(stripped)
        if found:
            return hint(found)
    if re.fullmatch(r"\d+", stripped) and not stripped.isascii():
        return "use the digits 0 to 9"
    if stripped != text or (not stripped.isascii() and re.search(r"[0-9]", stripped)):
        return "remove the characters that are not part of a number"
    if stripped.casefold() in {"nan", "inf", "-inf", "+inf", "infinity", "-infinity", "none"}:
        return "give a finite number, or leave the key out"
    return ""


def is_number(text: str) -> bool:
    """Whether an unquoted text would be read as a number."""
    try:
        value = plain_scalar(text)
    except ScalarError:
        return False
    return isinstance(value, int | float) and not isinstance(value, bool)


_DIGITS = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
_HINTS: Final[tuple[tuple[re.Pattern[str], Callable[[re.Match[str]], str]], ...]] = (
    (re.compile(r"0b[01]+"), lambda m: f"write {int(m[0], 2)}"),
    (re.compile(r"([-+]?[0-9]+),([0-9]+(?:[eE][-+]?[0-9]+)?)"), lambda m: f"write a decimal point: {m[1]}.{m[2]}"),
    (
        re.compile(rf"({_DIGITS})[\s\u00a0]*([A-Za-zµμΩ°%][\w/²³^*.·-]*)"),
        lambda m: f"write the number alone, {m[1]}: the key says the unit, and it is SI",
    ),
    (
        re.compile(rf"[−–—]({_DIGITS})"),
        lambda m: f"write the minus of the keyboard: -{m[1]}",
    ),
    (
        re.compile(r"[-+]?[0-9]{1,3}(?:[_ \u00a0\u2009\u202f'][0-9]{3})+(?:\.[0-9]*)?"),
        lambda m: f"write it without separators: {re.sub(r'[^-+0-9.]', '', m[0])}",
    ),
    (
        re.compile(r"[-+]?[0-9][0-9_]*_[0-9_]*(?:\.[0-9_]*)?"),
        lambda m: f"write it without separators: {m[0].replace('_', '')}",
    ),
    (re.compile(r"[0-9]+:[0-9]{2}(?::[0-9]{2})?"), lambda _: "write seconds as one number"),
)

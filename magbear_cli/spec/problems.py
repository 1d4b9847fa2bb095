"""What can be wrong with a study: a stable code, the place, one sentence, a remedy; and the error that carries it."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

from magbear_cli.errors import InputError
from magbear_cli.spec.nodes import Mark

CODES: Final[dict[str, str]] = {
    "E100": "The file cannot be read: it is missing, not a regular file, or may not be opened.",
    "E101": "The text is not YAML: a bracket, quote, colon or indent is wrong.",
    "E102": "A key is not one that belongs there; the nearest legal key is named.",
    "E103": "A key that has no default is missing.",
    "E104": "A value is of the wrong kind: text where a number belongs, a list where a mapping belongs.",
    "E105": "A number is outside of the range in which it has a meaning.",
    "E106": "A name is not one of the legal names: a method, a part of configs/, a figure, a choice.",
    "E107": "A key stands twice in one mapping; YAML would silently keep one of the two.",
    "E108": "Tags, anchors, aliases, merge keys, several documents and keys that are not text are not part of a study.",
    "E109": "A number is written so that it could be misread, or it is not finite.",
    "E110": "The file is too large or nested too deeply to be a study.",
    "E111": "The file is not UTF-8 text, or holds characters that no text holds.",
    "E112": "The study's format number (the key magbear) is not one that this release reads.",
    "E113": "A list is empty, or holds a value twice.",
    "E114": "Two values contradict each other, each being legal alone.",
    "E115": "A weight is not proper, not stable, or zero.",
    "E116": "The product of the sweeps has more cases than a study may have.",
    "E117": "A key cannot be swept: it is not part of a case, or there is no such key.",
    "E118": "A --set is not KEY=VALUE, or its key leads nowhere.",
    "E119": "Two cases of the study are the same.",
}

SHOWN: Final = 40  # problems in one message; more are counted
_WIDTH: Final = 100  # characters of a source line that are shown
_UNPRINTABLE = re.compile(r"[^\x20-\x7e\xa0-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]")


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong, where it is (line and column from 1, None outside of a file), and what to do."""

    file: str
    line: int | None
    column: int | None
    code: str
    sentence: str
    remedy: str = ""
    source_line: str | None = None
    width: int = 1

    def __str__(self) -> str:
        """The place, the code and the sentence, then the source line with a caret and the remedy."""
        place = ":".join(str(part) for part in (printable(self.file), self.line, self.column) if part is not None)
        head = f"{place}: error[{self.code}]: {printable(self.sentence)}"
        remedy = printable(self.remedy)
        if self.source_line is None or self.line is None or self.column is None:
            return f"{head}\n  {remedy}" if remedy else head
        start = max(0, self.column - 1 - _WIDTH // 2)
        shown = printable(self.source_line[start : start + _WIDTH].replace("\t", " "))
        margin, offset = f"{self.line:>4}", self.column - 1 - start
        carets = "^" * max(1, min(self.width, len(shown) - offset))
        pointer = f"{' ' * len(margin)} | {' ' * offset}{carets}  {remedy}".rstrip()
        return f"{head}\n{margin} | {shown.rstrip()}\n{pointer}"


class StudyError(InputError):
    """A study that is refused, with everything that is wrong with it."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        """Keep the problems; the message shows the first forty of them."""
        self.problems = tuple(problems)
        shown = [str(problem) for problem in self.problems[:SHOWN]]
        if len(self.problems) > SHOWN:
            shown.append(f"... and {len(self.problems) - SHOWN} more problems")
        super().__init__("\n".join(shown))


@dataclass
class Faults:
    """The problems found so far, each once, in the order in which they were found."""

    _found: dict[tuple[object, ...], Problem] = field(default_factory=dict)

    def add(self, mark: Mark, code: str, sentence: str, remedy: str = "") -> None:
        """Note a problem at a place, unless the same one is already noted there."""
        key = (mark.file, mark.line, mark.column, code, sentence)
        self._found.setdefault(
            key,
            Problem(mark.file, mark.line, mark.column, code, sentence, remedy, mark.source_line, mark.width),
        )

    def __len__(self) -> int:
        """How many problems were found."""
        return len(self._found)

    def stop(self) -> None:
        """Raise everything that was found, in the order of the lines; do nothing when nothing was found."""
        if self._found:
            places = list(dict.fromkeys(problem.file for problem in self._found.values()))
            raise StudyError(
                sorted(
                    self._found.values(),
                    key=lambda problem: (places.index(problem.file), problem.line or 0, problem.column or 0),
                )
            )


def printable(text: str) -> str:
    """The text on one line, with everything that could upset a terminal replaced by its escape."""
    return _UNPRINTABLE.sub(lambda found: ascii(found.group())[1:-1], text)


def quoted(value: object, limit: int = 60) -> str:
    """A value as it may stand in a sentence: short, on one line, between quotes when it is text."""
    text = value if isinstance(value, str) else str(value)
    short = text if len(text) <= limit else text[: limit - 3] + "..."
    return f"'{short}'" if isinstance(value, str) else short


def nearest(word: str, candidates: Iterable[str]) -> str | None:
    """The candidate that was probably meant, or None: close in letters, or the same but for a unit or a part of it."""
    by_fold: dict[str, str] = {}
    for candidate in candidates:
        by_fold.setdefault(candidate.casefold(), candidate)
    folded = word.strip().casefold().replace("-", "_").replace(" ", "_")
    if folded in by_fold:
        return by_fold[folded]
    close = difflib.get_close_matches(folded, by_fold, n=1, cutoff=0.7)
    if not close and len(folded) > 1:
        close = [name for name in by_fold if name.startswith(folded) or folded.startswith(f"{name}_")][:1]
    if not close:
        close = difflib.get_close_matches(folded, by_fold, n=1, cutoff=0.5)
    if not close and len(folded) > 2:
        close = [name for name in by_fold if folded in name][:1]
    return by_fold[close[0]] if close else None


def did_you_mean(word: str, candidates: Iterable[str], what: str = "legal are") -> str:
    """The remedy for a name that does not exist: the nearest one, else the list of all."""
    names = list(candidates)
    found = nearest(word, names)
    if found is not None:
        return f"did you mean '{found}'?"
    return f"{what} {', '.join(names)}" if names else ""

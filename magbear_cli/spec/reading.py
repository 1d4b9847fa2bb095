"""YAML text to nodes with their places; everything that is not plain data, written once, is refused.

PyYAML's pure Python parser yields events; nodes are built from these, so that no tag, alias or constructor of YAML 1.1
is ever acted upon, and the depth is known before anything recurses.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any, Final

import yaml

from magbear_cli.spec.files import LINE_BREAK, clean
from magbear_cli.spec.nodes import REFUSED, Mark, Node, Value
from magbear_cli.spec.problems import Faults, quoted
from magbear_cli.spec.scalars import ScalarError, plain_scalar

DEEPEST: Final = 50
MOST_VALUES: Final = 120_000  # about five seconds of reading; a sweep of 100 000 cases needs fewer


class _StopReading(Exception):  # noqa: N818 - it ends the reading, it is not an error of its own
    """Nothing more can be read; the fault is already noted."""


def read_nodes(text: str, name: str, faults: Faults, everywhere: Mark | None = None) -> Node | None:
    """The one document of a text; None when it is empty or a fault ended the reading.

    ``everywhere`` replaces every place, for a text that stands in no file.
    """
    checked = clean(text, name, faults, everywhere)
    if checked is None:
        return None
    reader = _Reader(checked, name, faults, everywhere)
    try:
        return reader.document()
    except _StopReading:
        pass
    except yaml.MarkedYAMLError as error:
        reader.syntax_fault(error)
    except Exception:  # noqa: BLE001 - PyYAML leaks ValueError, IndexError, OverflowError and others
        reader.fault(reader.here(), "E101", "this cannot be read as YAML", "quote the text, or write it plainly")
    return None


@dataclass
class _Reader:
    """The state of one reading."""

    text: str
    name: str
    faults: Faults
    everywhere: Mark | None
    lines: list[str] = field(init=False)
    loader: Any = field(init=False)
    values: int = 0

    def __post_init__(self) -> None:
        """Split the lines and open the parser."""
        self.lines = LINE_BREAK.split(self.text)
        self.loader = yaml.SafeLoader(self.text)

    def document(self) -> Node | None:
        """The root of the only document, or None when there is none."""
        self.loader.get_event()
        if self.loader.check_event(yaml.StreamEndEvent):
            return None
        self.loader.get_event()
        root = self.node(0, None)
        self.loader.get_event()
        if not self.loader.check_event(yaml.StreamEndEvent):
            event = self.loader.peek_event()
            self.fault(self.mark(event), "E108", "a second document begins here", "a study is one document")
        return root

    def node(self, depth: int, key_mark: Mark | None) -> Node:
        """The next node, with everything in it."""
        event = self.loader.get_event()
        mark = self.mark(event)
        self.values += 1
        if self.values > MOST_VALUES:
            self.fault(mark, "E110", f"the file holds more than {MOST_VALUES} values", "make several studies of it")
            raise _StopReading
        if isinstance(event, yaml.AliasEvent):
            self.fault(mark, "E108", f"the alias '*{event.anchor}' is not allowed", "write the value out")
            return Node(REFUSED, mark, key_mark)
        if depth >= DEEPEST and isinstance(event, yaml.CollectionStartEvent):
            self.fault(mark, "E110", f"the file is nested more than {DEEPEST} levels deep", "a study needs about six")
            raise _StopReading
        refused = self._is_decorated(event, mark)
        value: Value
        if isinstance(event, yaml.MappingStartEvent):
            value = self._mapping(depth + 1)
        elif isinstance(event, yaml.SequenceStartEvent):
            value = self._sequence(depth + 1)
        else:
            value = self._scalar(event, mark)
        return Node(REFUSED if refused else value, mark, key_mark)

    def _is_decorated(self, event: Any, mark: Mark) -> bool:  # noqa: ANN401 - PyYAML's events are untyped
        """Whether the node bears a tag or an anchor, which is noted."""
        if event.anchor is not None:
            self.fault(
                mark, "E108", f"the anchor '&{event.anchor}' is not allowed", "write the value out where it is used"
            )
        if event.tag is not None:
            short = quoted(str(event.tag).replace("tag:yaml.org,2002:", "!!"))
            self.fault(mark, "E108", f"the tag {short} is not allowed", "write the value without it")
        return event.anchor is not None or event.tag is not None

    def _sequence(self, depth: int) -> Value:
        """The entries of a list."""
        entries = []
        while not self.loader.check_event(yaml.SequenceEndEvent):
            entries.append(self.node(depth, None))
        self.loader.get_event()
        return tuple(entries)

    def _mapping(self, depth: int) -> Value:
        """The keys and values of a mapping; a key that is refused is left out."""
        found: dict[str, Node] = {}
        while not self.loader.check_event(yaml.MappingEndEvent):
            key_event = self.loader.peek_event()
            key, key_mark = self.node(depth, None).value, self.mark(key_event)
            value = self.node(depth, key_mark)
            if not isinstance(key, str):
                if key is not REFUSED:
                    self._odd_key(key_mark)
            elif key == "<<" and key_event.style is None:
                self.fault(key_mark, "E108", "the merge key '<<' is not allowed", "write the keys out")
            elif key in found:
                first = found[key].place.line
                where = "" if first is None or self.everywhere else f"; it stands first on line {first}"
                self.fault(key_mark, "E107", f"the key {quoted(key)} stands twice{where}", "remove one of the two")
            else:
                found[key] = value
        self.loader.get_event()
        return found

    def _odd_key(self, mark: Mark) -> None:
        """Note a key that is not text; between braces it is often the second half of a decimal comma."""
        before = (mark.source_line or "")[: (mark.column or 1) - 1]
        halves = re.search(r"([0-9]+),$", before), re.match(r"[0-9]+", (mark.source_line or "")[len(before) :])
        if halves[0] and halves[1]:
            remedy = f"write a decimal point: {halves[0][1]}.{halves[1][0]}"
        else:
            remedy = "quote it if it is meant as text"
        self.fault(mark, "E108", "a key must be text", remedy)

    def _scalar(self, event: Any, mark: Mark) -> Value:  # noqa: ANN401 - PyYAML's events are untyped
        """The value of a scalar; only an unquoted one can be anything but text."""
        if event.style is not None:
            if not event.value.isprintable() and clean(event.value, self.name, Faults()) is None:
                self.fault(mark, "E111", "the text holds a character that no text holds", "remove the escape")
                return REFUSED
            return str(event.value)
        try:
            return plain_scalar(event.value)
        except ScalarError as error:
            self.fault(mark, "E109", error.sentence, error.remedy)
            return REFUSED

    def mark(self, event: Any) -> Mark:  # noqa: ANN401 - PyYAML's events are untyped
        """The place of an event."""
        start, end = event.start_mark, event.end_mark
        return self._mark(start.line, start.column, end.column - start.column if end.line == start.line else 0)

    def _mark(self, line: int, column: int, width: int = 1) -> Mark:
        """A place from PyYAML's counts, which begin at 0."""
        if self.everywhere is not None:
            return self.everywhere
        source = self.lines[line] if line < len(self.lines) else ""
        return Mark(self.name, line + 1, column + 1, width or max(1, len(source) - column), source)

    def here(self) -> Mark:
        """How far the parser got."""
        return self._mark(self.loader.line, self.loader.column)

    def fault(self, mark: Mark, code: str, sentence: str, remedy: str = "") -> None:
        """Note a problem."""
        self.faults.add(mark, code, sentence, remedy)

    def syntax_fault(self, error: yaml.MarkedYAMLError) -> None:
        """Note what the parser stumbled over, in words that tell what to do."""
        place, problem, context = error.problem_mark, error.problem or "", error.context or ""
        opened = error.context_mark
        sentence, remedy = f"this is not YAML: {problem}", ""
        if "'\\t'" in problem or (place and self._line(place.line)[: place.column + 1].strip(" ").startswith("\t")):
            sentence, remedy = "a tab cannot indent YAML", "indent with spaces"
        elif "flow sequence" in context or "flow mapping" in context:
            bracket = "[" if "sequence" in context else "{"
            if opened and "<stream end>" in problem:
                place, sentence = opened, f"this '{bracket}' is never closed"
            else:
                sentence = f"a comma or the closing bracket of a '{bracket}' is missing here"
            remedy = "close it, and put commas between the entries"
        elif "quoted scalar" in context and opened:
            if "escape" in problem:
                sentence, remedy = "a backslash in double quotes begins an escape", "use single quotes"
            else:
                place, sentence, remedy = opened, "this quote is never closed", "close it, or remove it"
        elif "could not find expected ':'" in problem:
            place = opened or place
            sentence, remedy = "a key needs a colon and a space after it", "write 'key: value'"
        elif "mapping values are not allowed" in problem:
            sentence, remedy = "a colon is not expected here", "check the indent, or quote a text that holds ': '"
        elif "block" in context:
            sentence, remedy = "the indent of this line fits no line above", "align keys of one level in one column"
        elif "cannot start any token" in problem:
            sentence, remedy = "a text cannot begin with this character", "quote the text"
        self.fault(self._mark(place.line, place.column) if place else self.here(), "E101", sentence, remedy)

    def _line(self, line: int) -> str:
        """A source line, or nothing."""
        return self.lines[line] if line < len(self.lines) else ""

"""The cases of a study: the product of its sweeps, counted at once and resolved one by one."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any, Final

from pydantic import ValidationError

from magbear_cli.spec.canonical import canonical
from magbear_cli.spec.contradictions import contradictions
from magbear_cli.spec.grammar import dotted_remedy, exists
from magbear_cli.spec.models import CASE_KEYS, Case
from magbear_cli.spec.nodes import REFUSED, Node, Path, PathError, assign, descendant, is_refused, plain
from magbear_cli.spec.parts import Shelf
from magbear_cli.spec.problems import Faults, quoted
from magbear_cli.spec.sentences import EXAMPLES, note_errors

LARGEST_COUNT: Final = 100_000
MOST_AXES: Final = 50
EAGER_COUNT: Final = 2_000  # so many cases are checked when a study is read; the rest when they are reached


@dataclass(frozen=True)
class Axis:
    """A swept key with its values."""

    key: str
    values: tuple[Node, ...]
    node: Node

    @property
    def path(self) -> Path:
        """The key as a path."""
        return tuple(self.key.split("."))


def read_axes(sweep: Node | None, faults: Faults, methods: Collection[str] = ()) -> tuple[Axis, ...]:
    """The swept keys of a study in their order; what is wrong with them is noted.

    Of a controller's options the ``methods`` that the study names decide which one was probably meant.
    """
    if sweep is None or sweep.value is None or sweep.value is REFUSED:
        return ()
    if not isinstance(sweep.value, dict):
        faults.add(
            sweep.mark, "E104", "sweep must be a mapping of dotted keys", f"write for example {EXAMPLES['sweep']}"
        )
        return ()
    if len(sweep.value) > MOST_AXES:
        sentence = f"sweep has {len(sweep.value)} keys; it may have {MOST_AXES}"
        faults.add(sweep.place, "E116", sentence, "make several studies")
        return ()
    return tuple(
        Axis(key, node.value, node)
        for key, node in sweep.value.items()
        if _is_sweepable(key, node, faults, methods) and _is_grid(key, node, faults) and isinstance(node.value, tuple)
    )


def _is_sweepable(key: str, node: Node, faults: Faults, methods: Collection[str]) -> bool:
    """Whether a key is part of a case."""
    path = tuple(key.split("."))
    if not exists(path):
        remedy = dotted_remedy(key, of_cases_only=True, methods=methods)
        remedy = remedy or f"a swept key begins with one of {', '.join(CASE_KEYS)}"
        faults.add(node.place, "E117", f"there is no key {quoted(key)} to sweep", remedy)
        return False
    if path[0] not in CASE_KEYS:
        faults.add(
            node.place, "E117", f"{quoted(key)} cannot be swept: it is not part of a case", "remove it from sweep"
        )
        return False
    return True


def _is_grid(key: str, node: Node, faults: Faults) -> bool:
    """Whether a swept key has a list of distinct values; a value that stands twice is noted."""
    if not isinstance(node.value, tuple):
        if not is_refused(node):
            faults.add(node.mark, "E104", f"sweep.{key} must be a list of values", f"write {key}: [first, second]")
        return False
    if not node.value:
        faults.add(node.mark, "E113", f"sweep.{key} is an empty list", "give it values, or remove the key")
        return False
    seen: dict[str, int] = {}
    for index, value in enumerate(node.value):
        if is_refused(value):
            continue
        first = seen.setdefault(identity(plain(value)), index)
        if first != index:
            sentence = f"sweep.{key} holds the same value twice, as entries {first + 1} and {index + 1}"
            faults.add(value.mark, "E113", sentence, "remove one of the two")
    return True


def identity(value: Any) -> str:  # noqa: ANN401 - the file may hold anything
    """A text that is the same for values that mean the same: 7000 and 7000.0, but not true and 1."""
    if isinstance(value, bool) or value is None or isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, int | float):
        return repr(float(value))
    if isinstance(value, dict):
        return "{" + ",".join(sorted(f"{json.dumps(key)}:{identity(child)}" for key, child in value.items())) + "}"
    return "[" + ",".join(identity(child) for child in value) + "]"


@dataclass(frozen=True)
class Plan:
    """The base of all cases and the axes that vary it; the first axis is the slowest."""

    base: Node
    axes: tuple[Axis, ...]
    shelf: Shelf

    @property
    def count(self) -> int:
        """How many cases there are."""
        return math.prod(len(axis.values) for axis in self.axes)

    def positions(self, index: int) -> tuple[int, ...]:
        """Which value of each axis a case has."""
        found = []
        for axis in reversed(self.axes):
            index, position = divmod(index, len(axis.values))
            found.append(position)
        return tuple(reversed(found))

    def node(self, index: int, faults: Faults) -> Node | None:
        """The case with its values in place and its parts opened; a value below another is set after it."""
        root = self.base
        chosen = zip(self.axes, self.positions(index), strict=True)
        for axis, position in sorted(chosen, key=lambda pair: len(pair[0].path)):
            try:
                root = assign(root, axis.path, axis.values[position], self.shelf.open_at)
            except PathError as error:
                faults.add(
                    axis.node.place, "E117", f"'{axis.key}' cannot be swept: {error}", "add it to the study first"
                )
                return None
        return self.shelf.resolved(root)

    def case(self, index: int, faults: Faults) -> dict[str, Any] | None:
        """The canonical inputs of a case; None when it is not legal, which is noted."""
        root = self.node(index, faults)
        return None if root is None else self._validated(root, faults)

    def _validated(self, root: Node, faults: Faults) -> dict[str, Any] | None:
        """The canonical inputs from the values; None when they are not legal."""
        try:
            case = Case.model_validate(plain(root))
        except ValidationError as error:
            note_errors(error, root, faults)
            return None
        found = list(contradictions(case))
        for item in found:
            node = descendant(root, item.path) or root
            faults.add(node.mark, "E114", item.sentence, item.remedy)
        return None if found else canonical(case)

    def check(self, faults: Faults) -> None:
        """Look at the first cases, and at each value of each axis, and note what is wrong."""
        seen: dict[str, int] = {}
        for index in self._eager():
            inputs = self.case(index, faults)
            if inputs is None:
                continue
            first = seen.setdefault(json.dumps(inputs, sort_keys=True), index)
            if first != index and not len(faults):
                axis, value = self._difference(first, index)
                sentence = f"cases {first + 1} and {index + 1} are the same, whatever sweep.{axis.key} says"
                faults.add(value.mark, "E119", sentence, "remove the value, or the key that outweighs it")

    def _eager(self) -> Iterator[int]:
        """The cases to look at when the study is read: all, or those along the axes and then the first."""
        if self.count <= EAGER_COUNT:
            yield from range(self.count)
            return
        stride, along = self.count, dict.fromkeys([0])
        for axis in self.axes:
            stride //= len(axis.values)
            along |= dict.fromkeys(position * stride for position in range(len(axis.values)))
        rest = (index for index in range(self.count) if index not in along)
        yield from islice((*along, *islice(rest, EAGER_COUNT)), EAGER_COUNT)

    def _difference(self, first: int, second: int) -> tuple[Axis, Node]:
        """The last axis in which two cases differ, and its value in the second."""
        places = zip(self.axes, self.positions(first), self.positions(second), strict=True)
        axis, position = [(axis, late) for axis, early, late in places if early != late][-1]
        return axis, axis.values[position]

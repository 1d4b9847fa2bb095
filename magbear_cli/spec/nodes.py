"""A YAML value that remembers where it was written, and how to put another in its place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

Path = tuple[str, ...]  # keys and list indices, both as text


@dataclass(frozen=True, slots=True)
class Mark:
    """Where a value came from: line and column from 1 (None outside of a file), and the width to underline."""

    file: str
    line: int | None = None
    column: int | None = None
    width: int = 1
    source_line: str | None = None


class Refused:
    """Stands where a value was already refused, so that it is not complained about twice."""


REFUSED: Final = Refused()

Value = None | bool | int | float | str | dict[str, "Node"] | tuple["Node", ...] | Refused


@dataclass(frozen=True, slots=True)
class Node:
    """A value, where it stands, and where its key stands."""

    value: Value
    mark: Mark
    key_mark: Mark | None = None

    @property
    def place(self) -> Mark:
        """Where the eye should go: the key when there is one, else the value."""
        return self.key_mark or self.mark


class PathError(Exception):
    """A dotted key leads through a value that has nothing below it."""


def plain(node: Node) -> Any:  # noqa: ANN401 - YAML holds anything
    """The value without its places: mappings, lists and scalars."""
    value = node.value
    if isinstance(value, dict):
        return {key: plain(child) for key, child in value.items()}
    if isinstance(value, tuple):
        return [plain(child) for child in value]
    return value


def is_refused(node: Node) -> bool:
    """Whether the value, or anything within it, was already refused."""
    value = node.value
    if isinstance(value, dict):
        return any(is_refused(child) for child in value.values())
    if isinstance(value, tuple):
        return any(is_refused(child) for child in value)
    return value is REFUSED


def child_of(node: Node, key: str) -> Node | None:
    """The value below a key or an index, or None."""
    value = node.value
    if isinstance(value, dict):
        return value.get(key)
    if isinstance(value, tuple) and key.isdecimal() and key.isascii() and len(key) < 10 and int(key) < len(value):
        return value[int(key)]
    return None


def descendant(node: Node, path: Path) -> Node | None:
    """The value at a path, or None."""
    found: Node | None = node
    for key in path:
        if found is None:
            return None
        found = child_of(found, key)
    return found


def assign(root: Node, path: Path, new: Node, open_part: Callable[[Path, Node], Node], done: Path = ()) -> Node:
    """The tree with another value at a path; ``open_part`` turns a part's name on the way into its mapping.

    A mapping that is missing on the way is made; an entry of a list is never made.
    """
    if not path:
        return replace(new, key_mark=new.key_mark or root.key_mark)
    head, rest = path[0], path[1:]
    node = open_part(done, root)
    if node.value is REFUSED:
        return node
    if isinstance(node.value, tuple):
        child = child_of(node, head)
        if child is None:
            raise PathError(f"'{'.'.join(done)}' has no entry {head}: it has {len(node.value)}, counted from 0")
        index = int(head)
        changed = assign(child, rest, new, open_part, (*done, head))
        return replace(node, value=(*node.value[:index], changed, *node.value[index + 1 :]))
    if node.value is None and not head.isdecimal():
        node = replace(node, value={})
    if not isinstance(node.value, dict):
        raise PathError(f"'{'.'.join(done)}' has no '{head}' below it")
    child = node.value.get(head) or Node(None, new.mark, new.key_mark or new.mark)
    return replace(node, value={**node.value, head: assign(child, rest, new, open_part, (*done, head))})


def rewrite(node: Node, pattern: Path, change: Callable[[Node], Node]) -> Node:
    """The tree with ``change`` applied to every value at the pattern's places, ``*`` being any list entry."""
    if not pattern:
        return change(node)
    head, rest, value = pattern[0], pattern[1:], node.value
    if head == "*" and isinstance(value, tuple):
        return replace(node, value=tuple(rewrite(child, rest, change) for child in value))
    if isinstance(value, dict) and head in value:
        child = value[head]
        changed = rewrite(child, rest, change)
        return node if changed is child else replace(node, value={**value, head: changed})
    return node

"""``--set KEY=VALUE``: one value of the study changed from the command line, before anything is validated."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

from magbear_cli.spec.cases import identity
from magbear_cli.spec.grammar import dotted_remedy, exists, method_section, methods_with
from magbear_cli.spec.nodes import Mark, Node, Path, PathError, assign, child_of, descendant, is_refused, plain
from magbear_cli.spec.parts import Shelf
from magbear_cli.spec.problems import Faults, printable, quoted
from magbear_cli.spec.reading import read_nodes
from magbear_cli.spec.weights import WEIGHT_FORMS


@dataclass(frozen=True)
class Override:
    """A parsed ``--set``: where, what, and how it was written."""

    path: Path
    node: Node
    label: str

    @property
    def mark(self) -> Mark:
        """The place that messages name."""
        return Mark(self.label)

    @property
    def key(self) -> str:
        """The dotted key."""
        return ".".join(self.path)


def parse_override(text: str, faults: Faults, methods: Collection[str] = ()) -> Override | None:
    """A ``KEY=VALUE``, the value read as strictly as the study; None when a fault was noted.

    Of a controller's options the ``methods`` that the study names decide which one was probably meant.
    """
    label = f"--set {printable(text)}"
    mark = Mark(label)
    key, equals, value = text.partition("=")
    key = key.strip()
    if not equals or not key:
        faults.add(mark, "E118", "a --set is KEY=VALUE", "write for example --set controller.uncertainty=complex")
        return None
    if not value.strip():
        faults.add(mark, "E118", f"there is no value for {quoted(key)}", f"write --set {key}=null for none")
        return None
    path = tuple(key.split("."))
    if path[0] != "sweep" and not exists(path):
        remedy = dotted_remedy(key, of_cases_only=False, methods=methods)
        faults.add(mark, "E118", f"there is no key {quoted(key)}", remedy)
        return None
    before = len(faults)
    node = read_nodes(value, label, faults, everywhere=mark)
    if node is None and len(faults) == before:
        faults.add(mark, "E118", f"there is no value for {quoted(key)}", f"write --set {key}=null for none")
    return None if node is None else Override(path, replace(node, key_mark=mark), label)


def apply_override(root: Node, override: Override, shelf: Shelf, faults: Faults) -> Node:
    """The study with one value changed.

    A sweep of the same key, or of a key below it, is removed: the value given replaces it. When a key above it is
    swept (``controller`` for ``controller.order``), the value is set in each swept entry that knows the key, and in the
    base if that knows it; it is refused when none does, and entries that become equal are one. ``sweep.KEY`` sets the
    list of a swept key, null removes it.
    """
    if not isinstance(root.value, dict):
        return root
    if override.path[0] == "sweep":
        return _swept(root, override)
    root = _without_sweeps(root, override.key)
    accepted = False
    sweep = root.value.get("sweep") if isinstance(root.value, dict) else None
    axes = sweep.value if sweep is not None and isinstance(sweep.value, dict) else {}
    changed: dict[str, Node] = {}
    try:
        for key, axis in axes.items():
            prefix = tuple(key.split("."))
            changed[key] = axis
            if override.path[: len(prefix)] == prefix and isinstance(axis.value, tuple):
                known = [_knows(entry, prefix, override.path, shelf) for entry in axis.value]
                accepted = accepted or any(known)
                entries = [
                    _set(entry, prefix, override, shelf) if ok else entry
                    for entry, ok in zip(axis.value, known, strict=True)
                ]
                changed[key] = replace(axis, value=_merged(axis.value, entries))
        if _knows(root, (), override.path, shelf) or (
            not accepted and _section(root, (), override.path, shelf) is None
        ):
            root, accepted = _set(root, (), override, shelf), True
    except PathError as error:
        faults.add(override.mark, "E118", str(error), "an entry must exist before it can be changed")
        return root
    if not accepted:
        _refuse(root, override, shelf, faults)
    if sweep is not None and axes:
        root = _with(root, "sweep", replace(sweep, value=changed))
    return root


def _merged(before: tuple[Node, ...], after: list[Node]) -> tuple[Node, ...]:
    """The entries after a change, without those that the change made equal to an earlier one."""
    kept: dict[str, Node] = {}
    for old, new in zip(before, after, strict=True):
        if is_refused(new):
            return tuple(after)
        key = identity(plain(new)) if new is not old else f"{identity(plain(new))} {len(kept)}"
        kept.setdefault(key, new)
    return tuple(kept.values())


def _set(node: Node, prefix: Path, override: Override, shelf: Shelf) -> Node:
    """A node that stands at a prefix, with the value set in it."""
    return assign(node, override.path[len(prefix) :], override.node, shelf.open_at, prefix)


def _section(node: Node, prefix: Path, path: Path, shelf: Shelf) -> Node | None:
    """The mapping of a controller or a weight that the path leads into, or None."""
    if path[0] not in {"controller", "performance"} or len(path) == 1:
        return None
    found = node if prefix else descendant(node, path[:1])
    opened = None if found is None else shelf.open_at(path[:1], found)
    return opened if opened is not None and isinstance(opened.value, dict) else None


def _knows(node: Node, prefix: Path, path: Path, shelf: Shelf) -> bool:
    """Whether the section at hand has the option; every other section has all of its keys."""
    if path[0] not in {"controller", "performance"} or len(path) == 1:
        return True
    section = _section(node, prefix, path, shelf)
    if section is None or not isinstance(section.value, dict):
        return False
    if path[0] == "controller":
        method = child_of(section, "method")
        model = method_section(method.value) if method and isinstance(method.value, str) else None
        return model is None or path[1] in model.model_fields
    forms = [form for form in WEIGHT_FORMS.values() if any(key in form.model_fields for key in section.value)]
    return not forms or any(path[1] in form.model_fields for form in forms)


def _refuse(root: Node, override: Override, shelf: Shelf, faults: Faults) -> None:
    """Note an option that no method or form at hand knows."""
    option = override.path[1]
    if override.path[0] == "controller":
        method = descendant(root, ("controller", "method"))
        name = method.value if method else "the swept methods"
        sentence, remedy = f"{name} has no option {quoted(option)}", f"it belongs to {', '.join(methods_with(option))}"
    else:
        section = _section(root, (), override.path, shelf)
        keys = ", ".join(section.value) if section is not None and isinstance(section.value, dict) else ""
        sentence = f"the key {quoted(option)} does not go together with {keys} of 'performance'"
        remedy = "set performance as a whole"
    faults.add(override.mark, "E118", sentence, remedy)


def _with(root: Node, key: str, node: Node | None) -> Node:
    """A mapping with a key set, or removed."""
    value = (
        {name: child for name, child in root.value.items() if name != key or node}
        if isinstance(root.value, dict)
        else {}
    )
    if node is not None:
        value[key] = node
    return replace(root, value=value)


def _without_sweeps(root: Node, key: str) -> Node:
    """The study without the sweeps of a key and of what lies below it."""
    sweep = child_of(root, "sweep")
    if sweep is None or not isinstance(sweep.value, dict):
        return root
    kept = {name: axis for name, axis in sweep.value.items() if name != key and not name.startswith(f"{key}.")}
    if len(kept) == len(sweep.value):
        return root
    return _with(root, "sweep", replace(sweep, value=kept) if kept else None)


def _swept(root: Node, override: Override) -> Node:
    """The study with its sweep, or one swept key, replaced or removed."""
    if len(override.path) == 1:
        return _with(root, "sweep", None if override.node.value is None else override.node)
    key = ".".join(override.path[1:])
    sweep = child_of(root, "sweep")
    axes = dict(sweep.value) if sweep is not None and isinstance(sweep.value, dict) else {}
    axes.pop(key, None) if override.node.value is None else axes.update({key: override.node})
    mark = override.mark if sweep is None else sweep.mark
    return _with(root, "sweep", Node(axes, mark, mark) if axes else None)

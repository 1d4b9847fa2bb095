"""Named parts: bearings, weights, prefilters, sensors and rotors that stand in files of their own."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import magbear_cli
from magbear_cli.spec.files import read_text
from magbear_cli.spec.models import PARTS, pattern_of
from magbear_cli.spec.nodes import REFUSED, Node, rewrite
from magbear_cli.spec.nodes import Path as KeyPath
from magbear_cli.spec.problems import Faults, did_you_mean, quoted
from magbear_cli.spec.reading import read_nodes

_ENDINGS = (".yaml", ".yml")


@cache
def configs_folder() -> Path:
    """The folder of the named parts: inside of the installed package, or beside it in a checkout."""
    package = Path(magbear_cli.__file__).resolve().parent
    inside = package / "configs"
    return inside if inside.is_dir() else package.parent / "configs"


@cache
def part_names(kind: str) -> tuple[str, ...]:
    """The names of the parts of one kind (``bearings``, ``weights``, ...), sorted."""
    return tuple(sorted(path.stem for path in (configs_folder() / kind).glob("*.yaml")))


@dataclass
class Shelf:
    """The parts a study uses, each read once; a part that cannot be read is noted once and refused everywhere."""

    folder: Path | None
    faults: Faults
    _read: dict[tuple[str, str], Node] = field(default_factory=dict)

    def copy(self, faults: Faults) -> Shelf:
        """The same parts, noting what is wrong elsewhere."""
        return Shelf(self.folder, faults, dict(self._read))

    def resolved(self, root: Node) -> Node:
        """The tree with every part's name replaced by what the part holds."""
        for pattern, kind in PARTS.items():
            root = rewrite(root, pattern, lambda node, kind=kind: self.opened(kind, node))  # type: ignore[misc]
        return root

    def open_at(self, path: KeyPath, node: Node) -> Node:
        """The node at a path, its part opened if the path is a part's place."""
        kind = PARTS.get(pattern_of(path))
        return node if kind is None else self.opened(kind, node)

    def opened(self, kind: str, node: Node) -> Node:
        """What the named part holds, at the places of its own file; any other node as it is."""
        if not isinstance(node.value, str):
            return node
        key = (kind, node.value)
        if key not in self._read:
            self._read[key] = self._part(kind, node.value, node)
        return replace(self._read[key], key_mark=node.key_mark or node.mark)

    def _part(self, kind: str, name: str, node: Node) -> Node:
        """Read a part; noted and refused when there is none."""
        before = len(self.faults)
        path = self._path(kind, name, node)
        text = None if path is None else read_text(path, self.faults)
        root = None if text is None else read_nodes(text, str(path), self.faults)
        if root is not None and isinstance(root.value, dict) and len(self.faults) == before:
            return root
        if len(self.faults) == before:
            self.faults.add(node.mark, "E104", f"the part {quoted(name)} is not a mapping of keys")
        return Node(REFUSED, node.mark)

    def _path(self, kind: str, name: str, node: Node) -> Path | None:
        """Where a part stands: in configs/, or at a path from the study's folder."""
        if name in part_names(kind):
            return configs_folder() / kind / f"{name}.yaml"
        if not name.endswith(_ENDINGS):
            remedy = did_you_mean(name, part_names(kind))
            self.faults.add(node.mark, "E106", f"there is no part {quoted(name)} in configs/{kind}", remedy)
            return None
        if self.folder is None and not Path(name).is_absolute():
            self.faults.add(node.mark, "E100", f"{quoted(name)} has no study file to stand beside", "give a full path")
            return None
        path = Path(name) if self.folder is None else self.folder / name
        try:
            missing = not path.exists()
        except (OSError, ValueError):
            missing = True
        if missing:
            remedy = "a path is counted from the folder of the study file"
            self.faults.add(node.mark, "E100", f"there is no file {quoted(name)} for this part", remedy)
            return None
        return path

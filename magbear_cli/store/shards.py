"""One file a finished case, named by its case and its content: ``cases/ab/abcdef0123456789.<sha256, 16 digits>.case``.

The name proves the content, so reading means hashing: what does not match its name was damaged and counts as not there.
"""

from __future__ import annotations

import contextlib
import hashlib
import re
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from magbear_cli.errors import Status
from magbear_cli.store.durable import TEMPORARY_PREFIX, make_directory, write_durably
from magbear_cli.store.forms import grow_case, harvest_case
from magbear_cli.store.layout import LAYOUT_VERSION
from magbear_cli.store.packing import pack_tree, unpack_attributes, unpack_tree
from magbear_cli.store.toolchain import Toolchain
from magbear_cli.store.tree import Branch
from magbear_cli.study.outcome import CaseOutcome
from magbear_cli.study.plan import Case, canonical_json

NAME = re.compile(r"(?P<case>[0-9a-f]{16})\.(?P<digest>[0-9a-f]{16})\.case")
SHARD_FORMAT = "magbear case"
UNREADABLE = (KeyError, TypeError, ValueError, RuntimeError)


class DamagedShardError(Exception):
    """A shard whose content is not what its name says, or not what this version writes."""


class UnreadableShardError(DamagedShardError):
    """A shard that the system does not give us now; another time it may."""


@dataclass(frozen=True)
class ShardHead:
    """How a stored case ended, and the toolchain that computed it."""

    status: Status
    toolchain: Toolchain


@dataclass(frozen=True)
class ShardInventory:
    """The shards in a directory by case, the names that are not ours, and the leftovers of killed writers."""

    paths: Mapping[str, tuple[Path, ...]]
    foreign: tuple[Path, ...]
    leftovers: tuple[Path, ...]


def write_shard(folder: Path, outcome: CaseOutcome, toolchain: Toolchain) -> Path:
    """Store a case for good and give the path of its shard; older shards of the same case go after that.

    Raises
    ------
    ResumableError
        when the system refuses; nothing stored before is lost.
    """
    image = shard_image(outcome, toolchain)
    home = folder / outcome.case_id[:2]
    make_directory(home)
    path = home / f"{outcome.case_id}.{_digest(image)}.case"
    older = [other for other in home.glob(f"{outcome.case_id}.*.case") if other != path]
    write_durably(path, image)
    for other in older:
        with contextlib.suppress(OSError):
            other.unlink()
    return path


def copy_shard(path: Path, folder: Path) -> Path:
    """Store a shard of another directory under the same name, and give its path.

    Raises
    ------
    ResumableError
        when the system refuses.
    DamagedShardError
        when the content does not match the name.
    """
    image = _proven_image(path)
    home = folder / path.name[:2]
    make_directory(home)
    write_durably(home / path.name, image)
    return home / path.name


def shard_image(outcome: CaseOutcome, toolchain: Toolchain) -> bytes:
    """The bytes of a case's shard; the same for equal outcomes, wherever they stand in a study."""
    own: dict[str, str | int] = {
        "format": SHARD_FORMAT,
        "layout_version": LAYOUT_VERSION,
        "status": outcome.status.value,
        "toolchain": toolchain.text,
    }
    return pack_tree(Branch(grow_case(outcome).children, own))


def read_head(path: Path) -> ShardHead:
    """How the case of a shard ended; the whole content is checked against the name on the way.

    Raises
    ------
    DamagedShardError
        when it does not match, or was not written by this version's layout.
    """
    try:
        head = unpack_attributes(_proven_image(path))
        if head["format"] != SHARD_FORMAT or head["layout_version"] != LAYOUT_VERSION:
            raise DamagedShardError(f"{path.name} has the layout of another version")
        return ShardHead(Status(str(head["status"])), Toolchain.of_text(str(head["toolchain"])))
    except UNREADABLE as error:
        raise DamagedShardError(f"{path.name} does not hold a case: {error}") from error


def read_shard(path: Path, case: Case) -> CaseOutcome:
    """The outcome stored in a shard, at the place that the case has in its study.

    Raises
    ------
    DamagedShardError
        when the content does not match the name, or it is another case.
    """
    try:
        outcome = harvest_case(unpack_tree(_proven_image(path)), case.index)
    except UNREADABLE as error:
        raise DamagedShardError(f"{path.name} does not hold a case: {error}") from error
    if outcome.case_id != case.id or canonical_json(outcome.inputs) != canonical_json(case.inputs):
        raise DamagedShardError(f"{path.name} holds another case")
    return replace(outcome, inputs=case.inputs)  # equal, and held once


def take_inventory(folder: Path) -> ShardInventory:
    """What stands in a directory of shards, by names alone."""
    paths: defaultdict[str, list[Path]] = defaultdict(list)
    foreign, leftovers = [], []
    for path in sorted(folder.glob("*/*")) if folder.is_dir() else []:
        named = NAME.fullmatch(path.name)
        if named and path.parent.name == named["case"][:2]:
            paths[named["case"]].append(path)
        elif path.name.startswith(TEMPORARY_PREFIX):
            leftovers.append(path)
        else:
            foreign.append(path)
    return ShardInventory({case: tuple(found) for case, found in paths.items()}, tuple(foreign), tuple(leftovers))


def _proven_image(path: Path) -> bytes:
    try:
        image = path.read_bytes()
    except OSError as error:
        raise UnreadableShardError(f"{path.name} cannot be read: {error.strerror}") from error
    named = NAME.fullmatch(path.name)
    if named is None or _digest(image) != named["digest"]:
        raise DamagedShardError(f"{path.name} is damaged")
    return image


def _digest(image: bytes) -> str:
    return hashlib.sha256(image).hexdigest()[:16]

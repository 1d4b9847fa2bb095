"""Trees as bytes that only this program opens: a JSON head of names, types and places, then the numbers as they lie.

A case has some eighty small arrays. HDF5 takes five milliseconds to lay them into a file and seven to find them again;
this takes a twentieth of that, and a run of many cases is not kept waiting by its own bookkeeping.
"""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np

from magbear_cli.store.layout import Field
from magbear_cli.store.tree import Branch, Leaf

MAGIC = b"magbear\n"
HEAD = struct.Struct(">8sQ")  # the magic word, and the length of the JSON head in bytes
ALIGNMENT_BYTES = 16  # of a complex number


def pack_tree(root: Branch) -> bytes:
    """The bytes that hold this tree; the same for equal trees, descriptions are left out."""
    blocks: list[bytes] = []
    head = json.dumps(_told(root, blocks, [0]), separators=(",", ":"), ensure_ascii=True).encode("ascii")
    head += b" " * (-(HEAD.size + len(head)) % ALIGNMENT_BYTES)
    return b"".join([HEAD.pack(MAGIC, len(head)), head, *blocks])


def unpack_tree(image: bytes) -> Branch:
    """The tree that these bytes hold.

    Raises
    ------
    ValueError, KeyError, TypeError
        when they hold none.
    """
    head, start = _head(image)
    return _found(head, image, start)


def unpack_attributes(image: bytes) -> dict[str, str | int]:
    """The attributes of the root alone.

    Raises
    ------
    ValueError, KeyError
        when the bytes hold no tree.
    """
    return dict(_head(image)[0]["attributes"])


def _told(branch: Branch, blocks: list[bytes], place: list[int]) -> dict[str, Any]:
    """What the head says of a branch; the numbers go to the blocks, each at a multiple of the alignment."""
    children: dict[str, Any] = {}
    for name, child in branch.children.items():
        if isinstance(child, Branch):
            children[name] = _told(child, blocks, place)
            continue
        content = np.ascontiguousarray(child.values).tobytes()
        children[name] = [child.values.dtype.str, list(child.values.shape), place[0]]
        content += bytes(-len(content) % ALIGNMENT_BYTES)
        blocks.append(content)
        place[0] += len(content)
    return {"attributes": dict(branch.attributes), "children": children}


def _head(image: bytes) -> tuple[dict[str, Any], int]:
    if len(image) < HEAD.size:
        raise ValueError("it is too short")
    magic, length = HEAD.unpack_from(image)
    if magic != MAGIC:
        raise ValueError("it does not begin as one of magbear's files")
    start = HEAD.size + length
    head = json.loads(image[HEAD.size : start])
    if not isinstance(head, dict):
        raise ValueError("its head is no object")  # noqa: TRY004 - the bytes are wrong, not the argument's type
    return head, start


def _found(told: dict[str, Any], image: bytes, start: int) -> Branch:
    children: dict[str, Leaf | Branch] = {}
    for name, child in told["children"].items():
        if isinstance(child, dict):
            children[name] = _found(child, image, start)
            continue
        dtype, shape, place = np.dtype(child[0]), tuple(child[1]), start + child[2]
        count = int(np.prod(shape, dtype=np.int64))
        values = np.frombuffer(image, dtype, count, place) if count else np.zeros(0, dtype)
        children[name] = Leaf(values.reshape(shape).copy(), Field(name, ""))
    return Branch(children, told["attributes"])

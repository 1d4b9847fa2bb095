"""Outcomes as trees of described arrays, and back: what is stored, free of any file format."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magbear_cli.store.layout import COUNTED_AXES, Field, Group, Kind
from magbear_cli.study.plan import canonical_json

Array = NDArray[Any]

DTYPES = {Kind.NUMBER: np.float64, Kind.INTEGER: np.int64, Kind.FLAG: np.uint8}
MISSING: dict[Kind, object] = {Kind.NUMBER: float("nan"), Kind.INTEGER: -1, Kind.FLAG: 0, Kind.TEXT: ""}


@dataclass(frozen=True)
class Leaf:
    """An array with the field that describes it; text as zero-padded UTF-8 of one length."""

    values: Array
    field: Field


@dataclass(frozen=True)
class Branch:
    """Named leaves and branches, in the order in which they are stored, with attributes of the group itself."""

    children: Mapping[str, Leaf | Branch]
    attributes: Mapping[str, str | int] = field(default_factory=dict)

    def branch(self, name: str) -> Branch:
        """The branch of this name.

        Raises
        ------
        KeyError
            when there is none.
        """
        child = self.children[name]
        if not isinstance(child, Branch):
            raise KeyError(name)
        return child

    def leaf(self, name: str) -> Leaf:
        """The leaf of this name.

        Raises
        ------
        KeyError
            when there is none.
        """
        child = self.children[name]
        if not isinstance(child, Leaf):
            raise KeyError(name)
        return child


def grow_group(group: Group, source: object) -> Branch:
    """The branch of an object that a group describes; attributes that are None are left out."""
    values = {entry.name: getattr(source, entry.name) for entry in group.fields}
    attributes = {"NX_class": "NXdata", "signal": group.signal, "axes": " ".join(group.axes)} if group.signal else None
    return grow_fields(group.fields, values, attributes)


def grow_fields(
    fields: Sequence[Field], values: Mapping[str, object], attributes: Mapping[str, str] | None = None
) -> Branch:
    """The branch of named values, with a counted coordinate for every axis that has no measured one."""
    leaves = {
        entry.name: Leaf(encode(values[entry.name], entry), _as_stored(entry))
        for entry in fields
        if values[entry.name] is not None
    }
    lengths = {
        axis: leaf.values.shape[place]
        for leaf in leaves.values()
        for place, axis in enumerate(leaf.field.axes)
        if axis not in leaves
    }
    counted = {
        axis: Leaf(np.arange(1, length + 1), Field(axis, COUNTED_AXES[axis], "1", (axis,), Kind.INTEGER))
        for axis, length in lengths.items()
    }
    return Branch({**counted, **leaves}, dict(attributes or {"NX_class": "NXcollection"}))


def harvest_fields(fields: Sequence[Field], branch: Branch) -> dict[str, Any]:
    """The values of a branch by name; None where one was left out."""
    return {
        entry.name: decode(branch.leaf(entry.name).values, entry) if entry.name in branch.children else None
        for entry in fields
    }


def lifted(fields: Sequence[Field], columns: Mapping[str, Sequence[object]], axis: str) -> Branch:
    """The branch of a table: each field becomes a column, with the mark of its kind where a cell is None."""
    cells = {
        entry.name: [MISSING[entry.kind] if cell is None else cell for cell in columns[entry.name]] for entry in fields
    }
    return grow_fields([replace(entry, axes=(axis,)) for entry in fields], cells)


def content_digest(branch: Branch) -> str:
    """The SHA-256 of every name, type, shape and number below a branch, in the order of the names; no descriptions."""
    digest = hashlib.sha256()
    for name, child in sorted(branch.children.items()):
        if isinstance(child, Branch):
            digest.update(f"{name}/{content_digest(child)}\n".encode("ascii"))
        else:
            values = np.ascontiguousarray(child.values)
            digest.update(f"{name} {values.dtype.str} {child.values.shape}\n".encode("ascii"))
            digest.update(values.tobytes())
    return digest.hexdigest()


def encode(value: object, entry: Field) -> Array:
    """The array that stands for a value of this field."""
    if entry.kind is Kind.JSON:
        return _text_array(canonical_json(value))
    if entry.kind is Kind.TEXT:
        return _text_array(value)
    if entry.kind is Kind.COMPLEX:
        # a type of pairs would be read by some programs only: Octave takes h5py's for zeros, without a word
        numbers = np.asarray(value, dtype=np.complex128)
        return np.ascontiguousarray(numbers).view(np.float64).reshape((*numbers.shape, 2))
    return np.asarray(value, dtype=DTYPES[entry.kind], order="C")


def decode(values: Array, entry: Field) -> Any:  # noqa: ANN401 - the value may be anything a field may hold
    """The value that an array stands for: the inverse of ``encode``."""
    if entry.kind in {Kind.TEXT, Kind.JSON}:
        texts = [bytes(item).decode("utf-8") for item in np.atleast_1d(values)]
        if entry.kind is Kind.JSON:
            return json.loads(texts[0])
        return texts if entry.axes else texts[0]
    if entry.kind is Kind.COMPLEX:
        return np.ascontiguousarray(values, dtype=np.float64).view(np.complex128)[..., 0]
    if entry.axes:
        return np.asarray(values, dtype=DTYPES[entry.kind])
    return bool(values) if entry.kind is Kind.FLAG else values.item()


def _as_stored(entry: Field) -> Field:
    """The field as its array has it: complex numbers with an axis more."""
    return replace(entry, axes=(*entry.axes, "part")) if entry.kind is Kind.COMPLEX else entry


def _text_array(value: object) -> Array:
    """Fixed-length UTF-8; zeros inside a text, which would end it, are spelled out."""
    items = [_encoded(item) for item in ([value] if isinstance(value, str) else value)]  # type: ignore[attr-defined]
    array = np.asarray(items, dtype=f"S{max([1, *map(len, items)])}")
    return array.reshape(()) if isinstance(value, str) else array


def _encoded(text: str) -> bytes:
    return text.replace("\x00", "\\x00").encode("utf-8", "backslashreplace")

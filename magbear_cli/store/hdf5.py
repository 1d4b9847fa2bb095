"""Trees as HDF5 files and back: the same trees give the same bytes, which any HDF5 reader understands.

The library writes through a file of ours, because it takes the process down when a disk is full. Nothing that changes
from run to run (times, hosts, pids) enters a file. A case has some eighty small datasets, for which h5py's low-level
interface is three times as fast as its other one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from types import TracebackType
from typing import Self

import h5py
import numpy as np
from h5py import h5a, h5d, h5ds, h5g, h5o, h5p, h5s, h5t

from magbear_cli.store.durable import WholeFile
from magbear_cli.store.layout import Field, Kind
from magbear_cli.store.tree import Array, Branch, Leaf

SMALLEST_COMPRESSED_BYTES = 4096  # a chunk index costs more than it saves below
DEFLATE_LEVEL = 4


class FileWriter:
    """An HDF5 file that grows branch by branch; whatever was added is no longer in memory.

    The bytes go to an open file of ours, whose refusals are noted there and looked at after each branch.
    """

    def __init__(self, file: WholeFile) -> None:
        """Begin an empty file."""
        self._file = file
        self._hdf5 = h5py.File(file, "w")

    def add(self, name: str, branch: Branch) -> None:
        """Put a branch below the root.

        Raises
        ------
        OSError
            when the system refused bytes; the file is then of no use.
        """
        try:
            _write_branch(h5g.create(self._hdf5["/"].id, name.encode("ascii")), branch)
        finally:
            self._file.look_for_refusal()  # which says more than the library that stumbled over it

    def close(self, attributes: Mapping[str, str | int]) -> None:
        """Say what the file is and let go of it."""
        for name, value in attributes.items():
            _write_attribute(self._hdf5["/"].id, name, value)
        self.discard()

    def discard(self) -> None:
        """Let go of the file as it is; twice is as good as once."""
        self._hdf5.close()


def is_hdf5(path: Path) -> bool:
    """Whether the file begins as HDF5 files do."""
    return bool(h5py.is_hdf5(path))


class FileReader:
    """An open HDF5 file, read branch by branch, without HDF5's own locks, which network file systems may not have.

    A context manager. Whatever is asked of it raises OSError, KeyError, RuntimeError or ValueError when the file is
    missing or is not a readable HDF5 file.
    """

    def __init__(self, path: Path) -> None:
        """Open the file."""
        self._hdf5 = h5py.File(path, "r", locking=False)

    def __enter__(self) -> Self:
        """Give the reader."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file."""
        self._hdf5.close()

    def attributes(self) -> dict[str, str | int]:
        """What the file says of itself."""
        return dict(_read_attributes(self._hdf5["/"].id))

    def names(self) -> list[str]:
        """The names below the root."""
        return [name.decode("ascii") for name in self._hdf5["/"].id]

    def branch(self, name: str) -> Branch:
        """The branch of this name."""
        group = h5o.open(self._hdf5["/"].id, name.encode("ascii"))
        if not isinstance(group, h5g.GroupID):
            raise KeyError(name)
        return _read_branch(group)


def _write_branch(group: h5g.GroupID, branch: Branch) -> None:
    for name, value in branch.attributes.items():
        _write_attribute(group, name, value)
    leaves = {name: leaf for name, leaf in branch.children.items() if isinstance(leaf, Leaf)}
    datasets = {name: _write_values(group, name, leaf.values) for name, leaf in leaves.items()}
    for name, leaf in leaves.items():
        _describe(datasets[name], leaf.field)
    for name, leaf in leaves.items():
        _attach_axes(datasets, name, leaf.field.axes)
    for name, child in branch.children.items():
        if isinstance(child, Branch):
            _write_branch(h5g.create(group, name.encode("ascii")), child)


def _write_values(group: h5g.GroupID, name: str, values: Array) -> h5d.DatasetID:
    is_chunked = values.ndim > 0 and values.nbytes >= SMALLEST_COMPRESSED_BYTES
    storage = _storage(values.shape if is_chunked else ())
    file_type = _file_type(values)
    dataset = h5d.create(group, name.encode("ascii"), file_type, _space(values.shape), storage)
    if values.size:
        dataset.write(h5s.ALL, h5s.ALL, values, file_type)
    return dataset


def _describe(dataset: h5d.DatasetID, entry: Field) -> None:
    _write_attribute(dataset, "long_name", entry.long_name)
    if entry.kind not in {Kind.TEXT, Kind.JSON}:
        _write_attribute(dataset, "units", entry.unit)
    if entry.kind is Kind.FLAG:
        _write_attribute(dataset, "flag_values", np.array([0, 1], dtype=np.uint8))
        _write_attribute(dataset, "flag_meanings", "false true")
    if entry.axes == (entry.name,):
        h5ds.set_scale(dataset, entry.name.encode("ascii"))


def _attach_axes(datasets: Mapping[str, h5d.DatasetID], name: str, axes: tuple[str, ...]) -> None:
    if axes != (name,):
        for place, axis in enumerate(axes):
            h5ds.attach_scale(datasets[name], datasets[axis], place)


def _file_type(values: Array) -> h5t.TypeID:
    """The type in the file. Text is declared ASCII although its bytes are UTF-8.

    Octave gives up the whole file at the first text that is declared UTF-8, and reads its bytes where it is not.
    """
    return _type_of(values.dtype) if values.dtype.kind != "S" else _text_type(values.dtype.itemsize)


def _write_attribute(owner: h5g.GroupID | h5d.DatasetID, name: str, value: str | int | Array) -> None:
    array = np.asarray(value.encode("ascii") if isinstance(value, str) else value)
    file_type = _file_type(array)
    h5a.create(owner, name.encode("ascii"), file_type, _space(array.shape)).write(array, file_type)


@lru_cache(maxsize=256)
def _type_of(dtype: np.dtype[np.generic]) -> h5t.TypeID:
    return h5t.py_create(dtype, logical=True)


@lru_cache(maxsize=256)
def _text_type(length: int) -> h5t.TypeID:
    return h5t.py_create(h5py.string_dtype("ascii", length), logical=True)


@lru_cache(maxsize=256)
def _space(shape: tuple[int, ...]) -> h5s.SpaceID:
    return h5s.create_simple(shape) if shape else h5s.create(h5s.SCALAR)


@lru_cache(maxsize=256)
def _storage(chunk: tuple[int, ...]) -> h5p.PropDCID:
    """How a dataset lies in the file: small ones in one piece, others as one compressed and checked chunk."""
    properties = h5p.create(h5p.DATASET_CREATE)
    properties.set_obj_track_times(False)
    if chunk:
        properties.set_chunk(chunk)
        properties.set_shuffle()
        properties.set_deflate(DEFLATE_LEVEL)
        properties.set_fletcher32()
    return properties


def _read_branch(group: h5g.GroupID) -> Branch:
    children: dict[str, Leaf | Branch] = {}
    for raw_name in group:
        name, child = raw_name.decode("ascii"), h5o.open(group, raw_name)
        if isinstance(child, h5g.GroupID):
            children[name] = _read_branch(child)
        else:
            values = np.zeros(child.shape, dtype=child.dtype)
            if values.size:
                child.read(h5s.ALL, h5s.ALL, values, child.get_type())
            children[name] = Leaf(values, Field(name, ""))
    return Branch(children, dict(_read_attributes(group)))


def _read_attributes(group: h5g.GroupID) -> Iterator[tuple[str, str | int]]:
    for place in range(h5a.get_num_attrs(group)):
        attribute = h5a.open(group, index=place)
        value = np.zeros(attribute.shape, dtype=attribute.dtype)
        attribute.read(value)
        yield attribute.name.decode("ascii"), value.item().decode("ascii") if value.dtype.kind == "S" else value.item()

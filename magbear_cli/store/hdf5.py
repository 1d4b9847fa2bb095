"""Trees as HDF5 images and back: the same tree gives the same bytes, which any HDF5 reader understands.

An image is built in memory and written by the system's own calls, because the HDF5 library takes the process down when
a disk is full. Nothing that changes from run to run (times, hosts, pids) enters an image. A case has some eighty small
datasets, for which h5py's low-level interface is three times as fast as its other one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path

import h5py
import numpy as np
from h5py import h5a, h5d, h5ds, h5g, h5o, h5p, h5s, h5t

from magbear_cli.store.layout import Field, Kind
from magbear_cli.store.tree import Array, Branch, Leaf

SMALLEST_COMPRESSED_BYTES = 1024  # a chunk index costs more than it saves below
DEFLATE_LEVEL = 4


def build_image(root: Branch, *, is_described: bool = True) -> bytes:
    """The bytes of an HDF5 file that holds this tree.

    Without descriptions (units, meanings, dimension scales, compression) it is built five times as fast and still reads
    back the same: enough for a file that only this program opens.
    """
    with h5py.File("image", "w", driver="core", backing_store=False) as file:
        _write_branch(file["/"].id, root, is_described=is_described)
        file.flush()  # the image is what was flushed
        image: bytes = file.id.get_file_image()
    return image


def read_image(image: bytes) -> Branch:
    """The tree of an HDF5 file held in memory.

    Raises
    ------
    OSError, KeyError, RuntimeError, ValueError
        when the bytes are not a readable HDF5 file.
    """
    with h5py.File(h5py.h5f.open_file_image(image)) as file:
        return _read_branch(file["/"].id)


def read_image_attributes(image: bytes) -> dict[str, str | int]:
    """The attributes of the root alone, for those who need not see the whole tree.

    Raises
    ------
    OSError, KeyError, RuntimeError, ValueError
        when the bytes are not a readable HDF5 file.
    """
    with h5py.File(h5py.h5f.open_file_image(image)) as file:
        return dict(_read_attributes(file["/"].id))


def is_hdf5(path: Path) -> bool:
    """Whether the file begins as HDF5 files do."""
    return bool(h5py.is_hdf5(path))


def read_file(path: Path) -> Branch:
    """The tree of an HDF5 file, read without taking HDF5's own locks, which network file systems may not have.

    Raises
    ------
    OSError, KeyError, RuntimeError, ValueError
        when the file is missing or is not a readable HDF5 file.
    """
    with h5py.File(path, "r", locking=False) as file:
        return _read_branch(file["/"].id)


def _write_branch(group: h5g.GroupID, branch: Branch, *, is_described: bool) -> None:
    for name, value in branch.attributes.items():
        _write_attribute(group, name, value)
    leaves = {name: leaf for name, leaf in branch.children.items() if isinstance(leaf, Leaf)}
    datasets = {
        name: _write_values(group, name, leaf.values, is_compressed=is_described) for name, leaf in leaves.items()
    }
    if is_described:
        for name, leaf in leaves.items():
            _describe(datasets[name], leaf.field)
        for name, leaf in leaves.items():
            _attach_axes(datasets, name, leaf.field.axes)
    for name, child in branch.children.items():
        if isinstance(child, Branch):
            _write_branch(h5g.create(group, name.encode("ascii")), child, is_described=is_described)


def _write_values(group: h5g.GroupID, name: str, values: Array, *, is_compressed: bool) -> h5d.DatasetID:
    is_chunked = is_compressed and values.ndim > 0 and values.nbytes >= SMALLEST_COMPRESSED_BYTES
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
    """The type in the file: text is declared ASCII where it is, for the readers that know nothing else."""
    if values.dtype.kind != "S":
        return _type_of(values.dtype)
    is_ascii = all(bytes(item).isascii() for item in np.atleast_1d(values))
    return _text_type("ascii" if is_ascii else "utf-8", values.dtype.itemsize)


def _write_attribute(owner: h5g.GroupID | h5d.DatasetID, name: str, value: str | int | Array) -> None:
    array = np.asarray(value.encode("ascii") if isinstance(value, str) else value)
    file_type = _file_type(array)
    h5a.create(owner, name.encode("ascii"), file_type, _space(array.shape)).write(array, file_type)


@lru_cache(maxsize=256)
def _type_of(dtype: np.dtype[np.generic]) -> h5t.TypeID:
    return h5t.py_create(dtype, logical=True)


@lru_cache(maxsize=256)
def _text_type(encoding: str, length: int) -> h5t.TypeID:
    return h5t.py_create(h5py.string_dtype(encoding, length), logical=True)


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

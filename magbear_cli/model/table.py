"""A table of numbers that a method has to show beside its controller: named columns, each with its unit and meaning."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError

Floats = NDArray[np.float64]

_NAME = re.compile(r"[a-z][a-z0-9_]*")
_TAKEN = ("title", "columns")  # what stands beside the columns in a results file


@dataclass(frozen=True, eq=False)
class Column:
    """One quantity of a table.

    Attributes
    ----------
    name : lower case; ends in the unit when there is one, as ``omega_rad_s``
    values : (rows,), NaN where a cell is empty
    unit : of the values, ``1`` for a plain number; ASCII
    long_name : what the quantity is, in a few words; ASCII
    """

    name: str
    values: Floats
    unit: str
    long_name: str

    def __post_init__(self) -> None:
        """Refuse a name that no file could hold and values that are no column."""
        if not _NAME.fullmatch(self.name) or self.name in _TAKEN:
            raise NumericsError(f"a column's name is lower case letters, digits and _, not {self.name!r}")
        if not (self.unit.isascii() and self.long_name.isascii()):
            raise NumericsError(f"column {self.name} is described in letters that not every reader knows")
        if np.ndim(self.values) != 1:
            raise NumericsError(f"column {self.name} has {np.ndim(self.values)} axes instead of one")


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of equal length; the first is what the others are drawn over.

    Attributes
    ----------
    columns : in their order, at least one
    long_name : what the table shows, in a few words
    """

    columns: tuple[Column, ...]
    long_name: str

    def __post_init__(self) -> None:
        """Refuse a table without columns, with two of a name, or of different lengths."""
        names = [column.name for column in self.columns]
        if not names or len(set(names)) < len(names):
            raise NumericsError(f"a table needs columns of different names, not {names}")
        if len({np.size(column.values) for column in self.columns}) > 1:
            raise NumericsError(f"the columns {', '.join(names)} differ in length")

    def __getitem__(self, name: str) -> Floats:
        """The values of a column.

        Raises
        ------
        KeyError
            when there is no column of that name.
        """
        for column in self.columns:
            if column.name == name:
                return column.values
        raise KeyError(name)

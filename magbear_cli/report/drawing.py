"""A figure with all that stands around it: its name, what it shows in words, and the numbers behind it."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Drawing:
    """One figure of the report.

    Attributes
    ----------
    name : of its files, without a suffix
    title : what it is, in a few words
    caption : how to read it, for everybody
    alt : what there is to see in it, for those who do not see it
    columns : the numbers behind it, columns of equal length; together they rebuild every curve
    case_id : the case it belongs to; None when it is about several
    """

    name: str
    title: str
    caption: str
    alt: str
    figure: Figure
    columns: Mapping[str, Sequence[object]]
    case_id: str | None = None


def csv_bytes(columns: Mapping[str, Sequence[object]]) -> bytes:
    """The columns as CSV: a header, floats with all their digits, empty where there is nothing."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(columns)
    for row in zip(*columns.values(), strict=True):
        writer.writerow([_cell(value) for value in row])
    return buffer.getvalue().encode("utf-8")


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, float | np.floating):
        return repr(float(value))
    text = str(value)
    # A spreadsheet would compute a cell that begins with one of these.
    return f"'{text}" if text.startswith(("=", "+", "-", "@")) and isinstance(value, str) else text


def stacked(tables: Sequence[Mapping[str, Sequence[object]]]) -> dict[str, list[object]]:
    """Tables with the same columns, one under the other."""
    names = list(tables[0]) if tables else []
    return {name: [value for table in tables for value in table[name]] for name in names}

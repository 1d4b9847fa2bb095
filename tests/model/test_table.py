"""Tables are refused unless every reader could make sense of them."""

from __future__ import annotations

import numpy as np
import pytest

from magbear_cli.errors import NumericsError
from magbear_cli.model.table import Column, Table


def column(name: str = "gain", rows: int = 3, unit: str = "A/m") -> Column:
    """A column of ascending numbers."""
    return Column(name, np.arange(rows, dtype=float), unit, "the gain")


def test_a_column_is_found_by_its_name() -> None:
    """The values come back by name, and a name that is not there is said to be missing."""
    table = Table((column(), column("loss")), "what is gained")
    assert table["loss"].tolist() == [0.0, 1.0, 2.0]
    with pytest.raises(KeyError):
        _ = table["nothing"]


@pytest.mark.parametrize("name", ["Gain", "2nd", "a b", "", "title", "columns"])
def test_a_name_no_file_could_hold_is_refused(name: str) -> None:
    """Names are lower case and none of those that a results file uses itself."""
    with pytest.raises(NumericsError):
        column(name)


def test_shapes_and_descriptions_are_looked_at() -> None:
    """Two axes, a unit in other letters, unequal lengths and a name that stands twice are refused."""
    with pytest.raises(NumericsError):
        Column("gain", np.zeros((2, 2)), "1", "the gain")
    with pytest.raises(NumericsError):
        column(unit="µm")
    with pytest.raises(NumericsError):
        Table((column(), column("loss", rows=2)), "unequal")
    with pytest.raises(NumericsError):
        Table((column(), column()), "twice")

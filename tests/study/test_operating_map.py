"""The force surface and the range of masses that is like a range of operating points."""

from __future__ import annotations

import numpy as np
import pytest

from magbear_cli.errors import NumericsError
from magbear_cli.model.bearing import Bearing, CurrentLaw, magnetic_force
from magbear_cli.study.operating_map import map_operating_range

BEARING = Bearing(400e-6, 4e-6, 0.5, CurrentLaw.HALF_SWITCHED)


def options(position: list[float], current: list[float]) -> dict[str, object]:
    """The options of the method."""
    return {"position_m": position, "current_a": current, "low_kg": 3.0, "points": 5}


def test_the_surface_is_the_force_law() -> None:
    """Every row is a point of the force law, and the corners are there."""
    _, tables = map_operating_range(BEARING, options([-2e-4, 2e-4], [-3.0, 3.0]))
    surface = tables["force_surface"]
    assert surface["position_m"].size == 25
    assert surface["force_n"] == pytest.approx(
        magnetic_force(BEARING, surface["position_m"], surface["current_a"]), rel=1e-12
    )
    assert surface["force_n"].max() == pytest.approx(4e-6 * (2.0 / 2e-4) ** 2, rel=1e-9)


def test_a_side_without_extent_is_one_point() -> None:
    """A range of currents that is one current gives one row a position."""
    statistics, tables = map_operating_range(BEARING, options([0.0, 1e-4], [0.0, 0.0]))
    assert tables["force_surface"]["current_a"].tolist() == [0.0] * 5
    assert statistics["equivalent_mass_uncertainty_kg"] == pytest.approx(1.3236, rel=1e-3)
    assert statistics["least_stiffness_n_per_m"] < statistics["largest_stiffness_n_per_m"]


def test_a_range_beyond_the_gap_is_refused() -> None:
    """With the sentence of the force law."""
    with pytest.raises(NumericsError):
        map_operating_range(BEARING, options([0.0, 5e-4], [0.0, 0.0]))
    assert np.isfinite(map_operating_range(BEARING, options([0.0, 0.0], [0.0, 3.0]))[0]["largest_stiffness_n_per_m"])

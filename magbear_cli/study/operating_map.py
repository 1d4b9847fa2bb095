"""What a range of operating points does to a bearing: its force surface, and the mass range that is like it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from magbear_cli.model.bearing import Bearing, magnetic_force
from magbear_cli.model.operating_range import OperatingRange, equivalent_mass_uncertainty, stiffness_range
from magbear_cli.model.table import Column, Table


def map_operating_range(bearing: Bearing, options: Mapping[str, Any]) -> tuple[dict[str, float], dict[str, Table]]:
    """Statistics and the force surface of the method ``operating_range`` (thesis sections 4.2 and 4.3).

    Raises
    ------
    NumericsError
        when the range leaves the gap.
    """
    box = OperatingRange(tuple(options["position_m"]), tuple(options["current_a"]))
    least, largest = stiffness_range(bearing, box)
    statistics = {
        "least_stiffness_n_per_m": least,
        "largest_stiffness_n_per_m": largest,
        "equivalent_mass_uncertainty_kg": equivalent_mass_uncertainty(bearing, box, options["low_kg"]),
    }
    return statistics, {"force_surface": _surface(bearing, box, int(options["points"]))}


def _surface(bearing: Bearing, box: OperatingRange, points: int) -> Table:
    """The force over the box, positions slowest; a side without extent is one point."""
    sides = [np.linspace(low, high, points if low < high else 1) for low, high in (box.position_m, box.current_a)]
    position, current = (side.ravel() for side in np.meshgrid(*sides, indexing="ij"))
    return Table(
        (
            Column("position_m", position, "m", "rotor position"),
            Column("current_a", current, "A", "control current"),
            Column("force_n", magnetic_force(bearing, position, current), "N", "magnetic force"),
        ),
        "Magnetic force over position and current",
    )

"""The equivalent mass uncertainty is that of Table 4.1, and the extremes of the stiffness are extremes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.errors import NumericsError
from magbear_cli.model.bearing import Bearing, CurrentLaw, linearization
from magbear_cli.model.operating_range import OperatingRange, equivalent_mass_uncertainty, stiffness_range

HALF = Bearing(400e-6, 4e-6, 0.5, CurrentLaw.HALF_SWITCHED)


@pytest.mark.parametrize(
    ("position_m", "current_a", "width_kg"),
    [(100e-6, 0, 1.32), (150e-6, 0, 3.72), (200e-6, 0, 9.44), (0, 1, 3.0), (0, 2, 10.5), (0, 3, 21.0)],
)
def test_table_4_1(position_m: float, current_a: float, width_kg: float) -> None:
    """The widths of Table 4.1 to their printed digits; the last row, misprinted there, is 21 kg."""
    operating_range = OperatingRange((0.0, position_m), (0.0, current_a))
    assert equivalent_mass_uncertainty(HALF, operating_range) == pytest.approx(width_kg, abs=0.006)


@settings(deadline=None, max_examples=40)
@given(
    st.sampled_from(list(CurrentLaw)),
    st.tuples(st.floats(-300e-6, 300e-6), st.floats(-300e-6, 300e-6)),
    st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)),
    st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)),
)
def test_every_stiffness_of_the_box_is_in_the_range(
    law: CurrentLaw, positions: tuple[float, float], currents: tuple[float, float], inside: tuple[float, float]
) -> None:
    """No point of the box has a stiffness outside the range given for it."""
    bearing = Bearing(400e-6, 4e-6, 0.5, law)
    box = OperatingRange((min(positions), max(positions)), (min(currents), max(currents)))
    least, largest = stiffness_range(bearing, box)
    z, u = (
        low + part * (high - low) for part, (low, high) in zip(inside, (box.position_m, box.current_a), strict=True)
    )
    stiffness = linearization(bearing, z, u).negative_stiffness_n_per_m
    assert least * (1 - 1e-6) <= stiffness <= largest * (1 + 1e-9)


def test_least_stiffness_is_taken() -> None:
    """On a dense grid the least stiffness is met, not only bounded."""
    box = OperatingRange((-200e-6, 250e-6), (-0.4, 3.0))
    grid = min(
        linearization(HALF, z, u).negative_stiffness_n_per_m
        for z in np.linspace(*box.position_m, 181)
        for u in np.linspace(*box.current_a, 171)
    )
    assert stiffness_range(HALF, box)[0] == pytest.approx(grid, rel=1e-3)


def test_a_point_has_no_uncertainty() -> None:
    """A range of one point is worth no mass."""
    assert equivalent_mass_uncertainty(HALF, OperatingRange((1e-4, 1e-4), (0.5, 0.5))) == 0.0


def test_a_box_turned_inside_out_is_refused() -> None:
    """Low above high ends in a sentence."""
    with pytest.raises(NumericsError, match="low <= high"):
        OperatingRange((1e-4, 0.0), (0.0, 0.0))

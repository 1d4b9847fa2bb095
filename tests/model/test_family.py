"""A family of plants between two ends: what lies between them, and that nothing of the box lies outside."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.errors import NumericsError
from magbear_cli.model.family import NOMINAL, Plant, PlantFamily

Range = tuple[float, float]
RANGES = st.tuples(st.floats(0.5, 1.0), st.floats(1.0, 2.0))


def family(mass: Range, stiffness: Range = (1.0, 1.0), current: Range = (1.0, 1.0)) -> PlantFamily:
    """Ranges as factors of 3.6 kg, 62.5 kN/m and 50 N/A."""
    return PlantFamily.of_ranges(
        (3.6 * mass[0], 3.6 * mass[1]),
        (62_500.0 * stiffness[0], 62_500.0 * stiffness[1]),
        (50.0 * current[0], 50.0 * current[1]),
    )


def test_the_nominal_mass_of_the_thesis_is_the_middle_of_the_inverse() -> None:
    """For 3.0-4.5 kg the nominal mass is 3.6 kg and the deviation of 1/m is 5.556e-2 (thesis table 2.2)."""
    known = (62_500.0, 62_500.0), (50.0, 50.0)
    found = PlantFamily.of_ranges((3.0, 4.5), *known)
    assert found.nominal.mass_kg == pytest.approx(3.6, rel=1e-12)
    assert found.spread == pytest.approx((62_500.0 * 5.5556e-2, 50.0 * 5.5556e-2), rel=1e-4)
    assert found.relative_spread == pytest.approx(0.2)
    assert found.is_known_at_rest


@settings(deadline=None, max_examples=60)
@given(RANGES, RANGES, RANGES, st.floats(-1, 6), st.tuples(*[st.floats(0, 1)] * 3))
def test_no_plant_of_the_box_lies_outside(
    mass: Range, stiffness: Range, current: Range, exponent: float, place: tuple[float, float, float]
) -> None:
    """At every frequency ρ of any plant of the box lies between those of the ends."""
    found, omega = family(mass, stiffness, current), 10.0**exponent
    m, k_z, k_i = (
        low + share * (high - low) for (low, high), share in zip((mass, stiffness, current), place, strict=True)
    )
    rho = (3.6 * m * omega**2 + 62_500.0 * k_z) / (50.0 * k_i)
    low, high = (float(found.current_per_displacement(omega, share)) for share in (0.0, 1.0))
    assert low * (1 - 1e-12) <= rho <= high * (1 + 1e-12)
    pole = np.sqrt(62_500.0 * k_z / (3.6 * m))
    assert found.pole_range[0] * (1 - 1e-12) <= pole <= found.pole_range[1] * (1 + 1e-12)


@settings(deadline=None, max_examples=60)
@given(RANGES, RANGES, RANGES, st.floats(0, 1), st.floats(-1, 6))
def test_a_member_by_its_parameters_is_the_member(
    mass: Range, stiffness: Range, current: Range, share: float, exponent: float
) -> None:
    """Mass and stiffnesses of a member lie in the box and give its ρ, which moves from one end to the other."""
    found, omega = family(mass, stiffness, current), 10.0**exponent
    member = found.member(share)
    for low, value, high in (
        (mass[0], member.mass_kg / 3.6, mass[1]),
        (stiffness[0], member.negative_stiffness_n_per_m / 62_500.0, stiffness[1]),
        (current[0], member.current_stiffness_n_per_a / 50.0, current[1]),
    ):
        assert low * (1 - 1e-9) <= value <= high * (1 + 1e-9)
    own = PlantFamily.of_one(member).current_per_displacement(omega, 0.0)
    assert own == pytest.approx(float(found.current_per_displacement(omega, share)), rel=1e-9)
    along = found.current_per_displacement(omega, np.linspace(0.0, 1.0, 9))
    assert (np.diff(along) >= -1e-12 * along[1:]).all()


def test_the_ends_are_exact_and_the_middle_is_the_nominal_plant() -> None:
    """The ends are corners of the box; shares count from the first to the last."""
    found = family((0.8, 1.2), (0.9, 1.3), (0.7, 1.0))
    assert found.member(0.0) is found.first
    assert found.member(1.0) is found.last
    assert found.first == Plant(3.6 * 0.8, 62_500.0 * 0.9, 50.0 * 1.0)
    assert found.last == Plant(3.6 * 1.2, 62_500.0 * 1.3, 50.0 * 0.7)
    assert found.nominal == found.member(NOMINAL)
    assert not found.is_known_at_rest
    assert list(found.shares(3)) == list(found.shown_shares()) == [0.0, 0.5, 1.0]


def test_a_known_plant_is_a_family_of_one() -> None:
    """One end, one share, no spread."""
    found = PlantFamily.of_one(Plant(2.0, 100.0, 3.0))
    assert found.is_fixed
    assert found.ends == (found.nominal,)
    assert list(found.shares(9)) == [0.0]
    assert found.spread == (0.0, 0.0)
    assert found.relative_spread == 0.0


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (2.0, 1.0), (-1.0, 1.0), (1.0, np.inf), (np.nan, 1.0)])
def test_a_range_that_is_none_is_refused(low: float, high: float) -> None:
    """Every range needs 0 < low <= high < infinity."""
    good = (1.0, 2.0)
    for place in range(3):
        ranges = [good, good, good]
        ranges[place] = (low, high)
        with pytest.raises(NumericsError, match="0 < low <= high"):
            PlantFamily.of_ranges(*ranges)


@pytest.mark.parametrize("name", ["mass_kg", "negative_stiffness_n_per_m", "current_stiffness_n_per_a"])
def test_a_bearing_that_does_not_pull_is_refused(name: str) -> None:
    """Mass and both stiffnesses are positive."""
    values = {"mass_kg": 1.0, "negative_stiffness_n_per_m": 1.0, "current_stiffness_n_per_a": 1.0, name: 0.0}
    with pytest.raises(NumericsError, match=name):
        Plant(**values)

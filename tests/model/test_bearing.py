"""The force law is that of the thesis, its slopes are those of the force, its inverse is an inverse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.errors import NumericsError
from magbear_cli.model.bearing import (
    Bearing,
    CurrentLaw,
    balancing_current,
    coil_currents,
    force_in_floats,
    gravity_current,
    linear_gravity_current,
    linearization,
    magnetic_force,
)

BEARINGS = {law: Bearing(400e-6, 4e-6, 0.5, law) for law in CurrentLaw}  # thesis Table 2.1

laws = st.sampled_from(list(CurrentLaw))
positions = st.floats(-300e-6, 300e-6)
currents = st.floats(-5.0, 5.0)


@pytest.mark.parametrize(("law", "gain"), [(CurrentLaw.FULL, 50.0), (CurrentLaw.HALF_SWITCHED, 25.0)])
def test_origin(law: CurrentLaw, gain: float) -> None:
    """At the origin the thesis's bearing has 62 500 N/m, and 50 or 25 N/A by the law of its currents."""
    linear = linearization(BEARINGS[law])
    assert linear.negative_stiffness_n_per_m == pytest.approx(62500.0, rel=1e-14)
    assert linear.current_stiffness_n_per_a == pytest.approx(gain, rel=1e-14)
    assert linear.force_n == 0.0


@settings(deadline=None, max_examples=60)
@given(laws, positions, currents)
def test_slopes_are_the_differences_of_the_force(law: CurrentLaw, position: float, current: float) -> None:
    """k_z and k_i are the derivatives of the force at every operating point."""
    bearing = BEARINGS[law]
    linear = linearization(bearing, position, current)
    dz, du = 1e-9, 1e-5
    by_position = np.diff(magnetic_force(bearing, [position - dz, position + dz], current))[0] / (2 * dz)
    by_current = np.diff(magnetic_force(bearing, position, [current - du, current + du]))[0] / (2 * du)
    assert linear.negative_stiffness_n_per_m == pytest.approx(by_position, rel=1e-5, abs=1e-2)
    assert linear.current_stiffness_n_per_a == pytest.approx(by_current, rel=1e-4, abs=1e-4)


@settings(deadline=None, max_examples=60)
@given(laws, positions, currents)
def test_the_bearing_is_symmetric(law: CurrentLaw, position: float, current: float) -> None:
    """Turned upside down, the force turns with it."""
    bearing = BEARINGS[law]
    assert magnetic_force(bearing, -position, -current) == pytest.approx(-magnetic_force(bearing, position, current))


@settings(deadline=None, max_examples=60)
@given(positions, st.floats(-1.0, 1.0))
def test_half_law_is_the_full_law_of_half_the_current(position: float, current: float) -> None:
    """As long as no coil is off, eq. 4.1 is eq. 2.1 with half the control current."""
    half = magnetic_force(BEARINGS[CurrentLaw.HALF_SWITCHED], position, current)
    assert half == pytest.approx(magnetic_force(BEARINGS[CurrentLaw.FULL], position, current / 2))


def test_one_coil_is_off_beyond_the_switching_current() -> None:
    """Beyond 2 i0 the half law drives one coil only; the full law, as printed, drives a negative current."""
    upper, lower = coil_currents(BEARINGS[CurrentLaw.HALF_SWITCHED], [-3.0, 3.0])
    np.testing.assert_allclose(upper, [0.0, 2.0])
    np.testing.assert_allclose(lower, [2.0, 0.0])
    np.testing.assert_allclose(coil_currents(BEARINGS[CurrentLaw.FULL], 3.0)[1], -2.5)
    assert BEARINGS[CurrentLaw.HALF_SWITCHED].switching_current_a == 1.0
    assert BEARINGS[CurrentLaw.FULL].switching_current_a == np.inf


def test_positions_and_currents_broadcast() -> None:
    """A column of positions and a row of currents make a surface; outside the gap it has no value."""
    surface = magnetic_force(BEARINGS[CurrentLaw.FULL], np.array([[-400e-6], [0.0], [399e-6]]), np.linspace(-1, 1, 5))
    assert surface.shape == (3, 5)
    assert np.isnan(surface[0]).all()
    assert np.isfinite(surface[1:]).all()


@settings(deadline=None, max_examples=100)
@given(laws, st.floats(-100e-6, 100e-6), st.floats(-15.0, 15.0))
def test_balancing_current_makes_the_force(law: CurrentLaw, position: float, force: float) -> None:
    """The current found for a force makes that force."""
    bearing = BEARINGS[law]
    current = balancing_current(bearing, force, position)
    assert magnetic_force(bearing, position, current) == pytest.approx(force, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("force", [-500.0, -44.1, 44.1, 500.0])
def test_balancing_current_of_the_half_law_has_no_limit(force: float) -> None:
    """With one coil off the half law still makes every force."""
    bearing = BEARINGS[CurrentLaw.HALF_SWITCHED]
    assert magnetic_force(bearing, 50e-6, balancing_current(bearing, force, 50e-6)) == pytest.approx(force)


def test_gravity_current() -> None:
    """Eq. 4.18 carries the weight exactly until a coil switches off, and with too much current beyond."""
    full, half = BEARINGS[CurrentLaw.FULL], BEARINGS[CurrentLaw.HALF_SWITCHED]
    assert gravity_current(full, 4.5, 9.8) == pytest.approx(44.1 / 50)
    assert gravity_current(half, 2.2, 9.8) == pytest.approx(linear_gravity_current(half, 2.2, 9.8))
    assert gravity_current(half, 4.5, 9.8) == pytest.approx(2 * (400e-6 * np.sqrt(44.1 / 4e-6) - 0.5))
    assert linear_gravity_current(half, 4.5, 9.8) == pytest.approx((400e-6) ** 2 * 44.1 / (2 * 4e-6 * 0.5))


def test_what_makes_no_sense_is_refused() -> None:
    """A bearing without a gap, a point in the iron and a force out of reach end in a sentence."""
    with pytest.raises(NumericsError, match="air_gap_m"):
        Bearing(0.0, 4e-6, 0.5)
    with pytest.raises(NumericsError, match="bias_current_a"):
        Bearing(4e-4, 4e-6, float("nan"))
    with pytest.raises(NumericsError, match="current_law"):
        Bearing(4e-4, 4e-6, 0.5, "quarter")  # type: ignore[arg-type]
    with pytest.raises(NumericsError, match="not inside the gap"):
        linearization(BEARINGS[CurrentLaw.FULL], 400e-6)
    with pytest.raises(NumericsError, match="no current is sought"):
        balancing_current(BEARINGS[CurrentLaw.FULL], float("inf"))
    with pytest.raises(NumericsError, match="no current of the full law"):
        balancing_current(BEARINGS[CurrentLaw.FULL], -1000.0, 100e-6)


@settings(deadline=None, max_examples=60)
@given(laws, positions, currents)
def test_one_force_in_floats_is_the_force_of_arrays(law: CurrentLaw, position: float, current: float) -> None:
    """The force without arrays is that with them, and none outside the gap."""
    force = force_in_floats(BEARINGS[law])
    assert force(position, current) == pytest.approx(float(magnetic_force(BEARINGS[law], position, current)), rel=1e-12)
    assert np.isnan(force(400e-6, current))

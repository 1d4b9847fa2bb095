"""The rotor obeys Newton: its total mass at low frequencies, its resonance where two masses on a spring have it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.errors import NumericsError
from magbear_cli.model.rotor import FlexibleRotor, rotor_dynamics


def test_rigid_rotor() -> None:
    """A rigid rotor is 1/(m s²), at the magnets and at the sensor."""
    response = rotor_dynamics(3.6)(100.0j)
    np.testing.assert_allclose(response[:, 0], -1.0 / (3.6 * 100.0**2))


@settings(deadline=None, max_examples=40)
@given(st.floats(1.0, 5.0), st.floats(0.05, 0.9), st.floats(1e4, 1e8), st.floats(0.0, 1e3), st.floats(1.0, 1e5))
def test_momentum(mass: float, sensor_mass: float, stiffness: float, damping: float, omega: float) -> None:
    """Spring and damper act inside the rotor: the force moves the centre of mass like one mass."""
    z1, z2 = rotor_dynamics(mass, FlexibleRotor(sensor_mass, stiffness, damping))(1j * omega)[:, 0]
    momentum = (mass - sensor_mass) * z1 + sensor_mass * z2
    size = abs((mass - sensor_mass) * z1) + abs(sensor_mass * z2)
    assert abs(momentum * (1j * omega) ** 2 - 1.0) <= 1e-6 * max(1.0, size * omega**2)


def test_resonance() -> None:
    """The undamped rotor has its poles at ± the resonance, and two at zero."""
    rotor = FlexibleRotor(0.18, 2.6e6)
    poles = rotor_dynamics(3.0, rotor).poles()
    assert np.abs(poles.imag).max() == pytest.approx(rotor.resonance_rad_s(3.0), rel=1e-6)
    assert rotor.resonance_rad_s(3.0) == pytest.approx(np.sqrt(2.6e6 * (1 / 2.82 + 1 / 0.18)))


def test_stiff_rotor_is_rigid() -> None:
    """A spring of a thousand times the stiffness moves both masses as one."""
    elastic = rotor_dynamics(3.0, FlexibleRotor(0.18, 2.6e10, 1e3))(1000.0j)
    np.testing.assert_allclose(elastic, rotor_dynamics(3.0)(1000.0j), rtol=1e-3)


def test_what_makes_no_sense_is_refused() -> None:
    """A rotor that is all sensor, springs that push and masses below zero end in a sentence."""
    with pytest.raises(NumericsError, match="no sensor mass"):
        rotor_dynamics(2.0, FlexibleRotor(2.0, 1e6))
    with pytest.raises(NumericsError, match="stiffness"):
        FlexibleRotor(0.1, -1.0)
    with pytest.raises(NumericsError, match="damping"):
        FlexibleRotor(0.1, 1.0, -1.0)
    with pytest.raises(NumericsError, match="mass must be"):
        rotor_dynamics(0.0)

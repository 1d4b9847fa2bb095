"""The filters are the transfer functions of the thesis."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.errors import NumericsError
from magbear_cli.model.filters import Prefilter, SensorDynamics

frequencies = st.floats(1.0, 1e6)


@settings(deadline=None, max_examples=40)
@given(frequencies, st.floats(0.01, 10.0), frequencies)
def test_prefilter(omega: float, zeta: float, at: float) -> None:
    """The prefilter is eq. 3.7 at every frequency."""
    s = 1j * at
    expected = omega**2 / (s**2 + 2 * zeta * omega * s + omega**2)
    assert Prefilter(omega, zeta).state_space()(s)[0, 0] == pytest.approx(expected, rel=1e-9)


@settings(deadline=None, max_examples=40)
@given(frequencies)
def test_sensor(at: float) -> None:
    """The sensor with the thesis's figures is eq. 2.11 at every frequency."""
    s = 1j * at
    expected = 4000**2 / (s**2 + 560 * s + 4000**2)
    assert SensorDynamics(4000.0, 560.0).state_space()(s)[0, 0] == pytest.approx(expected, rel=1e-9)


def test_gain_at_rest() -> None:
    """At rest neither filter changes the signal."""
    for system in (Prefilter(20000.0, 1.0).state_space(), SensorDynamics(4000.0, 560.0).state_space()):
        assert system(0.0)[0, 0] == pytest.approx(1.0)
        assert (system.poles().real < 0).all()


def test_what_makes_no_sense_is_refused() -> None:
    """Filters without a frequency or with negative damping end in a sentence."""
    with pytest.raises(NumericsError, match="omega_rad_s"):
        Prefilter(0.0, 1.0)
    with pytest.raises(NumericsError, match="zeta"):
        Prefilter(1.0, -1.0)
    with pytest.raises(NumericsError, match="damping_rad_s"):
        SensorDynamics(1.0, np.inf)

"""What is asked of a controller."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.errors import NumericsError
from magbear_cli.model.problem import ControlProblem, MassRange, RationalWeight


def test_the_nominal_mass_of_the_thesis_is_the_middle_of_the_inverse() -> None:
    """For 3.0-4.5 kg the nominal mass is 3.6 kg and the deviation of 1/m is 5.556e-2 (thesis table 2.2)."""
    mass = MassRange(3.0, 4.5)
    assert mass.nominal_kg == pytest.approx(3.6, rel=1e-12)
    assert mass.inverse_deviation_per_kg == pytest.approx(5.5556e-2, rel=1e-4)


@given(low=st.floats(0.01, 100.0), ratio=st.floats(1.001, 10.0), count=st.integers(2, 50))
@settings(deadline=None, max_examples=50)
def test_samples_stay_in_the_range_and_reach_its_ends(low: float, ratio: float, count: int) -> None:
    """Samples of a range ascend from one end to the other, exactly."""
    mass = MassRange(low, low * ratio)
    samples = mass.samples_kg(count)
    assert (samples[0], samples[-1]) == (mass.low_kg, mass.high_kg)
    assert (np.diff(samples) > 0).all()


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (2.0, 1.0), (-1.0, 1.0), (1.0, np.inf), (np.nan, 1.0)])
def test_a_range_that_is_none_is_refused(low: float, high: float) -> None:
    """A mass range needs 0 < low <= high < infinity."""
    with pytest.raises(NumericsError):
        MassRange(low, high)


def test_a_low_pass_has_its_gain_and_its_corner() -> None:
    """W1 = 10·200/(s + 200) is 10 at rest and 10/√2 at the corner."""
    weight = RationalWeight.low_pass(10.0, 200.0)
    assert abs(weight(0.0)) == pytest.approx(10.0)
    assert abs(weight(200j)) == pytest.approx(10.0 / np.sqrt(2.0))


@pytest.mark.parametrize("bad", [{"negative_stiffness_n_per_m": 0.0}, {"current_stiffness_n_per_a": -1.0}])
def test_a_bearing_that_does_not_pull_is_refused(bad: dict[str, float]) -> None:
    """Both stiffnesses must be positive."""
    good = ControlProblem(1.0, 1.0, MassRange(1.0, 2.0), RationalWeight.low_pass(1.0, 1.0))
    (name,) = bad
    with pytest.raises(NumericsError, match=name):
        replace(good, **bad)  # type: ignore[arg-type]


def test_a_bandwidth_limit_must_be_a_frequency() -> None:
    """A limit of zero is refused with its name."""
    with pytest.raises(NumericsError, match="omega_c_rad_s"):
        ControlProblem(1.0, 1.0, MassRange(1.0, 2.0), RationalWeight.low_pass(1.0, 1.0), 0.0)


def test_the_plant_is_real_and_negative_on_the_axis() -> None:
    """G(jω) = −k_i/(m ω² + k_z), for masses and frequencies that broadcast."""
    problem = ControlProblem(62500.0, 50.0, MassRange(3.0, 4.5), RationalWeight.low_pass(10.0, 200.0), 2e4)
    response = problem.plant(np.array([0.0, 100.0, 1e4]), np.array([[3.0], [4.5]]))
    assert response.shape == (2, 3)
    assert (response.real < 0).all()
    assert response[0, 1] == pytest.approx(-50.0 / (3.0 * 1e4 + 62500.0))

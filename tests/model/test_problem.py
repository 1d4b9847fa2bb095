"""What is asked of a controller."""

from __future__ import annotations

import numpy as np
import pytest

from magbear_cli.errors import NumericsError
from magbear_cli.model.problem import ControlProblem, RationalWeight


def test_a_low_pass_has_its_gain_and_its_corner() -> None:
    """W1 = 10·200/(s + 200) is 10 at rest and 10/√2 at the corner."""
    weight = RationalWeight.low_pass(10.0, 200.0)
    assert abs(weight(0.0)) == pytest.approx(10.0)
    assert abs(weight(200j)) == pytest.approx(10.0 / np.sqrt(2.0))


def test_a_bandwidth_limit_must_be_a_frequency() -> None:
    """A limit of zero is refused with its name."""
    with pytest.raises(NumericsError, match="omega_c_rad_s"):
        ControlProblem.of_mass(1.0, 1.0, (1.0, 2.0), RationalWeight.low_pass(1.0, 1.0), 0.0)


def test_the_plant_is_real_and_negative_on_the_axis() -> None:
    """G(jω) = −k_i/(m ω² + k_z), for shares and frequencies that broadcast."""
    problem = ControlProblem.of_mass(62500.0, 50.0, (3.0, 4.5), RationalWeight.low_pass(10.0, 200.0), 2e4)
    response = problem.plant(np.array([0.0, 100.0, 1e4]), np.array([[0.0], [1.0]]))
    assert response.shape == (2, 3)
    assert (response.real < 0).all()
    assert response[0, 1] == pytest.approx(-50.0 / (3.0 * 1e4 + 62500.0))

"""The thesis's bearing, its LQG controller, and leads that stabilise it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.bearing import Bearing, CurrentLaw


@pytest.fixture(scope="session")
def bearing() -> Bearing:
    """Thesis Table 2.1 with coil currents i0 ± u."""
    return Bearing(400e-6, 4e-6, 0.5)


@pytest.fixture(scope="session")
def half_bearing() -> Bearing:
    """Thesis Table 2.1 with the switched coil currents of eq. 4.1."""
    return Bearing(400e-6, 4e-6, 0.5, CurrentLaw.HALF_SWITCHED)


@pytest.fixture(scope="session")
def lqg() -> StateSpace:
    """The LQG controller of thesis section 2.3.1 for a rotor of 2 kg."""
    k, h = np.array([[1.955e4, 69.98]]), np.array([[5.629e3], [1.584e7]])
    a, b, c = np.array([[0.0, 1.0], [62500.0 / 2, 0.0]]), np.array([[0.0], [25.0]]), np.array([[1.0, 0.0]])
    return StateSpace(a - b @ k - h @ c, h, -k, np.zeros((1, 1)))


@pytest.fixture(scope="session")
def lead() -> Callable[[float, float, float], StateSpace]:
    """The lead −gain (s + zero)/(s + pole), which stabilises a rotor of some kilograms."""

    def build(gain: float = 2e6, zero: float = 500.0, pole: float = 5e4) -> StateSpace:
        return StateSpace.of([[-pole]], [[1.0]], [[-gain * (zero - pole)]], [[-gain]])

    return build

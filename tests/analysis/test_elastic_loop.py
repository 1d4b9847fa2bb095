"""An elastic rotor's loop has the poles it must have, and its elasticity touches its bound where it is said to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from magbear_cli.analysis.elastic_loop import (
    elastic_plant,
    elastic_poles,
    elasticity,
    elasticity_over_bound,
    fastest_growing,
    free_touching_damping,
    touching_damping,
)
from magbear_cli.errors import NumericsError
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.model.rotor import FlexibleRotor

PROBLEM = ControlProblem.of_mass(62500.0, 25.0, (2.2, 4.5), RationalWeight.low_pass(18.0, 17.0), 2000.0)
ROTOR = FlexibleRotor(0.1824, 2.612e6, 170.0)
REDUCED_KG = 0.1824 * (2.2 - 0.1824) / 2.2
LEAD = StateSpace.of([[-4000.0]], [[1.0]], [[-3.5e5 * (300.0 - 4000.0)]], [[-3.5e5]])


def test_a_stiff_rotor_is_a_rigid_one() -> None:
    """With ever more stiffness the elasticity vanishes and the slow poles are those of the rigid loop."""
    stiff = FlexibleRotor(0.1824, 2.612e12, 170.0)
    assert np.abs(elasticity(PROBLEM, 2.2, stiff, np.geomspace(1.0, 1e4, 20))).max() < 1e-4
    rigid = elastic_poles(PROBLEM, LEAD, 2.2, None)
    poles = elastic_poles(PROBLEM, LEAD, 2.2, stiff)
    slow = poles[np.argsort(np.abs(poles))[: rigid.size]]
    assert np.sort_complex(slow) == pytest.approx(np.sort_complex(rigid), rel=1e-4)


def test_the_poles_are_roots_of_the_loop() -> None:
    """At every pole 1 = K G."""
    plant = elastic_plant(PROBLEM, 2.2, ROTOR)
    for pole in elastic_poles(PROBLEM, LEAD, 2.2, ROTOR):
        assert complex(LEAD(pole)[0, 0] * plant(pole)[0, 0]) == pytest.approx(1.0, abs=1e-6)


def test_the_elasticity_of_a_free_rotor_is_that_of_its_reduced_mass() -> None:
    """Far above the magnets' own frequency Δ = −μ s²/(μ s² + c s + k)."""
    omega = np.linspace(2000.0, 8000.0, 7)
    s = 1j * omega
    expected = -REDUCED_KG * s**2 / (REDUCED_KG * s**2 + 170.0 * s + 2.612e6)
    assert elasticity(PROBLEM, 2.2, ROTOR, omega) == pytest.approx(expected, rel=0.05)


def test_the_touching_damping_touches() -> None:
    """With it the largest share of the bound is one, with less it is more; the closed form is near."""
    damping = touching_damping(PROBLEM, 2.2, ROTOR)
    share, omega = elasticity_over_bound(PROBLEM, 2.2, replace(ROTOR, damping_n_s_per_m=damping))
    assert share == pytest.approx(1.0, abs=1e-6)
    assert omega == pytest.approx(3900.0, rel=0.02)
    assert elasticity_over_bound(PROBLEM, 2.2, replace(ROTOR, damping_n_s_per_m=0.8 * damping))[0] > 1.1
    assert free_touching_damping(REDUCED_KG, 2.612e6, 2000.0) == pytest.approx(damping, rel=2e-3)


def test_what_has_no_bound_is_told() -> None:
    """Without a bandwidth limit, or with a rotor too soft for it, there is no touching damping."""
    with pytest.raises(NumericsError, match="bound"):
        elasticity_over_bound(replace(PROBLEM, omega_c_rad_s=None), 2.2, ROTOR)
    with pytest.raises(NumericsError, match="no damping"):
        touching_damping(replace(PROBLEM, omega_c_rad_s=1e5), 2.2, ROTOR)
    assert np.isnan(free_touching_damping(REDUCED_KG, 2.612e5, 2000.0))


def test_the_fastest_growing_pole_is_an_oscillating_one_if_there_is_one() -> None:
    """A real pole further right does not hide the pair that oscillates."""
    assert fastest_growing(np.array([-1.0 + 0j, -2.0 + 3j, -2.0 - 3j, -5.0 + 9j])) == -2.0 + 3j
    assert fastest_growing(np.array([-1.0 + 0j, -4.0 + 0j])) == -1.0

"""The problem in its own units."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.model.robust_performance import worst_level
from magbear_cli.model.scaling import scale_problem


@given(
    stiffness=st.floats(1e2, 1e8),
    force=st.floats(1.0, 1e4),
    mass=st.floats(0.1, 50.0),
    spread=st.floats(1.0, 3.0),
    seed=st.integers(0, 1000),
)
@settings(deadline=None, max_examples=50)
def test_a_level_does_not_depend_on_units(
    stiffness: float, force: float, mass: float, spread: float, seed: int
) -> None:
    """A controller of the scaled problem, brought back to SI, has the same worst case at every frequency."""
    problem = ControlProblem.of_mass(
        stiffness, force, (mass, mass * spread), RationalWeight((9.0, 4.0), (1.0, 3.0)), 5e3
    )
    scaled, scaling = scale_problem(problem)
    assert scaled.natural_rad_s == pytest.approx(1.0)
    assert scaled.family.is_fixed == problem.family.is_fixed
    assert scaled.nominal.current_stiffness_n_per_a == pytest.approx(1.0)
    rng = np.random.default_rng(seed)
    system = StateSpace.of(
        -np.diag(rng.uniform(0.1, 50.0, 3)), rng.normal(size=(3, 1)), rng.normal(size=(1, 3)), [[-9.0]]
    )
    back = scaling.controller(system)
    omega = np.geomspace(0.01, 100.0, 7)
    here = np.array([system(1j * w)[0, 0] for w in omega])
    there = np.array([back(1j * w)[0, 0] for w in omega * scaling.omega_rad_s])
    one = worst_level(scaled, here, omega)[0]
    other = worst_level(problem, there, omega * scaling.omega_rad_s)[0]
    np.testing.assert_allclose(one, other, rtol=1e-7)

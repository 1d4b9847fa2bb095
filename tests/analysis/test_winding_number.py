"""The count on the Nyquist curve is the count of unstable eigenvalues."""

from __future__ import annotations

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from magbear_cli.analysis.frequency_grid import frequency_grid
from magbear_cli.analysis.pole_family import pole_family
from magbear_cli.analysis.winding_number import dense_response, unstable_poles
from magbear_cli.lti.conversion import from_transfer_function
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, RationalWeight


@settings(deadline=None, max_examples=50)
@given(seed=st.integers(0, 2**32 - 1), order=st.integers(0, 6))
def test_the_count_is_that_of_the_eigenvalues(seed: int, order: int) -> None:
    """For random controllers, stable or not, with poles from 10 to 1e5 rad/s."""
    generator = np.random.default_rng(seed)
    problem = ControlProblem.of_mass(62_500.0, 50.0, (3.0, 4.5), RationalWeight.low_pass(10.0, 200.0), 2e4)
    poles = 10 ** generator.uniform(1, 5, size=order) * np.sign(generator.uniform(-0.8, 0.2, size=order))
    zeros = 10 ** generator.uniform(1, 5, size=order) * np.sign(generator.uniform(-0.8, 0.2, size=order))
    controller = from_transfer_function(-(10 ** generator.uniform(2, 7)) * np.poly(zeros), np.poly(poles))
    family = pole_family(problem, controller, [0.5])
    assume(np.all(np.abs(family.poles_rad_s.real) > 10.0 * family.uncertainty_rad_s))
    counted = unstable_poles(problem, controller, 0.5, frequency_grid(problem, controller))
    assert counted.count == int((family.poles_rad_s.real > 0).sum())


def test_a_hidden_unstable_mode_is_counted(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """A mode of the controller that its output shows and its input does not reach is in the count."""
    hidden = StateSpace(
        np.array([[good_lead.a[0, 0], 0.0], [0.0, 5.0]]),
        np.array([[good_lead.b[0, 0]], [0.0]]),
        np.array([[good_lead.c[0, 0], 1.0]]),
        good_lead.d,
    )
    grid = frequency_grid(quickstart, hidden)
    assert unstable_poles(quickstart, hidden, 0.5, grid).count == 1
    assert unstable_poles(quickstart, good_lead, 0.5, grid).count == 0


def test_an_integrator_does_not_stop_the_count(quickstart: ControlProblem) -> None:
    """A pole of K at zero is passed on its right."""
    controller = from_transfer_function([-7.7e6, -7.7e6 * 72.0, -7.7e6 * 72.0 * 5.0], [1.0, 18_000.0, 0.0])
    counted = unstable_poles(quickstart, controller, 0.5, frequency_grid(quickstart, controller))
    assert counted.count == 0
    assert counted.shift_rad_s >= 0.0


def test_a_pole_on_the_axis_is_no_count(quickstart: ControlProblem) -> None:
    """A curve through zero has no winding number, and that is said."""
    counted = unstable_poles(quickstart, StateSpace.gain([[-1e4]]), 0.5, np.geomspace(1.0, 1e6, 400))
    assert counted.count is None
    assert "axis" in counted.reason


def test_the_dense_response_is_the_transfer_function(good_lead: StateSpace) -> None:
    """C (s I − A)⁻¹ B + D at points off the axis, and a static gain at any."""
    points = np.array([1.0 + 2.0j, 3e4 - 1e3j])
    np.testing.assert_allclose(dense_response(good_lead, points), [good_lead(s)[0, 0] for s in points], rtol=1e-12)
    np.testing.assert_array_equal(dense_response(StateSpace.gain([[-3.0]]), points), [-3.0, -3.0])

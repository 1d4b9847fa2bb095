"""Changes of units leave the response what it is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.errors import NumericsError
from magbear_cli.lti.balancing import with_balanced_states, with_time_unit
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace

OMEGA = np.geomspace(1e-3, 1e3, 41)


def test_time_unit_moves_the_frequency_axis(random_system: Callable[..., StateSpace]) -> None:
    """In time of 1/omega the response at ω is the old one at ω·omega."""
    system = random_system(3, 6)
    scaled = frequency_response(with_time_unit(system, 50.0), OMEGA)
    np.testing.assert_allclose(scaled, frequency_response(system, 50.0 * OMEGA), rtol=1e-10)


def test_time_unit_must_be_a_frequency(random_system: Callable[..., StateSpace]) -> None:
    """A unit of time that is zero, negative or not finite is refused."""
    for omega in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(NumericsError, match="unit of time"):
            with_time_unit(random_system(1, 2), omega)


@settings(deadline=None, max_examples=25)
@given(st.lists(st.integers(-40, 40), min_size=4, max_size=4))
def test_balancing_undoes_any_choice_of_units(exponents: list[int]) -> None:
    """Whatever the units of the states, balancing leaves the same poles, markov parameters and near-equal sizes."""
    a = np.array([[-1.0, 2.0, 0.0, 1.0], [0.5, -3.0, 1.0, 0.0], [1.0, 0.0, -2.0, 1.0], [0.0, 1.0, 1.0, -4.0]])
    b, c = np.ones((4, 1)), np.array([[1.0, -1.0, 2.0, 1.0]])
    units = 2.0 ** np.array(exponents)
    system = StateSpace(a * units / units[:, None], b / units[:, None], c * units, np.zeros((1, 1)))
    balanced = with_balanced_states(system)
    for power in range(4):
        expected = c @ np.linalg.matrix_power(a, power) @ b
        np.testing.assert_allclose(balanced.c @ np.linalg.matrix_power(balanced.a, power) @ balanced.b, expected)
    assert np.abs(balanced.a).max() <= 100.0
    assert np.abs(balanced.b).max() <= 100.0
    assert np.abs(balanced.c).max() <= 100.0


def test_states_that_touch_nothing_are_left_alone() -> None:
    """A state without input or without output cannot be balanced and does no harm."""
    system = StateSpace.of([[-1.0, 0.0], [1e9, -2.0]], [[0.0], [1.0]], [[0.0, 1.0]], [[0.0]])
    balanced = with_balanced_states(system)
    assert np.isfinite(balanced.a).all()
    assert frequency_response(balanced, 1.0)[0, 0, 0] == pytest.approx(1.0 / (1j + 2.0))


def test_entries_at_the_ends_of_double_precision_are_no_error() -> None:
    """A ratio of entries that no double holds is bounded, not raised."""
    system = StateSpace.of([[-1.0, 2.2e-308], [1e300, -1.0]], [[1.0], [0.0]], [[0.0, 1.0]], [[0.0]])
    balanced = with_balanced_states(system)
    assert np.isfinite(balanced.b).all()
    assert np.isfinite(balanced.c).all()

"""Connections have the response that algebra says they have."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from magbear_cli.errors import NumericsError
from magbear_cli.lti.connection import append, feedback, inverse, lower_lft, parallel, series
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace

OMEGA = np.concatenate([np.geomspace(1e-3, 1e3, 25), [np.inf]])
Maker = Callable[..., StateSpace]


def test_series_multiplies(random_system: Maker) -> None:
    """Second after first is the product second·first."""
    first, second = random_system(1, 3, 2, 3), random_system(2, 4, 3, 1)
    expected = frequency_response(second, OMEGA) @ frequency_response(first, OMEGA)
    np.testing.assert_allclose(frequency_response(series(first, second), OMEGA), expected, rtol=1e-9, atol=1e-11)


def test_parallel_adds(random_system: Maker) -> None:
    """Side by side with one input, outputs add."""
    first, second = random_system(3, 3, 2, 2), random_system(4, 2, 2, 2)
    expected = frequency_response(first, OMEGA) + frequency_response(second, OMEGA)
    np.testing.assert_allclose(frequency_response(parallel(first, second), OMEGA), expected, rtol=1e-9, atol=1e-11)


def test_append_keeps_them_apart(random_system: Maker) -> None:
    """Appended systems do not hear each other."""
    first, second = random_system(5, 3, 2, 1), random_system(6, 2, 1, 2)
    response = frequency_response(append(first, second), OMEGA)
    np.testing.assert_allclose(response[:, :1, :2], frequency_response(first, OMEGA), rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(response[:, 1:, 2:], frequency_response(second, OMEGA), rtol=1e-9, atol=1e-11)
    assert not response[:, 1:, :2].any()
    assert not response[:, :1, 2:].any()


def test_feedback_is_positive(random_system: Maker) -> None:
    """The loop of F and B in positive feedback is (I − F B)⁻¹ F."""
    forward, backward = random_system(7, 3, 2, 3), random_system(8, 2, 3, 2)
    f, b = frequency_response(forward, OMEGA), frequency_response(backward, OMEGA)
    expected = np.linalg.solve(np.eye(3) - f @ b, f)
    np.testing.assert_allclose(frequency_response(feedback(forward, backward), OMEGA), expected, rtol=1e-7, atol=1e-9)


def test_lower_lft_closes_the_last_channels(random_system: Maker) -> None:
    """The lower fractional transformation has its textbook response."""
    plant, controller = random_system(9, 4, 3, 4), random_system(10, 3, 2, 1)
    p, k = frequency_response(plant, OMEGA), frequency_response(controller, OMEGA)
    p11, p12, p21, p22 = p[:, :2, :2], p[:, :2, 2:], p[:, 2:, :2], p[:, 2:, 2:]
    expected = p11 + p12 @ k @ np.linalg.solve(np.eye(2) - p22 @ k, p21)
    response = frequency_response(lower_lft(plant, controller), OMEGA)
    np.testing.assert_allclose(response, expected, rtol=1e-7, atol=1e-9)


def test_inverse_of_inverse(random_system: Maker) -> None:
    """A system after its inverse is the identity."""
    system = random_system(12, 4, 2, 2)
    identity = frequency_response(system, OMEGA) @ frequency_response(inverse(system), OMEGA)
    np.testing.assert_allclose(identity, np.broadcast_to(np.eye(2), identity.shape), atol=1e-8)


def test_static_gains_connect() -> None:
    """Systems without states connect like numbers."""
    two, three = StateSpace.gain([[2.0]]), StateSpace.gain([[3.0]])
    assert series(two, three).d[0, 0] == 6.0
    assert parallel(two, three).d[0, 0] == 5.0
    assert feedback(two, three).d[0, 0] == pytest.approx(2.0 / (1.0 - 6.0))
    assert inverse(two).d[0, 0] == 0.5


def test_refuses_what_does_not_fit(random_system: Maker) -> None:
    """Wrong sizes, singular loops and strictly proper inverses are refused with a sentence."""
    wide, tall = random_system(13, 2, 2, 1), random_system(14, 2, 1, 2)
    with pytest.raises(NumericsError, match="do not fit in parallel"):
        parallel(wide, tall)
    with pytest.raises(NumericsError, match="do not fit in series"):
        series(wide, wide)
    with pytest.raises(NumericsError, match="do not fit in feedback"):
        feedback(wide, wide)
    with pytest.raises(NumericsError, match="do not fit in lower_lft"):
        lower_lft(StateSpace.gain([[1.0]]), wide)
    with pytest.raises(NumericsError, match="not well posed"):
        feedback(StateSpace.gain([[2.0]]), StateSpace.gain([[0.5]]))
    with pytest.raises(NumericsError, match="inverse"):
        inverse(StateSpace.gain([[0.0]]))

"""The H-infinity norm against closed forms, dense grids and a second implementation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.lti.conversion import from_transfer_function
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.norm import hinf_norm
from magbear_cli.lti.state_space import StateSpace


@settings(deadline=None, max_examples=30)
@given(st.floats(-4.0, 0.0), st.floats(-2.0, 6.0))
def test_second_order_resonance(damping_exponent: float, speed_exponent: float) -> None:
    """A resonance of damping ζ peaks at 1/(2ζ√(1−ζ²)), at ω √(1−2ζ²), however thin it is."""
    zeta, omega = 0.5 * 10.0**damping_exponent, 10.0**speed_exponent
    norm, where = hinf_norm(from_transfer_function([omega**2], [1.0, 2 * zeta * omega, omega**2]))
    assert norm == pytest.approx(1.0 / (2 * zeta * np.sqrt(1 - zeta**2)), rel=2e-6)
    assert where == pytest.approx(omega * np.sqrt(1 - 2 * zeta**2), rel=1e-2)


def test_no_grid_point_is_above_it(random_system: Callable[..., StateSpace]) -> None:
    """No point of a dense grid exceeds the norm, and the norm is attained where it says."""
    omega = np.concatenate([[0.0], np.geomspace(1e-4, 1e4, 4000), [np.inf]])
    for seed in range(8):
        system = random_system(seed, 3 + 2 * seed, inputs=2, outputs=3, decades=3.0)
        norm, where = hinf_norm(system)
        gains = np.linalg.svd(frequency_response(system, omega), compute_uv=False)[:, 0]
        assert gains.max() <= norm * (1 + 2e-6)
        attained = np.linalg.svd(frequency_response(system, where)[0], compute_uv=False)[0]
        assert attained == pytest.approx(norm, rel=1e-9)


def test_agrees_with_slicot(random_system: Callable[..., StateSpace]) -> None:
    """SLICOT's norm routine gives the same figures."""
    slycot = pytest.importorskip("slycot")
    for seed in range(20, 26):
        system = random_system(seed, 9, inputs=2, outputs=2)
        n = system.order
        expected, _ = slycot.ab13dd("C", "I", "N", "D", n, 2, 2, system.a, np.eye(n), system.b, system.c, system.d)
        assert hinf_norm(system)[0] == pytest.approx(expected, rel=1e-5)


def test_peak_at_infinity_and_at_zero() -> None:
    """A high-pass peaks at ω = ∞, a low-pass at 0, a static gain anywhere."""
    high, low = from_transfer_function([3.0, 0.0], [1.0, 5.0]), from_transfer_function([10.0], [1.0, 5.0])
    assert hinf_norm(high) == pytest.approx((3.0, np.inf))
    assert hinf_norm(low) == pytest.approx((2.0, 0.0))
    assert hinf_norm(StateSpace.gain([[3.0, 4.0]]))[0] == pytest.approx(5.0)
    assert hinf_norm(StateSpace.of([[-1.0]], [[0.0]], [[1.0]], [[0.0]]))[0] == 0.0


def test_flat_response() -> None:
    """An all-pass is one everywhere and does not confuse the iteration."""
    assert hinf_norm(from_transfer_function([-1.0, 7.0], [1.0, 7.0]))[0] == pytest.approx(1.0, rel=1e-9)


def test_unstable_is_infinite() -> None:
    """A pole in the right half-plane or on the axis makes the norm infinite, at that pole's frequency."""
    assert hinf_norm(from_transfer_function([1.0], [1.0, -1.0]))[0] == np.inf
    assert hinf_norm(from_transfer_function([1.0], [1.0, 0.0])) == (np.inf, 0.0)
    assert hinf_norm(from_transfer_function([1.0], [1.0, -0.2, 9.0]))[1] == pytest.approx(3.0, rel=1e-2)
    empty = StateSpace(np.array([[-1.0]]), np.zeros((1, 0)), np.ones((1, 1)), np.zeros((1, 0)))
    assert hinf_norm(empty) == (0.0, 0.0)

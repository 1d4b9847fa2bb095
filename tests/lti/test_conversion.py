"""Conversions there and back, and against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.lti.conversion import (
    from_transfer_function,
    from_zeros_poles_gain,
    transfer_function,
    zeros_poles_gain,
)
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace

speeds = st.floats(-3.0, 5.0).map(lambda exponent: -(10.0**exponent))


@settings(deadline=None, max_examples=40)
@example([-1.0] * 4, [-1000.0, -10000.0, -0.01, -0.01], 1.0)
@given(st.lists(speeds, max_size=6), st.lists(speeds, max_size=6), st.floats(0.1, 10.0))
def test_zeros_poles_gain_come_back(zeros: list[float], poles: list[float], gain: float) -> None:
    """A chain of sections has the response that its zeros, poles and gain say, as exactly as its matrices can."""
    zeros = zeros[: len(poles)]
    system = from_zeros_poles_gain(zeros, poles, gain)
    assert system.order == len(poles)
    s = 1j * np.geomspace(1e-4, 1e6, 21)[:, None]
    expected = gain * np.prod(s - np.array(zeros), axis=1) / np.prod(s - np.array(poles), axis=1)
    error = np.abs(frequency_response(system, s[:, 0].imag)[:, 0, 0] - expected)
    assert (error <= 1e-9 * np.abs(expected) + 1e-12 * gain + rounding(system, s[:, 0])).all()


def rounding(system: StateSpace, s: NDArray[Any]) -> NDArray[np.float64]:
    """What a change of every entry of A, B, C and D by last digits makes of the response (Higham 2002, theorem 7.4).

    A slow zero before a fast pole is a difference of nearly equal terms: with four of them 1e7 times as slow, that is
    3e-9 of the response.
    """
    pencil = s[:, None, None] * np.eye(system.order) - system.a
    inverse = np.abs(np.linalg.inv(pencil))
    moved = np.abs(system.c) @ inverse @ np.abs(pencil) @ inverse @ np.abs(system.b)
    return np.asarray(64 * np.finfo(float).eps * (moved + np.abs(system.d))[:, 0, 0])


def test_complex_roots_share_out() -> None:
    """Complex zeros find a second-order section among real poles, and the gain comes back."""
    zeros, poles = [-1 + 5j, -1 - 5j, -300.0], [-2.0, -40.0, -50.0, -1e4]
    system = from_zeros_poles_gain(zeros, poles, -7.0)
    found_zeros, found_poles, gain = zeros_poles_gain(system)
    np.testing.assert_allclose(found_zeros, np.sort_complex(np.array(zeros)), rtol=1e-9)
    np.testing.assert_allclose(found_poles, np.sort_complex(np.array(poles, complex)), rtol=1e-9)
    assert gain == pytest.approx(-7.0, rel=1e-9)


def test_the_bearing_has_no_zeros() -> None:
    """k_i/(m s² − k_z) has two real poles, no zeros and the gain k_i/m."""
    zeros, poles, gain = zeros_poles_gain(from_transfer_function([50.0], [2.0, 0.0, -62500.0]))
    assert zeros.size == 0
    np.testing.assert_allclose(poles, [-np.sqrt(31250.0), np.sqrt(31250.0)])
    assert gain == pytest.approx(25.0, rel=1e-12)


@pytest.mark.parametrize(
    ("num", "den"),
    [
        ([2000.0], [1.0, 200.0]),
        ([360000.0], [1.0, 400.0, 40000.0]),
        ([1.0, 3.0, 2.0], [1.0, 12.0, 47.0, 60.0]),
        ([5.0, 1.0], [1.0, 2.0]),
        ([3.0], [2.0]),
        ([0.0, 0.0, 4.0], [1.0, 1.0]),
        ([1.6e7], [1.0, 560.0, 1.6e7]),
    ],
)
def test_transfer_function_comes_back(num: list[float], den: list[float]) -> None:
    """num/den to state space and back is num/den with a monic denominator."""
    found_num, found_den = transfer_function(from_transfer_function(num, den))
    np.testing.assert_allclose(found_den, np.array(den) / den[0], rtol=1e-9)
    np.testing.assert_allclose(found_num, np.trim_zeros(num, "f") / np.array(den[0]), rtol=1e-9)


def test_a_system_that_does_nothing() -> None:
    """A zero system has no zeros and the gain zero."""
    zeros, _, gain = zeros_poles_gain(StateSpace.of([[-1.0]], [[0.0]], [[1.0]], [[0.0]]))
    assert zeros.size == 0
    assert gain == 0.0
    num, _ = transfer_function(from_transfer_function([0.0], [1.0, 1.0]))
    assert not num.any()


def test_refuses_what_is_no_transfer_function() -> None:
    """Improper, infinite, empty and unpaired data are refused with a sentence."""
    with pytest.raises(NumericsError, match="improper"):
        from_transfer_function([1.0, 0.0, 0.0], [1.0, 1.0])
    with pytest.raises(NumericsError, match="denominator is zero"):
        from_transfer_function([1.0], [0.0])
    with pytest.raises(NumericsError, match="finite"):
        from_transfer_function([np.nan], [1.0, 1.0])
    with pytest.raises(NumericsError, match="no more zeros"):
        from_zeros_poles_gain([-1.0, -2.0], [-3.0], 1.0)
    with pytest.raises(NumericsError, match="conjugate"):
        from_zeros_poles_gain([], [-1 + 1j, -2.0], 1.0)
    with pytest.raises(NumericsError, match="one input and one output"):
        zeros_poles_gain(StateSpace.gain([[1.0, 2.0]]))


@pytest.mark.parametrize("slow", [[-1e-4, -1e-4], [-1e-4], [-1e-2, -1e-2], [0.0, 0.0], [0.0]])
@pytest.mark.parametrize("form", ["sections", "companion"])
def test_no_zero_is_lost_beside_slow_poles(slow: list[float], form: str) -> None:
    """Random roots over six decades beside slow poles: as many zeros as given, and the response that they say."""
    generator = np.random.default_rng(6)
    omega = np.geomspace(1e-4, 1e6, 41)
    s = 1j * omega[:, None]
    for _ in range(100):
        poles = np.append(-(10.0 ** generator.uniform(-1.0, 5.0, int(generator.integers(2, 6)))), slow)
        zeros = -(10.0 ** generator.uniform(-1.0, 5.0, int(generator.integers(0, poles.size + 1))))
        gain = -(10.0 ** generator.uniform(-2.0, 6.0))
        if form == "sections":
            system = from_zeros_poles_gain(zeros, poles, gain)
        else:
            system = from_transfer_function(gain * np.atleast_1d(np.poly(zeros)), np.poly(poles))
        found_zeros, found_poles, found_gain = zeros_poles_gain(system)
        assert found_zeros.size == zeros.size
        assert found_gain == pytest.approx(gain, rel=1e-6)
        found = found_gain * np.prod(s - found_zeros, axis=1) / np.prod(s - found_poles, axis=1)
        np.testing.assert_allclose(found, frequency_response(system, omega)[:, 0, 0], rtol=1e-4)


@pytest.mark.parametrize(("zeros", "poles"), [([-10.0], [-1e-13]), ([-10.0, -40.0], [-1e-13, -1e-13]), ([-3.0], [0.0])])
def test_a_pole_as_good_as_zero_takes_no_zero_along(zeros: list[float], poles: list[float]) -> None:
    """The direct gain counts though its zero is 1e13 times as fast as all poles: there is no other root to lose."""
    found, _, gain = zeros_poles_gain(from_zeros_poles_gain(zeros, poles, -3.0))
    np.testing.assert_allclose(found, np.sort(zeros), rtol=1e-9)
    assert gain == pytest.approx(-3.0, rel=1e-9)


def test_a_direct_gain_that_is_rounding_makes_no_zero() -> None:
    """A zero 1e17 times as fast as the poles would take their digits from all others."""
    system = from_zeros_poles_gain([-5.0, -7.0], [-1.0, -2.0, -3.0], 4.0)
    zeros, _, gain = zeros_poles_gain(StateSpace(system.a, system.b, system.c, np.array([[1e-17]])))
    np.testing.assert_allclose(zeros, [-7.0, -5.0], rtol=1e-9)
    assert gain == pytest.approx(4.0, rel=1e-9)


def test_zeros_survive_a_rotation_of_the_states() -> None:
    """Mixed states leave a leading coefficient of zero as rounding, which is told from a small one."""
    generator = np.random.default_rng(0)
    for _ in range(200):
        order = int(generator.integers(2, 9))
        poles, zeros = (
            -(10.0 ** generator.uniform(0.0, 1.0, n)) for n in (order, int(generator.integers(0, order + 1)))
        )
        system = from_zeros_poles_gain(zeros, poles, 2.0)
        q = np.linalg.qr(generator.standard_normal((order, order)))[0]
        mixed = StateSpace(q.T @ system.a @ q, q.T @ system.b, system.c @ q, system.d)
        found, _, gain = zeros_poles_gain(mixed)
        assert found.size == zeros.size
        assert gain == pytest.approx(2.0, rel=1e-6)

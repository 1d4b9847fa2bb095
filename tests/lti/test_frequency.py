"""The frequency response against direct solves, closed forms and extended precision."""

from __future__ import annotations

from collections.abc import Callable

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.errors import NumericsError
from magbear_cli.lti.connection import inverse, series
from magbear_cli.lti.conversion import from_transfer_function, from_zeros_poles_gain
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace


def test_equals_direct_solves(random_system: Callable[..., StateSpace]) -> None:
    """Every frequency gives what a solve of (jω I − A) X = B gives."""
    omega = np.geomspace(1e-4, 1e4, 60)
    for seed, order in enumerate((1, 2, 5, 12)):
        system = random_system(seed, order, inputs=3, outputs=2)
        expected = np.stack([system(1j * point) for point in omega])
        np.testing.assert_allclose(frequency_response(system, omega), expected, rtol=1e-9, atol=1e-12)


def test_holds_twelve_digits_for_33_states_over_six_decades() -> None:
    """Poles from 1 to 1e6 rad/s do not cost accuracy at either end."""
    poles, zeros = -np.geomspace(1.0, 1e6, 33), -np.geomspace(2.0, 5e5, 32)
    omega = np.geomspace(1e-2, 1e8, 500)
    s = 1j * omega[:, None]
    expected = 1e6 * np.prod((s - zeros) / (s - poles[:-1]), axis=1) / (s[:, 0] - poles[-1])
    response = frequency_response(from_zeros_poles_gain(zeros, poles, 1e6), omega)[:, 0, 0]
    np.testing.assert_allclose(response, expected, rtol=1e-11)


def test_companion_form_in_extended_precision() -> None:
    """A companion form with coefficients over 36 decades answers to 1e-12 of its own polynomial."""
    den = np.poly(-np.geomspace(1.0, 1e6, 11))
    system = from_transfer_function([1e30], den)
    with mpmath.workdps(50):
        for omega in (0.1, 30.0, 4e3, 1e6, 3e7):
            value = mpmath.mpf(1e30) / sum(mpmath.mpf(x) * mpmath.mpc(0, omega) ** k for k, x in enumerate(den[::-1]))
            assert frequency_response(system, omega)[0, 0, 0] == pytest.approx(complex(value), rel=1e-12)


def test_infinity_gives_the_direct_gain(random_system: Callable[..., StateSpace]) -> None:
    """At ω = ±∞ the response is D; a static gain is D everywhere."""
    system = random_system(7, 4, inputs=2, outputs=2)
    np.testing.assert_array_equal(frequency_response(system, [np.inf, -np.inf]), np.stack([system.d, system.d]))
    gain = StateSpace.gain([[2.0, -1.0]])
    np.testing.assert_array_equal(frequency_response(gain, [0.0, 1.0, np.inf]), np.repeat(gain.d[None], 3, axis=0))


def test_a_pole_on_the_axis_gives_infinity() -> None:
    """An integrator is infinite at ω = 0 and itself elsewhere."""
    response = frequency_response(from_transfer_function([1.0], [1.0, 0.0]), [0.0, 2.0])[:, 0, 0]
    assert np.isinf(abs(response[0]))
    assert response[1] == pytest.approx(-0.5j)


def test_repeated_poles_and_cancellations() -> None:
    """Repeated poles and a pole under a zero give the closed form."""
    omega = np.geomspace(0.01, 100.0, 30)
    s = 1j * omega
    quintuple = from_transfer_function([1.0], np.poly([-1.0] * 5))
    np.testing.assert_allclose(frequency_response(quintuple, omega)[:, 0, 0], (s + 1.0) ** -5, rtol=1e-10)
    cancelled = from_transfer_function(np.poly([-3.0]), np.poly([-3.0, -2.0]))
    np.testing.assert_allclose(frequency_response(cancelled, omega)[:, 0, 0], 1.0 / (s + 2.0), rtol=1e-12)


def test_a_rounding_error_in_a_does_not_spoil_the_response() -> None:
    """A function in series with its inverse is one, even where a stray 1e-16 in A sends the balancing astray."""
    sections = [
        from_transfer_function(num, den) for num, den in (([1 / 0.0572, 1], [100, 1]), ([0.01, 1], [1 / 25.1, 1]))
    ]
    first = series(*sections)
    loop = series(first, inverse(first))
    spoiled = loop.a.copy()
    spoiled[3, 2] += 2.2e-16
    system = StateSpace(spoiled, loop.b, loop.c, loop.d)
    np.testing.assert_allclose(frequency_response(system, np.geomspace(1e-2, 1e2, 50))[:, 0, 0], 1.0, rtol=1e-9)


def test_many_frequencies_do_not_change_the_answer(
    random_system: Callable[..., StateSpace], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Frequencies taken in pieces give the same numbers as all at once."""
    system, omega = random_system(11, 8), np.geomspace(1e-3, 1e3, 101)
    whole = frequency_response(system, omega)
    monkeypatch.setattr("magbear_cli.lti.frequency.ENTRIES_AT_ONCE", 1000)
    np.testing.assert_array_equal(frequency_response(system, omega), whole)


def test_refuses_a_frequency_that_is_not_a_number(random_system: Callable[..., StateSpace]) -> None:
    """NaN among the frequencies is an error and not a NaN in the answer."""
    with pytest.raises(NumericsError, match="frequencies"):
        frequency_response(random_system(1, 2), [1.0, np.nan])


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10_000), st.integers(1, 9))
def test_negative_frequencies_are_conjugate(seed: int, order: int) -> None:
    """A real system answers at −ω with the conjugate of its answer at ω."""
    generator = np.random.default_rng(seed)
    system = StateSpace.of(
        generator.standard_normal((order, order)),
        generator.standard_normal((order, 2)),
        generator.standard_normal((1, order)),
        generator.standard_normal((1, 2)),
    )
    omega = np.array([0.3, 2.0, 17.0])
    np.testing.assert_allclose(
        frequency_response(system, -omega), frequency_response(system, omega).conj(), rtol=1e-9, atol=1e-12
    )

"""Sums of lags on the imaginary axis, enclosed."""

from __future__ import annotations

from dataclasses import replace

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.analysis.interval import Interval
from magbear_cli.analysis.lag_sum import LagSum

Pairs = tuple[tuple[float, ...], ...]

POLES = (0.5, 2.0, 7.0, 30.0)
PAIRS = ((3.0, 0.1, 40.0, -70.0), (11.0, 0.7, -5.0, 90.0))


def lag_sum(derived: int | None, coefficients: tuple[float, ...], pairs: Pairs = ()) -> LagSum:
    """The sum with second-order terms."""
    return replace(LagSum.of(POLES, coefficients, derived), pairs=np.array(pairs).reshape(-1, 4))


def exact(derived: int | None, coefficients: tuple[float, ...], omega: float, pairs: Pairs = ()) -> complex:
    """The sum at jω in 60 digits, the derived coefficient included."""
    with mpmath.workdps(60):
        s = 1j * mpmath.mpf(omega)
        poles, free = [mpmath.mpf(p) for p in POLES], [mpmath.mpf(c) for c in coefficients[1:]]
        if derived == 0:
            free = [-poles[0] * sum(c / p for c, p in zip(free, poles[1:], strict=True)), *free]
        elif derived == -1:
            by_s = sum(mpmath.mpf(n) * mpmath.mpf(b) for n, _, _, b in pairs)
            free = [*free, -(sum(c * p for c, p in zip(free, poles[:-1], strict=True)) + by_s) / poles[-1]]
        total = coefficients[0] + sum(c * p / (p + s) for c, p in zip(free, poles, strict=True))
        for row in pairs:
            n, zeta, a, b = (mpmath.mpf(value) for value in row)
            total += (a * n**2 + b * n * s) / (s**2 + 2 * zeta * n * s + n**2)
        return complex(total)


def coefficients_of(derived: int | None, seed: int) -> tuple[float, ...]:
    """Random coefficients, as many as are stored."""
    return tuple(np.random.default_rng(seed).normal(size=len(POLES) + (derived is None)) * 100.0)


def inside(value: float, interval: Interval) -> bool:
    """Whether a number lies in an interval up to its own rounding."""
    slack = 1e-13 * max(1.0, abs(value)) * 100.0
    return bool(interval.low.ravel()[0] - slack <= value <= interval.high.ravel()[0] + slack)


FORMS = st.sampled_from([(None, ()), (0, ()), (-1, ()), (None, PAIRS), (-1, PAIRS)])


@settings(max_examples=100, deadline=None)
@given(FORMS, st.integers(0, 10**6), st.floats(-4, 4), st.floats(0, 1))
def test_boxes_hold_the_sum(form: tuple[int | None, Pairs], seed: int, exponent: float, share: float) -> None:
    """Real and imaginary part at a point of the box lie in the enclosures, below, among and above the poles."""
    derived, pairs = form
    coefficients = coefficients_of(derived, seed)
    low = 10.0**exponent
    high = 1.05 * low
    parts = lag_sum(derived, coefficients, pairs).over_boxes(np.array([low]), np.array([high]))
    value = exact(derived, coefficients, low + share * (high - low), pairs)
    assert inside(value.real, parts[0].whole)
    assert inside(value.imag, parts[1].whole)
    centre = exact(derived, coefficients, 0.5 * (low + high), pairs)
    assert inside(centre.real, parts[0].centre)
    assert inside(centre.imag, parts[1].centre)


@settings(max_examples=80, deadline=None)
@given(FORMS, st.integers(0, 10**6), st.floats(1e-3, 1.0))
def test_both_ends_hold_the_sum(form: tuple[int | None, Pairs], seed: int, share: float) -> None:
    """Near 0 and near ∞ the parts, with their powers of ω restored, are those of the sum."""
    derived, pairs = form
    coefficients = coefficients_of(derived, seed)
    lags, small = lag_sum(derived, coefficients, pairs), 1e-3
    box = Interval.of(np.array([[0.0]]), np.array([[small]]))
    real, imaginary = lags.near_zero(box)
    omega = small * share
    value = exact(derived, coefficients, omega, pairs)
    assert inside(value.real, real)
    assert inside(value.imag / (omega**3 if derived == 0 else omega), imaginary) or derived == 0
    real, imaginary = lags.near_infinity(box)
    value = exact(derived, coefficients, 1.0 / omega, pairs)
    assert inside(value.real, real)
    assert inside(value.imag / (omega**3 if derived == -1 else omega), imaginary) or derived == -1


@pytest.mark.parametrize("derived", [None, -1])
def test_second_order_terms_are_sharp_at_both_ends(derived: int | None) -> None:
    """At points near the ends the enclosures of the parts are as narrow as rounding, and true to 60 digits."""
    coefficients = coefficients_of(derived, 11)
    lags, omega = lag_sum(derived, coefficients, PAIRS), 1e-4
    box = Interval.of(np.array([[omega]]))
    rest = exact(derived, coefficients, 0.0, PAIRS).real
    value = exact(derived, coefficients, omega, PAIRS)
    curved, slope = lags.parts_near_zero(box)
    assert float(curved.low[0]) == pytest.approx((value.real - rest) / omega**2, rel=1e-5)
    assert float(slope.high[0]) == pytest.approx(value.imag / omega, rel=1e-9)
    value = exact(derived, coefficients, 1.0 / omega, PAIRS)
    power = 3 if derived == -1 else 1
    assert float(lags.near_infinity(box)[1].low[0]) == pytest.approx(value.imag / omega**power, rel=1e-7)


@pytest.mark.parametrize("derived", [0, -1])
def test_the_derived_coefficient_makes_its_term_vanish(derived: int) -> None:
    """The imaginary part over ω³ (or its inverse) agrees with 60-digit values, where doubles alone would not."""
    coefficients = coefficients_of(derived, 5)
    lags = LagSum.of(POLES, coefficients, derived)
    omega = 1e-4
    box = Interval.of(np.array([[omega]]))
    imaginary = (lags.near_zero(box) if derived == 0 else lags.near_infinity(box))[1]
    value = exact(derived, coefficients, omega if derived == 0 else 1.0 / omega).imag / omega**3
    assert float(imaginary.low[0]) == pytest.approx(value, rel=1e-6)
    assert float(imaginary.high[0]) == pytest.approx(value, rel=1e-6)


def test_a_mix_of_boxes_below_and_above_the_poles_keeps_its_order() -> None:
    """Boxes are answered in the order they were asked."""
    coefficients = coefficients_of(0, 8)
    low = np.array([40.0, 0.01, 3.0, 0.1])
    real, _ = LagSum.of(POLES, coefficients, 0).over_boxes(low, 1.01 * low)
    for index, start in enumerate(low):
        value = exact(0, coefficients, float(start) * 1.005).real
        assert real.whole.low[index] <= value <= real.whole.high[index]

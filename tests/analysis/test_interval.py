"""Interval arithmetic: what must lie inside does."""

from __future__ import annotations

import operator
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.analysis.interval import Enclosure, Interval, polynomial

FINITE = st.floats(-1e9, 1e9, allow_nan=False, allow_subnormal=False)


def holds(interval: Interval, exact: Fraction) -> bool:
    """Whether a rational number lies between both ends, compared exactly."""
    low, high = float(interval.low), float(interval.high)
    return (np.isinf(low) or Fraction(low) <= exact) and (np.isinf(high) or exact <= Fraction(high))


@settings(max_examples=200, deadline=None)
@given(FINITE, FINITE, FINITE, FINITE, st.sampled_from([operator.add, operator.sub, operator.mul]))
def test_ring_operations_enclose_the_exact_result(
    a: float, b: float, c: float, d: float, operation: Callable[[Any, Any], Any]
) -> None:
    """Every pair of ends, combined in rational arithmetic, lies inside the interval result."""
    left, right = Interval.of(min(a, b), max(a, b)), Interval.of(min(c, d), max(c, d))
    result = operation(left, right)
    for x in (a, b):
        for y in (c, d):
            assert holds(result, operation(Fraction(x), Fraction(y)))


@settings(max_examples=200, deadline=None)
@given(FINITE, FINITE, FINITE)
def test_quotients_and_squares_enclose_the_exact_result(a: float, b: float, x: float) -> None:
    """1/x and x² of both ends lie inside; across zero the quotient is the whole line."""
    interval = Interval.of(min(a, b), max(a, b))
    for end in (a, b):
        assert holds(interval.square(), Fraction(end) ** 2)
        if end != 0.0:
            assert holds(interval.reciprocal(), 1 / Fraction(end))
            with np.errstate(invalid="ignore"):
                quotient = Interval.of(x) / interval
            assert holds(quotient, Fraction(x) / Fraction(end))
    if min(a, b) <= 0.0 <= max(a, b):
        assert np.isinf(interval.reciprocal().high)


@settings(max_examples=100, deadline=None)
@given(st.floats(0, 1e12), st.floats(0, 1e12))
def test_roots_enclose_the_exact_result(a: float, b: float) -> None:
    """The squares of the root's ends are on both sides of the number."""
    root = Interval.of(min(a, b), max(a, b)).root()
    assert Fraction(float(root.low)) ** 2 <= Fraction(min(a, b))
    assert Fraction(float(root.high)) ** 2 >= Fraction(max(a, b))


@settings(max_examples=100, deadline=None)
@given(st.lists(st.floats(-1e12, 1e12), min_size=1, max_size=60))
def test_sums_enclose_the_exact_result(values: list[float]) -> None:
    """However the terms cancel, the exact sum lies inside."""
    assert holds(Interval.of(np.array(values)).sum(), sum((Fraction(v) for v in values), Fraction(0)))


def test_what_is_not_a_number_is_the_whole_line() -> None:
    """∞ times 0 encloses everything instead of nothing."""
    with np.errstate(invalid="ignore"):
        product = Interval.of(-np.inf, np.inf) * Interval.of(0.0)
    assert (float(product.low), float(product.high)) == (-np.inf, np.inf)


@settings(max_examples=50, deadline=None)
@given(st.floats(0.1, 10.0), st.floats(1e-6, 0.3), st.floats(0, 1))
def test_enclosures_hold_value_range_and_slope(start: float, width: float, share: float) -> None:
    """At any point of a box a composed function lies in its range, and its difference quotient in the slope's range."""
    low, high = np.array([start]), np.array([start * (1 + width)])

    def compose(x: Any) -> Any:  # noqa: ANN401 - numbers and enclosures alike
        square = x * x if isinstance(x, float) else x.square()
        shifted: Any = square + 2.0
        reciprocal = 1.0 / shifted if isinstance(x, float) else shifted.reciprocal()
        inner = square * 3.0 - x * reciprocal + 1.0
        return inner**0.5 if isinstance(x, float) else inner.root()

    enclosure = compose(Enclosure.of_variable(low, high))
    middle = float(enclosure.centre.low[0])
    assert enclosure.centre.low[0] <= compose(0.5 * (low[0] + high[0])) <= enclosure.centre.high[0]
    point = float(low[0] + share * (high[0] - low[0]))
    assert enclosure.whole.low[0] - 1e-12 <= compose(point) <= enclosure.whole.high[0] + 1e-12
    far = abs(point - 0.5 * float(low[0] + high[0]))
    if far > 1e-4:
        slope = (compose(point) - compose(0.5 * float(low[0] + high[0]))) / (point - 0.5 * float(low[0] + high[0]))
        assert enclosure.slope.low[0] - 1e-9 <= slope <= enclosure.slope.high[0] + 1e-9
    assert np.isfinite(middle)


def test_cancelling_terms_stay_tight() -> None:
    """The difference x² − x² over a box is far narrower than the box, because slopes are subtracted too."""
    x = Enclosure.of_variable(np.array([1.0]), np.array([1.1]))
    difference = x * x - x.square()
    assert float(difference.whole.high[0] - difference.whole.low[0]) < 0.05
    assert float((x.square().whole - x.square().whole).high[0]) > 0.2


def test_polynomials_are_enclosed() -> None:
    """Horner's rule over a box holds the values of the polynomial."""
    x = Enclosure.of_variable(np.array([0.9]), np.array([1.0]))
    value = polynomial([Interval.of(c) for c in (1.0, -3.0, 0.5)], x).whole
    samples = np.polyval([1.0, -3.0, 0.5], np.linspace(0.9, 1.0, 50))
    assert value.low[0] <= samples.min()
    assert samples.max() <= value.high[0]
    assert float(value.high[0] - value.low[0]) == pytest.approx(np.ptp(samples), rel=0.3)

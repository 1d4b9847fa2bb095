"""Tests of the weight's rules: stable by Routh's table exactly when its roots say so."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from magbear_cli.spec.weights import is_stable, trimmed


@settings(deadline=None, max_examples=200)
@given(
    real=st.lists(st.floats(-5, 5), max_size=3),
    pairs=st.lists(st.tuples(st.floats(-5, 5), st.floats(0.1, 5)), max_size=2),
    gain=st.sampled_from([1.0, -3.0, 1e-8]),
)
def test_a_polynomial_is_stable_when_its_roots_are(
    real: list[float], pairs: list[tuple[float, float]], gain: float
) -> None:
    """Roots well off the axis decide, whatever the leading coefficient."""
    assume(real or pairs)
    parts = [*real, *(part for part, _ in pairs)]
    assume(min(abs(part) for part in parts) > 1e-3)
    polynomial = np.array([gain])
    for root in real:
        polynomial = np.convolve(polynomial, [1.0, -root])
    for part, imaginary in pairs:
        polynomial = np.convolve(polynomial, [1.0, -2 * part, part**2 + imaginary**2])
    assert is_stable([float(value) for value in polynomial]) is (max(parts) < 0)


@pytest.mark.parametrize(
    ("coefficients", "stable"),
    [
        ([5.0], True),
        ([1.0, 0.0], False),
        ([1.0, 0.0, 4.0], False),
        ([1.0, 2.0, 1.0], True),
        ([1.0, 1.0, 1.0, 1.0], False),
        ([1.0, 400.0, 40000.0], True),
        ([-1.0, -200.0], True),
        ([1.0, -200.0], False),
        ([1.0, 3.0, 3.0, 1.0], True),
        ([1.0, 1.0, 0.0], False),
    ],
)
def test_the_axis_itself_is_not_stable(coefficients: list[float], stable: bool) -> None:  # noqa: FBT001 - a table
    """Roots on the imaginary axis are refused, double roots in the left half-plane are not."""
    assert is_stable(coefficients) is stable


def test_leading_zeros_do_not_count() -> None:
    """The degree is that of the first coefficient that is not zero."""
    assert trimmed([0.0, 0, 2, 0]) == [2.0, 0.0]
    assert trimmed([0.0]) == []

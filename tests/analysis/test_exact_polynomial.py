"""Controllers as exact quotients, and Routh's test."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.analysis.exact_polynomial import exact_transfer_function, is_hurwitz
from magbear_cli.lti.state_space import StateSpace


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 8), st.integers(0, 2**32 - 1))
def test_the_quotient_is_the_transfer_function(order: int, seed: int) -> None:
    """n(s)/a(s) at a complex point is C (s I − A)⁻¹ B + D, and a(s) is det(s I − A)."""
    rng = np.random.default_rng(seed)
    controller = StateSpace.of(
        rng.normal(size=(order, order)) * 100.0, rng.normal(size=(order, 1)), rng.normal(size=(1, order)), [[0.3]]
    )
    num, den = exact_transfer_function(controller)
    assert len(num) == len(den) == order + 1
    s = 70.0 + 40.0j
    values = [np.polyval([float(c) for c in part], s) for part in (num, den)]
    assert values[0] / values[1] == pytest.approx(complex(controller(s)[0, 0]), rel=1e-9)
    assert values[1] == pytest.approx(np.linalg.det(s * np.eye(order) - controller.a), rel=1e-9)


def test_nothing_is_rounded() -> None:
    """A pole at −1/3 as a double gives that double back, to the last bit."""
    pole = -1.0 / 3.0
    num, den = exact_transfer_function(StateSpace.of([[pole]], [[0.1]], [[0.7]], [[0.0]]))
    assert den == [Fraction(1), -Fraction(pole)]
    assert num == [Fraction(0), Fraction(0.1) * Fraction(0.7)]


@settings(max_examples=100, deadline=None)
@given(st.lists(st.integers(-9, 9).filter(bool), min_size=1, max_size=4), st.integers(-6, 6), st.integers(1, 6))
def test_routh_agrees_with_the_roots_it_was_given(real: list[int], centre: int, height: int) -> None:
    """A polynomial built from integer roots is Hurwitz exactly when all of them are in the left half-plane."""
    polynomial = [Fraction(1)]
    factors = [[Fraction(1), Fraction(-root)] for root in real]
    factors.append([Fraction(1), Fraction(-2 * centre), Fraction(centre**2 + height**2)])
    for factor in factors:
        product = [Fraction(0)] * (len(polynomial) + len(factor) - 1)
        for i, a in enumerate(polynomial):
            for j, b in enumerate(factor):
                product[i + j] += a * b
        polynomial = product
    expected = all(root < 0 for root in real) and centre < 0
    assert is_hurwitz(polynomial) is expected
    assert is_hurwitz([-c for c in polynomial]) is expected


def test_a_root_on_the_axis_by_a_hair_is_seen() -> None:
    """s² + ε s + 1 is Hurwitz for ε = 1e-300 and not for 0 or −1e-300."""
    for damping, expected in ((1e-300, True), (0.0, False), (-1e-300, False)):
        assert is_hurwitz([Fraction(1), Fraction(damping), Fraction(1)]) is expected

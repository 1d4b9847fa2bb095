"""The modulus of a weight over boxes."""

from __future__ import annotations

import numpy as np
import pytest

from magbear_cli.analysis.interval import Enclosure
from magbear_cli.analysis.weight_enclosure import squared_modulus, squared_modulus_at_infinity
from magbear_cli.model.problem import RationalWeight

WEIGHTS = [
    RationalWeight((2000.0,), (1.0, 200.0)),
    RationalWeight((0.3, 40.0), (1.0, 0.5)),
    RationalWeight((5.0,), (1.0, 2.0, 100.0)),
    RationalWeight((0.0, 1.0, 3.0), (1.0, 2.0, 100.0, 7.0)),
]


@pytest.mark.parametrize("weight", WEIGHTS)
def test_boxes_hold_the_squared_modulus(weight: RationalWeight) -> None:
    """|W(jω)|² at points of each box lies in its range, and the range is not much wider."""
    low = np.geomspace(0.01, 1e5, 60)
    high = 1.01 * low
    enclosed = squared_modulus(weight, Enclosure.of_variable(low, high)).whole
    for share in (0.0, 0.4, 1.0):
        value = np.abs(weight(1j * (low + share * (high - low)))) ** 2
        assert (enclosed.low <= value * (1 + 1e-12)).all()
        assert (value <= enclosed.high * (1 + 1e-12)).all()
    assert (enclosed.high - enclosed.low <= 0.3 * np.abs(weight(1j * low)) ** 2).all()


@pytest.mark.parametrize("weight", WEIGHTS)
def test_the_fall_off_is_taken_out_at_infinity(weight: RationalWeight) -> None:
    """|W|² ω^{2r} at 1/ω = 0 is the square of the ratio of leading coefficients."""
    num, den = np.trim_zeros(weight.num, "f"), np.trim_zeros(weight.den, "f")
    at_infinity = squared_modulus_at_infinity(weight, Enclosure.of_variable(np.array([0.0]), np.array([0.0])))
    assert float(at_infinity.whole.low[0]) == pytest.approx((num[0] / den[0]) ** 2)
    omega = 1e3
    box = Enclosure.of_variable(np.array([1.0 / omega]), np.array([1.0 / omega]))
    value = float(np.abs(weight(1j * omega)) ** 2) * omega ** (2 * (len(den) - len(num)))
    assert float(squared_modulus_at_infinity(weight, box).whole.high[0]) == pytest.approx(value)

"""How numbers are written."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.report.numbers import (
    at_least,
    at_most,
    count_text,
    kilograms,
    mass_text,
    omega_text,
    shortest,
    significant,
    with_unit,
)

SPACE = "\u202f"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.5123, "0.512"),
        (1.0, "1.00"),
        (0.9996, "1.00"),
        (20000.0, f"20{SPACE}000"),
        (1234.5, "1230"),
        (6.2e-7, "6.20 × 10⁻⁷"),
        (-86.24, "−86.2"),
        (-1.5e9, "−1.50 × 10⁹"),
        (0.0, "0"),
        (math.inf, "∞"),
        (-math.inf, "−∞"),
        (math.nan, "–"),
        (None, "–"),
    ],
)
def test_significant(value: float | None, text: str) -> None:
    """A number has three significant digits, thin spaces and a true minus; what is no number is a sign."""
    assert significant(value) == text


@settings(deadline=None, max_examples=200)
@given(st.floats(allow_nan=False, allow_infinity=False, min_value=1e-250, max_value=1e250), st.integers(2, 5))
def test_significant_keeps_the_value(value: float, digits: int) -> None:
    """What is printed is the number to half a unit of its last digit."""
    text = significant(value, digits).replace(SPACE, "")
    if "×" in text:
        mantissa, _, power = text.partition(" × 10")
        text = f"{mantissa}e{power.translate(str.maketrans('⁻⁰¹²³⁴⁵⁶⁷⁸⁹', '-0123456789'))}"
    assert float(text) == pytest.approx(value, rel=0.51 * 10.0 ** (1 - digits))


def test_what_a_user_wrote_keeps_its_digits() -> None:
    """Masses and limits are written as short as they were."""
    assert [shortest(value) for value in (4.5, 3.0, 20000.0, 12345.0)] == ["4.5", "3", f"20{SPACE}000", f"12{SPACE}345"]
    assert shortest(1e9) == "1 × 10⁹"
    assert kilograms(2.955223880597015) == "2.955"
    assert (mass_text(2.0), mass_text([3.0, 4.5])) == ("2 kg", "3–4.5 kg")
    assert (omega_text(None), omega_text(7000.0)) == ("no limit", "7000 rad/s")
    assert (count_text(1, "case"), count_text(2, "case")) == ("1 case", "2 cases")
    assert (with_unit(None, "A"), with_unit(1.5, "A")) == ("–", "1.50 A")


@settings(deadline=None)
@given(st.floats(1e-9, 1e9), st.integers(2, 5))
def test_proven_bounds_are_rounded_to_their_safe_side(value: float, digits: int) -> None:
    """A lower bound as printed is not above the number, an upper bound not below it; both within a unit of it."""
    low, high = (_read(rounded(value, digits)) for rounded in (at_least, at_most))
    slack = 1e-12 * value
    assert low <= value + slack
    assert high >= value - slack
    assert high - low <= 2.1 * 10.0 ** (math.floor(math.log10(value)) - digits + 1)


def test_a_bound_that_would_round_across_is_held_back() -> None:
    """0.39757 proven below is 0.397, and proven above is 0.398."""
    assert (at_least(0.39757), at_most(0.39743)) == ("0.397", "0.398")
    assert (at_least(None), at_most(math.nan)) == ("–", "–")


def _read(text: str) -> float:
    """A number as it was written."""
    plain = text.replace(SPACE, "").replace("−", "-")
    mantissa, _, power = plain.partition(" × 10")
    return float(mantissa) * 10.0 ** int((power or "0").translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")))

"""Tests of the hints at numbers that are written as text."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.spec.scalars import ScalarError, is_number, number_hint, plain_scalar


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1,5", "1.5"),
        ("-2,75e-3", "-2.75e-3"),
        ("1.5 kg", "1.5"),
        ("400µm", "400"),
        ("20 krad/s", "20"),
        ("1.5e-3\u00a0m", "1.5e-3"),
        ("−4", "-4"),
        ("–4.5", "-4.5"),
        ("1 000", "1000"),
        ("1_000_000", "1000000"),
        ("1'000", "1000"),
        ("1_0", "10"),
        ("0b101", "5"),
        ("12:30", "seconds"),
        ("1e3", "1e3"),
        (" 5 ", "remove"),
        ("٣٤", "digits"),
        ("inf", "finite"),
        ("fast", ""),
        ("", ""),
    ],
)
def test_a_number_written_as_text_has_a_hint(text: str, words: str) -> None:
    """The hint holds the number that was meant, when it can be known."""
    hint = number_hint(text)
    assert words in hint
    assert bool(hint) is bool(words)


@settings(deadline=None)
@given(st.text(max_size=20))
def test_any_text_is_a_value_or_refused(text: str) -> None:
    """Nothing else is raised, and a hint never fails."""
    number_hint(text)
    try:
        value = plain_scalar(text)
    except ScalarError:
        value = ""
    assert value is None or isinstance(value, bool | int | float | str)
    assert is_number(text) is (isinstance(value, int | float) and not isinstance(value, bool))


@settings(deadline=None)
@given(st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=False))
def test_a_float_is_read_back_from_its_representation(number: float) -> None:
    """Every digit counts."""
    assert plain_scalar(repr(number)) == number

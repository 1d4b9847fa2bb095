"""The cone program of least current."""

from __future__ import annotations

import numpy as np
import pytest

from magbear_cli.errors import NumericsError
from magbear_cli.synthesis.control_set import ControlSet, Modulus, Row
from magbear_cli.synthesis.current_program import CurrentUnits, least_current
from magbear_cli.synthesis.current_wish import AffineCurrent

NONE = ControlSet([], [])


def _current(offset: list[complex], steps: list[float]) -> AffineCurrent:
    ones = np.ones((len(offset), 1), dtype=complex)
    return AffineCurrent(np.array(offset, dtype=complex), ones, np.array(steps), np.ones((len(steps), 1)))


def test_the_largest_modulus_is_the_least() -> None:
    """|1 + v| and |3 + v| are both one at v = −2."""
    v = least_current(_current([1.0, 3.0], []), NONE, CurrentUnits((3.0, 3.0), (1.0, 0.0)), np.zeros(0))
    assert v == pytest.approx([-2.0], abs=1e-6)


def test_the_largest_instant_is_the_least() -> None:
    """|−4 + v| and |1 + v| at two instants are equal at v = 1.5, whatever K S does."""
    current = _current([1.0, 3.0], [-4.0, 1.0])
    v = least_current(current, NONE, CurrentUnits((3.0, 4.0), (0.0, 1.0)), np.zeros(0))
    assert v == pytest.approx([1.5], abs=1e-6)


def test_a_row_is_kept() -> None:
    """With |v| ≤ 1/2 asked for by a row the answer stops at −1/2."""
    one, zero = np.ones(2, dtype=np.complex128), np.zeros(2, dtype=np.complex128)
    modulus = Modulus(np.array([-2.0, -6.0], dtype=np.complex128), np.full(2, 2.0, dtype=np.complex128))
    held = ControlSet([modulus], [Row(np.ones((1, 2)), one, zero)])
    v = least_current(_current([1.0, 3.0], []), held, CurrentUnits((3.0, 3.0), (1.0, 0.0)), np.zeros(0))
    assert v == pytest.approx([-0.5], abs=1e-5)


def test_moves_stay_within_their_bounds() -> None:
    """An unknown that is a move goes to its bound and no further."""
    offset = np.array([5.0, 0.0], dtype=complex)
    columns = np.array([[0.0, 1.0], [1.0, 0.0]], dtype=complex)
    current = AffineCurrent(offset, columns, np.zeros(0), np.zeros((0, 2)))
    v = least_current(current, NONE, CurrentUnits((5.0, 5.0), (1.0, 0.0)), np.array([0.25]))
    assert v[1] == pytest.approx(-0.25, abs=1e-6)


def test_functions_that_are_not_independent_are_refused() -> None:
    """A function that is zero everywhere ends in a sentence and not in a breakdown."""
    current = AffineCurrent(np.ones(3, dtype=complex), np.zeros((3, 1), dtype=complex), np.zeros(0), np.zeros((0, 1)))
    with pytest.raises(NumericsError, match="not independent"):
        least_current(current, NONE, CurrentUnits((1.0, 1.0), (1.0, 0.0)), np.zeros(0))

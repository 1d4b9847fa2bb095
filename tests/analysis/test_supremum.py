"""A peak between the points of a grid is found, wherever it is."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.analysis.supremum import sign_changes, supremum

GRID = np.geomspace(1.0, 1e5, 101)


@settings(deadline=None, max_examples=40)
@given(log_place=st.floats(0.2, 4.8), width=st.floats(0.02, 1.0))
def test_a_smooth_peak_is_found_between_the_points(log_place: float, width: float) -> None:
    """The height of a bump in log ω does not depend on where the grid lies."""
    value, omega = supremum(lambda w: 3.0 * np.exp(-(((np.log10(w) - log_place) / width) ** 2)), GRID)
    assert value == pytest.approx(3.0, rel=1e-8)
    assert np.log10(omega) == pytest.approx(log_place, abs=1e-4 * width + 1e-6)


def test_a_kink_is_found() -> None:
    """A maximum of two curves that cross is no smooth peak and is found as well."""
    value, omega = supremum(lambda w: np.minimum(w / 777.0, (777.0 / w) ** 3), GRID)
    assert value == pytest.approx(1.0, abs=1e-5)
    assert omega == pytest.approx(777.0, rel=1e-5)


def test_the_limit_at_infinity_counts() -> None:
    """A quantity that rises towards a limit has that limit for supremum, at infinity."""
    assert supremum(lambda w: 1.0 - 1.0 / w, GRID, 1.0) == (1.0, np.inf)


def test_zero_counts() -> None:
    """A quantity that falls from ω = 0 on has its supremum there."""
    value, omega = supremum(lambda w: 1.0 / (1.0 + w), np.concatenate([[0.0], GRID]))
    assert (value, omega) == (1.0, 0.0)


def test_what_is_not_a_number_is_not_bounded() -> None:
    """One NaN makes the supremum NaN, never a smaller number; infinity stays infinity."""
    assert np.isnan(supremum(lambda w: np.where(w > 100.0, np.nan, 1.0), GRID)[0])
    assert supremum(lambda w: np.where(w > 9e4, np.inf, 1.0), GRID)[0] == np.inf


def test_sign_changes_are_narrowed_to_rounding() -> None:
    """Every simple zero that lies between grid points is found to rounding; a quantity without any has none."""
    roots = sign_changes(lambda w: (w - 10.1) * (w - 777.7) * (w - 33_333.0), GRID)
    np.testing.assert_allclose(roots, [10.1, 777.7, 33_333.0], rtol=1e-13)
    assert sign_changes(lambda w: w, GRID).size == 0

"""Fewer points for the same picture."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.report.thinning import POINTS, thinned


def test_the_curve_stays_where_it_is() -> None:
    """A resonance sampled at 20 000 points is drawn from few of them, nowhere off by more than a line's width."""
    x = np.linspace(0.0, 6.0, 20_000)
    y = 1.0 / np.sqrt((1.0 - (x / 3.0) ** 2) ** 2 + (0.02 * x) ** 2)
    kept = thinned(x, y)
    assert kept.size <= POINTS
    assert np.abs(np.interp(x, x[kept], y[kept]) - y).max() <= 1e-3 * np.ptp(y)
    assert y[kept].max() > 0.9999 * y.max()


@settings(deadline=None, max_examples=50)
@given(st.lists(st.floats(-1e9, 1e9) | st.just(float("nan")), max_size=60))
def test_any_curve_keeps_its_ends_and_gaps(values: list[float]) -> None:
    """Ends, and both sides of each gap, are always kept, in order."""
    y = np.array(values)
    kept = thinned(np.arange(y.size, dtype=float), y)
    assert (np.diff(kept) > 0).all()
    assert {0, y.size - 1} <= set(kept.tolist()) or y.size < 1
    finite = np.isfinite(y)
    edges = np.flatnonzero(np.diff(finite.astype(int)))
    assert {*edges.tolist(), *(edges + 1).tolist()} <= set(kept.tolist())

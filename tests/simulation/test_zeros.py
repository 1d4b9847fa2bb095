"""Zeros of smooth functions are found to rounding, wherever they lie between the points that are known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from magbear_cli.simulation.adaptive_flow import FINE
from magbear_cli.simulation.zeros import below_zero, first_zero


@settings(deadline=None, max_examples=60)
@given(st.floats(1e-7, 0.999), st.integers(1, 5), st.floats(1.0, 1e4))
def test_a_zero_is_found_however_steep(root: float, power: int, scale: float) -> None:
    """Also beside values of quite another size, where interpolation creeps."""

    def function(place: float) -> float:
        return float((root - place) * (1.0 + scale * place**power))

    right = int(np.searchsorted(FINE, root, side="right"))
    points = [
        (float(FINE[at]), function(float(FINE[at]))) for at in range(max(0, right - 3), min(FINE.size, right + 2))
    ]
    within = float(FINE[right - 1]), float(FINE[min(right, FINE.size - 1)])
    assert first_zero(function, points, within) == pytest.approx(root, abs=1e-11)


@settings(deadline=None, max_examples=60)
@given(st.floats(0.31, 0.69), st.floats(0.01, 0.5), st.floats(1e-6, 1e-3), st.booleans())
def test_a_dip_between_known_points_is_found_and_only_there(
    place: float,
    bend: float,
    depth: float,
    is_below: bool,  # noqa: FBT001 - drawn
) -> None:
    """A least value below zero beside a known point is found, with the point before it; above zero nothing is."""

    def function(at: float) -> float:
        return (-depth if is_below else depth) + (at - place) ** 2 * (1.0 + bend * at)

    points = [(at, function(at)) for at in (0.1, 0.5, 0.9)]
    assume(points[1][1] > 0.0 and points[1][1] < min(points[0][1], points[2][1]))
    found = below_zero(function, points)
    assert (found is not None) == is_below
    if found is not None:
        assert found[1][1] < 0.0 < found[0][1]
        assert found[0][0] < found[1][0]

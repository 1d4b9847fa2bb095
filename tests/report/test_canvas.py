"""The axis of frequencies is marked within its decades, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.markers import TICKDOWN

from magbear_cli.report.canvas import frequency_axis, house_style, new_figure, panels


@pytest.mark.parametrize(
    ("view", "first", "last", "count"),
    [((1.0, 1e3), 2.0, 900.0, 24), ((25.0, 450.0), 30.0, 400.0, 10), ((1.0, 1e9), 0.0, 0.0, 0)],
)
def test_decades_are_divided_within_the_view(view: tuple[float, float], first: float, last: float, count: int) -> None:
    """There is a mark at 2 to 9 times each power of ten that is in view; none where they would be too many."""
    with house_style():
        figure = new_figure(2.0)
        axes = panels(figure, 1, hertz=True)[0][0]
        frequency_axis(axes, view)
        marks = [np.asarray(line.get_xdata(), dtype=float) for line in axes.lines if line.get_marker() == TICKDOWN]
    assert sum(mark.size for mark in marks) == count
    if count:
        assert (marks[0][0], marks[0][-1]) == pytest.approx((first, last))
    assert axes.get_xlim() == view
    assert len(axes.xaxis.get_minor_ticks()) == 0

"""Whether functions of frequency are positive on the whole axis, shown over boxes that cover it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from magbear_cli.analysis.interval import Enclosure

_END = 2.0**-30  # upper end of the box at zero, in units of the frequency where the two halves of the axis meet
_FIRST_RATIO = 1.05  # upper over lower end of the first boxes
_NARROWEST = 1e-9  # relative width of a box that is no longer split
_MOST_BOXES = 200_000


@dataclass(frozen=True)
class AxisCover:
    """What came out: proven, refuted, or neither; where the first doubt is, and what it took."""

    is_positive: bool
    is_refuted: bool
    boxes: int
    narrowest_box: float  # relative width
    x: float = float("nan")  # middle of the first doubtful box, 0 for the box at the end
    fast: bool = False  # whether x counts the inverse of the frequency


def cover_axis(conditions: Callable[[Enclosure, bool], list[Enclosure]]) -> AxisCover:
    """Try to show that every condition is positive for all frequencies.

    Parameters
    ----------
    conditions : their enclosures over boxes of x in [0, 1]: x is the frequency on the slow half (False) and its inverse
        on the fast half (True), both in the unit where the halves meet
    """
    boxes, narrowest = 0, np.inf
    for fast in (False, True):
        edges = np.geomspace(_END, 1.0, int(np.ceil(-np.log(_END) / np.log(_FIRST_RATIO))) + 1)
        edges[0], edges[-1] = _END, 1.0
        lower, upper = np.concatenate([[0.0], edges[:-1]]), edges
        while lower.size:
            boxes += lower.size
            narrowest = min(narrowest, float(((upper - lower) / upper).min()))
            values = conditions(Enclosure.of_variable(lower, upper), fast)
            refuted = np.any([value.centre.high < 0 for value in values], axis=0)
            open_ = ~np.all([value.whole.low > 0 for value in values], axis=0)
            stuck = narrowest < _NARROWEST or boxes + 2 * int(open_.sum()) > _MOST_BOXES
            if refuted.any() or (open_.any() and stuck):
                first = int((refuted if refuted.any() else open_).argmax())
                x = 0.5 * (lower[first] + upper[first]) if lower[first] else 0.0
                return AxisCover(False, bool(refuted.any()), boxes, narrowest, float(x), fast)  # noqa: FBT003
            lower, upper = lower[open_], upper[open_]
            middle = 0.5 * (lower + upper)
            lower, upper = np.concatenate([lower, middle]), np.concatenate([middle, upper])
    return AxisCover(True, False, boxes, narrowest)  # noqa: FBT003

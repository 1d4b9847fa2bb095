"""Fewer points for the same picture: the Ramer-Douglas-Peucker rule on curves that share their abscissa."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

POINTS = 400
_TOLERANCES = (4e-4, 1e-3, 3e-3, 1e-2)  # of the height of the panel; a line is about 6e-3 wide


def thinned(abscissa: Floats, *curves: Floats, points: int = POINTS) -> NDArray[np.intp]:
    """The indices to draw so that no curve moves by more than a fraction of a line's width.

    Parameters
    ----------
    abscissa : (n,) ascending, in the coordinate that is drawn (a logarithm for a logarithmic axis)
    curves : (n,) each, likewise; gaps of NaN are kept as gaps
    points : how many indices are welcome; when a tolerance needs more, a coarser one is tried
    """
    if abscissa.size <= 2:
        return np.arange(abscissa.size)
    kept = np.arange(abscissa.size)
    for tolerance in _TOLERANCES:
        mask = np.zeros(abscissa.size, dtype=bool)
        mask[[0, -1]] = True
        for curve in curves:
            mask |= _needed(abscissa, curve, tolerance)
        kept = np.flatnonzero(mask)
        if kept.size <= points:
            break
    return kept


def _needed(x: Floats, y: Floats, tolerance: float) -> NDArray[np.bool_]:
    finite = np.isfinite(y)
    edges = np.flatnonzero(np.diff(finite.astype(int)))
    mask = np.zeros(x.size, dtype=bool)
    mask[edges] = mask[np.minimum(edges + 1, x.size - 1)] = True
    if not finite.any():
        return mask
    height = float(np.ptp(y[finite])) or 1.0
    filled = np.where(finite, y, float(y[finite].min())) / height
    width = float(x[-1] - x[0]) or 1.0
    stack = [(0, x.size - 1)]
    while stack:
        first, last = stack.pop()
        if last - first < 2:
            continue
        inner = slice(first + 1, last)
        along = (x[inner] - x[first]) / ((x[last] - x[first]) or width)
        chord = filled[first] + along * (filled[last] - filled[first])
        off = np.abs(filled[inner] - chord)
        worst = int(off.argmax())
        if off[worst] > tolerance:
            middle = first + 1 + worst
            mask[middle] = True
            stack += [(first, middle), (middle, last)]
    return mask

"""The largest value of a level over frequency, with the highest peaks between the grid's points looked into."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_HIGH = 0.98  # of the largest value: what counts as a high peak
_MOST_PEAKS = 12  # a level that is flat on purpose has a peak at every ripple
_ZOOMS = 4  # each leaves a fifth of every bracket
_ZOOM_POINTS = 11


def refined_peak(level: Callable[[Floats], Floats], omega_rad_s: Floats) -> tuple[float, float]:
    """The largest level found, and the frequency where it is taken.

    Parameters
    ----------
    level : maps frequencies (k,) to levels (k,)
    omega_rad_s : (w,) ascending grid, 0 and ∞ allowed at its ends, which are looked at and not refined
    """
    values = level(omega_rad_s)
    best = int(values.argmax())
    largest, where = float(values[best]), float(omega_rad_s[best])
    peaks = local_maxima(values, _HIGH * largest)
    peaks = peaks[(peaks > 1) & (peaks < omega_rad_s.size - 2)]
    peaks = peaks[np.argsort(-values[peaks], kind="stable")[:_MOST_PEAKS]]
    low, high, rows = omega_rad_s[peaks - 1], omega_rad_s[peaks + 1], np.arange(peaks.size)
    for _ in range(_ZOOMS if peaks.size else 0):
        points = np.geomspace(low, high, _ZOOM_POINTS, axis=1)
        inside = level(points.ravel()).reshape(points.shape)
        top = inside.argmax(axis=1)
        best = int(inside[rows, top].argmax())
        if inside[best, top[best]] > largest:
            largest, where = float(inside[best, top[best]]), float(points[best, top[best]])
        low, high = points[rows, np.maximum(top - 1, 0)], points[rows, np.minimum(top + 1, _ZOOM_POINTS - 1)]
    return largest, where


def local_maxima(values: Floats, least: float) -> NDArray[np.intp]:
    """The places of the interior local maxima above a value."""
    inner = values[1:-1]
    return np.flatnonzero((inner >= values[:-2]) & (inner >= values[2:]) & (inner > least)) + 1

"""The supremum of a quantity over all frequencies: a grid, both ends, and every peak refined between the points."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_ZOOM_POINTS = 11
_ZOOMS = 7  # each shrinks a bracket fivefold: to 1e-5 of it, where a smooth peak is known to 1e-10
_WORTH_REFINING = 0.9  # a bump lower than this part of the peak is left alone
_MOST_PEAKS = 24
_SECTIONS = 16
_NARROWINGS = 11  # each shrinks a bracket sixteenfold


def supremum(
    quantity: Callable[[Floats], Floats], omega_rad_s: Floats, at_infinity: float = -np.inf
) -> tuple[float, float]:
    """The largest value of a quantity of frequency, and where it is: (value, omega in rad/s).

    Parameters
    ----------
    quantity : maps frequencies (k,) to values (k,)
    omega_rad_s : (w,) ascending grid; its first entry may be zero
    at_infinity : the limit of the quantity at ω → ∞

    Notes
    -----
    Local maxima of the grid (ends included) are zoomed into in log ω, all at once. A value that is not a
    number makes the answer NaN: what cannot be computed is not bounded.
    """
    values = quantity(omega_rad_s)
    if np.isnan(values).any():
        return float("nan"), float(omega_rad_s[int(np.isnan(values).argmax())])
    best = int(values.argmax())
    found = [(float(values[best]), float(omega_rad_s[best])), (float(at_infinity), float("inf"))]
    peaks = _worthwhile_peaks(values, omega_rad_s)
    if peaks.size and np.isfinite(values[best]):
        low = omega_rad_s[np.maximum(peaks - 1, int(omega_rad_s[0] == 0.0))]
        high = omega_rad_s[np.minimum(peaks + 1, omega_rad_s.size - 1)]
        refined_value, refined_omega = _zoomed(quantity, low, high)
        top = int(refined_value.argmax())
        found.append((float(refined_value[top]), float(refined_omega[top])))
    return max(found)


def sign_changes(quantity: Callable[[Floats], Floats], omega_rad_s: Floats) -> Floats:
    """The frequencies (k,) where a quantity changes sign between neighbours of a positive grid, narrowed to rounding.

    Parameters
    ----------
    quantity : maps frequencies (k,) to values (k,)
    omega_rad_s : (w,) positive ascending grid
    """
    values = np.sign(quantity(omega_rad_s))
    change = np.flatnonzero(values[:-1] * values[1:] < 0)
    low, high, sign = omega_rad_s[change], omega_rad_s[change + 1], values[change]
    rows = np.arange(change.size)
    for _ in range(_NARROWINGS if change.size else 0):
        points = low[:, None] * (high / low)[:, None] ** np.linspace(0.0, 1.0, _SECTIONS + 1)
        inner = np.sign(quantity(points[:, 1:-1].ravel())).reshape(change.size, -1)
        # the first inner point past the change, or the upper end
        place = np.concatenate([inner != sign[:, None], np.ones((change.size, 1), dtype=bool)], axis=1).argmax(axis=1)
        low, high = points[rows, place], points[rows, place + 1]
    return np.asarray(np.sqrt(low * high), dtype=float)


def _zoomed(quantity: Callable[[Floats], Floats], low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """The maxima (values, omegas), each (k,), in brackets [low, high], by looking ever closer around the best point."""
    left, right = np.log(low), np.log(high)
    rows = np.arange(left.size)
    best_value, best_omega = np.full(left.size, -np.inf), low.copy()
    for _ in range(_ZOOMS):
        points = left[:, None] + (right - left)[:, None] * np.linspace(0.0, 1.0, _ZOOM_POINTS)
        values = quantity(np.exp(points).ravel()).reshape(points.shape)
        top = values.argmax(axis=1)
        better = values[rows, top] > best_value
        best_value = np.where(better, values[rows, top], best_value)
        best_omega = np.where(better, np.exp(points[rows, top]), best_omega)
        left, right = points[rows, np.maximum(top - 1, 0)], points[rows, np.minimum(top + 1, _ZOOM_POINTS - 1)]
    return best_value, best_omega


def _worthwhile_peaks(values: Floats, omega_rad_s: Floats) -> NDArray[np.intp]:
    padded = np.concatenate([[-np.inf], values, [-np.inf]])
    local = (padded[1:-1] >= padded[:-2]) & (padded[1:-1] >= padded[2:]) & np.isfinite(values)
    top = float(values.max())
    local &= values >= top - (1.0 - _WORTH_REFINING) * abs(top)
    local &= omega_rad_s > 0.0
    peaks = np.flatnonzero(local)
    return peaks[np.argsort(-values[peaks], kind="stable")[:_MOST_PEAKS]]

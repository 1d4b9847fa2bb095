"""Frequencies around the resonances of lightly damped roots: what a logarithmic grid would step over."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

_LIGHT_DAMPING = 0.3
_NARROWEST = 1e-9  # of the modulus: the half-width of a root that is as good as undamped


def resonance_frequencies(roots_rad_s: ArrayLike) -> NDArray[np.float64]:
    """Frequencies (k,) in rad/s at distances from a tenth to 30 half-widths of each lightly damped root.

    Never at the resonance itself: an undamped pole has no response there. Roots (n,) are poles or zeros, of either sign
    of the imaginary part.
    """
    light = lightly_damped(roots_rad_s)
    steps = np.geomspace(0.1, 30.0, 16)
    steps = np.concatenate([-steps[::-1], steps])
    width = np.maximum(np.abs(light.real), _NARROWEST * np.abs(light))
    points = (light.imag[:, None] + width[:, None] * steps).ravel()
    return np.asarray(points[points > 0], dtype=float)


def lightly_damped(roots_rad_s: ArrayLike) -> NDArray[np.complex128]:
    """The roots (k,) of positive imaginary part that make a peak or a dip too narrow for a logarithmic grid."""
    roots = np.asarray(roots_rad_s, dtype=complex)
    light = (np.abs(roots.real) < _LIGHT_DAMPING * np.abs(roots)) & (roots.imag > 0)
    return np.asarray(roots[light], dtype=complex)

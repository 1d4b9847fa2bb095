"""Few stable poles for a function known by its samples: orthonormal vector fitting."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from magbear_cli.synthesis.all_pass_sections import Sections

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_ROUNDS = 20
_LEAST_DAMPING = 0.02  # of a pole's size


def fit_poles(values: Complexes, weights: Floats, omega_rad_s: Floats, start: Sections) -> Sections:
    """The poles, as many as the start has, of a rational function near the values in weighted least squares.

    Each round fits N − values·D = 0 with N and D = 1 + … over the present poles; the zeros of D, mirrored into the left
    half-plane, are the next poles (Gustavsen and Semlyen, "Rational approximation of frequency domain responses by
    vector fitting", IEEE T. Power Delivery 1999; over orthonormal functions Deschrijver, Haegeman and Dhaene 2007).
    The poles of the round with the least residual are returned.

    Parameters
    ----------
    values : (w,), weights : (w,) positive, omega_rad_s : (w,) finite
    """
    sections, best, least = start, start, np.inf
    target = _real((values * weights)[:, None])[:, 0]
    for _ in range(_ROUNDS):
        functions = sections.functions(omega_rad_s) * weights[:, None]
        matrix = _real(np.asarray(np.hstack([functions, -values[:, None] * functions[:, 1:]])))
        size = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
        solution = np.linalg.lstsq(matrix / size, target, rcond=1e-13)[0] / size
        a, enter, unit = sections.chain()
        zeros = np.linalg.eigvals(a - np.outer(enter, solution[functions.shape[1] :] * unit)).astype(complex)
        damping = np.maximum(np.abs(zeros.real), _LEAST_DAMPING * np.abs(zeros))
        sections = Sections.of_poles(-damping + 1j * zeros.imag)
        numerator = _real(sections.functions(omega_rad_s) * weights[:, None])
        residual = numerator @ np.linalg.lstsq(numerator, target, rcond=None)[0] - target
        if float(residual @ residual) < least:
            best, least = sections, float(residual @ residual)
    return best


def _real(columns: Complexes) -> Floats:
    return np.asarray(np.vstack([columns.real, columns.imag]), dtype=float)

"""The D-step: the D-scales of mu on a grid, and rational functions that follow them where it matters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from magbear_cli.kernels.structured_singular_value import mu_upper_bound
from magbear_cli.lti.balancing import with_balanced_states
from magbear_cli.lti.connection import append, inverse, series
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.synthesis.peak import refined_peak
from magbear_cli.synthesis.scale_fit import ScaleFit, fit_scale

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

# An error of log D where mu is far below its peak costs nothing today, but the next controller may be stopped by it:
# weights are the sensitivity of the bound times mu/peak to each of these powers, and every fit is worth a try.
_FLATTENINGS = (0.0, 0.5, 2.0)
_NUDGE = 0.3  # of log d, in the central difference for the sensitivity


@dataclass(frozen=True, eq=False)
class RationalScales:
    """One rational D-scale a channel, and the largest σ(D M D⁻¹) they give on the grid."""

    fits: tuple[ScaleFit, ...]
    level: float

    def around(self, plant: StateSpace) -> StateSpace:
        """D P D⁻¹: the plant for the next controller; its last input and output are control and measurement."""
        unit = StateSpace.gain([[1.0]])
        systems = [fit.system() for fit in self.fits]
        left = reduce(append, [*systems, unit])
        right = reduce(append, [*(inverse(system) for system in systems), unit])
        return with_balanced_states(series(series(right, plant), left))

    def norm(self, loop: StateSpace, omega_rad_s: Floats) -> float:
        """The largest σ(D M D⁻¹) of a closed loop M on a dense grid, ∞ when the loop is not stable.

        The states of D and D⁻¹, which cancel in part, are kept out of the loop: this costs less and loses nothing.
        """
        if loop.poles().real.max() >= 0.0:
            return float("inf")
        inner = omega_rad_s[np.isfinite(omega_rad_s)]
        return _level(self.fits, frequency_response(loop, inner), inner)


def peak_mu(loop: StateSpace, omega_rad_s: Floats) -> tuple[float, float]:
    """The peak of the upper bound of mu of a closed loop with scalar blocks, refined between the points, and where.

    It says nothing about the loop's stability.
    """
    return refined_peak(lambda omega: mu_upper_bound(frequency_response(loop, omega))[0], omega_rad_s)


def fit_scales(loop: StateSpace, omega_rad_s: Floats, order: int, *, every_scale: bool) -> list[RationalScales]:
    """Rational D-scales for a closed loop, one set for each weighting, the best on the grid first.

    Parameters
    ----------
    omega_rad_s : (w,) positive ascending grid
    order : states of each scale
    every_scale : fit all scales, in the normalisation of product one; otherwise the last scale is one
    """
    matrices = frequency_response(loop, omega_rad_s)
    mu, d = mu_upper_bound(matrices)
    sensitivity = np.sqrt(_sensitivity(matrices, d))
    log_d = np.log(d) if every_scale else np.log(d / d[:, -1:])
    fitted = range(d.shape[1] if every_scale else d.shape[1] - 1)
    sets = []
    for power in _FLATTENINGS:
        weights = sensitivity * ((mu / mu.max()) ** power)[:, None]
        fits = [ScaleFit(0.0, np.empty(0), np.empty(0))] * d.shape[1]
        for channel in fitted:
            candidates = fit_scale(omega_rad_s, log_d[:, channel], weights[:, channel], order)
            fits[channel] = _best(candidates, matrices, log_d, channel, omega_rad_s)
        sets.append(RationalScales(tuple(fits), _level(fits, matrices, omega_rad_s)))
    return sorted(sets, key=lambda scales: scales.level)


def _best(candidates: Sequence[ScaleFit], matrices: Complexes, log_d: Floats, channel: int, omega: Floats) -> ScaleFit:
    """The fit with which, all other scales exact, the bound rises least at its peak."""

    def level(fit: ScaleFit) -> float:
        trial = log_d.copy()
        trial[:, channel] = fit.log_magnitude(omega)
        return float(_bound(matrices, trial).max())

    return min(candidates, key=level)


def _level(fits: Sequence[ScaleFit], matrices: Complexes, omega: Floats) -> float:
    return float(_bound(matrices, np.stack([fit.log_magnitude(omega) for fit in fits], axis=1)).max())


def _bound(matrices: Complexes, log_d: Floats) -> Floats:
    """σ(D M D⁻¹) at each frequency, (w,)."""
    scaled = np.exp(log_d[:, :, None] - log_d[:, None, :]) * matrices
    return np.asarray(np.linalg.norm(scaled, 2, axis=(1, 2)))


def _sensitivity(matrices: Complexes, d: Floats) -> Floats:
    """The curvature of log σ(D M D⁻¹) in each log d at the least value, (w, n): its slope there is zero."""
    log_d = np.log(d)
    least = _bound(matrices, log_d)
    curvature = np.zeros(d.shape)
    for channel in range(d.shape[1]):
        nudge = _NUDGE * (np.arange(d.shape[1]) == channel)
        both = _bound(matrices, log_d + nudge) + _bound(matrices, log_d - nudge)
        curvature[:, channel] = np.maximum(both / least - 2.0, 1e-12) / _NUDGE**2
    return curvature

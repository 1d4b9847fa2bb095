"""A rational function whose modulus follows a D-scale given on a grid: stable and minimum phase by construction.

D(s) = exp(g) Π (1 + s/z_k)/Π (1 + s/p_k) with real positive z_k, p_k, fitted to log |D| by least squares in g, log z_k
and log p_k. The D-scales of mu rise and fall slowly in log ω, which real corners follow well.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from magbear_cli.lti.balancing import with_balanced_states
from magbear_cli.lti.connection import series
from magbear_cli.lti.conversion import from_transfer_function
from magbear_cli.lti.state_space import StateSpace

Floats = NDArray[np.float64]

_EDGE = 0.98  # of half the window: where a start on its edge begins, so that it can still move
_EVALUATIONS = 60  # of one least-squares descent; what is left to gain then is below the error of the fit
_MATTERS = 0.05  # of the largest weight: corners start where the weights are above it
_MARGINS = (0.0, 0.15, 0.3)  # of the logarithmic width of that range, left free at both of its ends


@dataclass(frozen=True, eq=False)
class ScaleFit:
    """D(s) with real zeros and poles, the same number of each.

    Parameters
    ----------
    log_gain : the logarithm of D(0)
    zeros_rad_s, poles_rad_s : (n,) positive arrays; the roots are their negatives
    """

    log_gain: float
    zeros_rad_s: Floats
    poles_rad_s: Floats

    def log_magnitude(self, omega_rad_s: Floats) -> Floats:
        """The logarithm of |D(jω)|, (w,), at finite frequencies."""
        return _log_magnitude(self._unknowns(), omega_rad_s)

    def system(self) -> StateSpace:
        """D as a chain of first-order sections; D(∞) is not zero, so that it has a proper inverse."""
        system = StateSpace.gain([[np.exp(self.log_gain)]])
        for zero, pole in zip(np.sort(self.zeros_rad_s), np.sort(self.poles_rad_s), strict=True):
            system = series(system, from_transfer_function([1.0 / zero, 1.0], [1.0 / pole, 1.0]))
        return with_balanced_states(system)

    def _unknowns(self) -> Floats:
        return np.concatenate([[self.log_gain], np.log(self.zeros_rad_s), np.log(self.poles_rad_s)])


def fit_scale(omega_rad_s: Floats, log_d: Floats, weights: Floats, order: int) -> list[ScaleFit]:
    """Fits of log |D|, each the end of a descent of its own, those of the least weighted squares first.

    Parameters
    ----------
    omega_rad_s : (w,) positive ascending grid; the corners stay within it, where the data can tell of them
    log_d : (w,) array
    weights : (w,) nonnegative array: how much an error of log |D| costs at each frequency
    order : number of zeros and of poles
    """
    if order == 0:
        return [ScaleFit(float(np.average(log_d, weights=weights**2)), np.empty(0), np.empty(0))]
    window = _Window(float(np.log(omega_rad_s[0])), float(np.log(omega_rad_s[-1])))

    def residual(free: Floats) -> Floats:
        return weights * (_log_magnitude(window.inside(free), omega_rad_s) - log_d)

    def jacobian(free: Floats) -> Floats:
        return weights[:, None] * _slopes(window.inside(free), omega_rad_s) * window.slopes(free)

    answers = []
    for start in _starts(omega_rad_s, weights, order):
        start[0] = np.average(log_d - _log_magnitude(start, omega_rad_s), weights=weights**2)
        answers.append(least_squares(residual, window.outside(start), jacobian, method="lm", max_nfev=_EVALUATIONS))
    answers.sort(key=lambda answer: float(answer.cost))
    found = [window.inside(answer.x) for answer in answers]
    return [ScaleFit(float(x[0]), np.exp(x[1 : order + 1]), np.exp(x[order + 1 :])) for x in found]


@dataclass(frozen=True)
class _Window:
    """The range of the logarithms of the corners, reached by a hyperbolic tangent from numbers without bounds."""

    low: float
    high: float

    def inside(self, free: Floats) -> Floats:
        """The unknowns: the gain as it is, the corners in the window."""
        middle, half = (self.low + self.high) / 2.0, (self.high - self.low) / 2.0
        return np.concatenate([free[:1], middle + half * np.tanh(free[1:])])

    def outside(self, unknowns: Floats) -> Floats:
        """The numbers that ``inside`` takes to these unknowns, or near them if they lie on the edge."""
        middle, half = (self.low + self.high) / 2.0, (self.high - self.low) / 2.0
        return np.concatenate([unknowns[:1], np.arctanh(np.clip((unknowns[1:] - middle) / half, -_EDGE, _EDGE))])

    def slopes(self, free: Floats) -> Floats:
        """The derivatives of ``inside``, one for each unknown."""
        return np.concatenate([[1.0], (self.high - self.low) / 2.0 * (1.0 - np.tanh(free[1:]) ** 2)])


def _log_magnitude(unknowns: Floats, omega: Floats) -> Floats:
    order = unknowns.size // 2
    squares = (omega[:, None] * np.exp(-unknowns[1:])) ** 2
    terms = 0.5 * np.log1p(squares)
    return np.asarray(unknowns[0] + terms[:, :order].sum(axis=1) - terms[:, order:].sum(axis=1))


def _slopes(unknowns: Floats, omega: Floats) -> Floats:
    """The derivatives of log |D| by the unknowns, (w, 2n + 1)."""
    order = unknowns.size // 2
    squares = (omega[:, None] * np.exp(-unknowns[1:])) ** 2
    slopes = squares / (1.0 + squares)
    slopes[:, :order] *= -1.0
    return np.concatenate([np.ones((omega.size, 1)), slopes], axis=1)


def _starts(omega: Floats, weights: Floats, order: int) -> Iterator[Floats]:
    """Zeros and poles by turns, evenly spread over the frequencies that matter; either may be first."""
    matters = np.log(omega[weights > _MATTERS * weights.max()])
    width = matters[-1] - matters[0]
    for margin in _MARGINS:
        corners = np.linspace(matters[0] + margin * width, matters[-1] - margin * width, 2 * order)
        for first in (0, 1):
            yield np.concatenate([[0.0], corners[first::2], corners[1 - first :: 2]])

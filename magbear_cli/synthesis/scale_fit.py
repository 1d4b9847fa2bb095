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

_LARGEST_LOG_GAIN = 100.0
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
    bounds = _bounds(omega_rad_s, order)

    def residual(unknowns: Floats) -> Floats:
        return weights * (_log_magnitude(unknowns, omega_rad_s) - log_d)

    def jacobian(unknowns: Floats) -> Floats:
        return weights[:, None] * _slopes(unknowns, omega_rad_s)

    answers = []
    for start in _starts(omega_rad_s, weights, order):
        start[0] = np.average(log_d - _log_magnitude(start, omega_rad_s), weights=weights**2)
        inside = np.clip(start, bounds[0] + 1e-6, bounds[1] - 1e-6)
        answers.append(least_squares(residual, inside, jacobian, bounds=bounds, max_nfev=_EVALUATIONS))
    answers.sort(key=lambda answer: float(answer.cost))
    return [
        ScaleFit(float(answer.x[0]), np.exp(answer.x[1 : order + 1]), np.exp(answer.x[order + 1 :]))
        for answer in answers
    ]


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


def _bounds(omega: Floats, order: int) -> tuple[Floats, Floats]:
    low, high = np.full(2 * order + 1, np.log(omega[0])), np.full(2 * order + 1, np.log(omega[-1]))
    low[0], high[0] = -_LARGEST_LOG_GAIN, _LARGEST_LOG_GAIN
    return low, high


def _starts(omega: Floats, weights: Floats, order: int) -> Iterator[Floats]:
    """Zeros and poles by turns, evenly spread over the frequencies that matter; either may be first."""
    matters = np.log(omega[weights > _MATTERS * weights.max()])
    width = matters[-1] - matters[0]
    for margin in _MARGINS:
        corners = np.linspace(matters[0] + margin * width, matters[-1] - margin * width, 2 * order)
        for first in (0, 1):
            yield np.concatenate([[0.0], corners[first::2], corners[1 - first :: 2]])

"""A controller K = X/Y, where X and Y are real combinations of a constant and of first-order lags they share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.lti.state_space import StateSpace


def lag_basis(poles_rad_s: NDArray[np.float64], omega_rad_s: NDArray[np.float64]) -> NDArray[np.complex128]:
    """1 and p/(jω + p) for each pole p > 0, of shape (w, n + 1); ∞ is a legal frequency."""
    finite = np.isfinite(omega_rad_s)[:, None]
    s = 1j * np.where(finite, omega_rad_s[:, None], 0.0)
    lags = np.where(finite, poles_rad_s / (s + poles_rad_s), 0.0)
    return np.concatenate([np.ones((omega_rad_s.size, 1), dtype=complex), lags], axis=1)


@dataclass(frozen=True, eq=False)
class LagRatio:
    """K = X/Y with X = x0 + Σ x_k p_k/(s + p_k), Y likewise; n distinct poles make every proper K of order n.

    Parameters
    ----------
    poles : (n,) positive array
    x, y : (n + 1,) arrays; y[0] = 1
    """

    poles: NDArray[np.float64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]

    def numerator_denominator(
        self, omega_rad_s: NDArray[np.float64]
    ) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """X(jω) and Y(jω)."""
        basis = lag_basis(self.poles, omega_rad_s)
        return basis @ self.x, basis @ self.y

    def response(self, omega_rad_s: NDArray[np.float64]) -> NDArray[np.complex128]:
        """K(jω), (w,)."""
        numerator, denominator = self.numerator_denominator(omega_rad_s)
        return np.asarray(numerator / denominator)

    def with_lag(self, pole: float) -> LagRatio:
        """The same controller with one more lag, which it does not use yet."""
        return LagRatio(np.append(self.poles, pole), np.append(self.x, 0.0), np.append(self.y, 0.0))

    def controller(self) -> StateSpace:
        """The quotient as a state-space system of order n.

        With the lags driven by w = e/Y, that is w = e − Σ y_k v_k, the output is X w: no polynomial is formed.
        """
        root = np.sqrt(self.poles)
        a = np.diag(-self.poles) - np.outer(root, self.y[1:] * root)
        c = (self.x[1:] - self.x[0] * self.y[1:]) * root
        return StateSpace.of(a, root[:, None], c[None, :], [[self.x[0]]])

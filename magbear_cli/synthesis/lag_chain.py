"""A controller K = X/Y over a chain of all-pass sections: real poles, orthonormal functions, no polynomials."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.lti.state_space import StateSpace

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def chain_basis(poles_rad_s: Floats, omega_rad_s: Floats) -> Complexes:
    """1 and 2 p_k/(jω + p_k) Π_{i<k} (jω − p_i)/(jω + p_i), of shape (w, n + 1); ∞ is a legal frequency.

    These are the Takenaka-Malmquist functions: with a constant they span what the lags 1/(s + p_k) span, but they are
    orthogonal on the axis, so that dense poles do not spoil the conditioning of their coefficients.
    """
    finite = np.isfinite(omega_rad_s)[:, None]
    s = 1j * np.where(finite, omega_rad_s[:, None], 0.0)
    ones = np.ones((omega_rad_s.size, 1), dtype=complex)
    passed = np.where(finite, (s - poles_rad_s) / (s + poles_rad_s), 1.0)[:, :-1]
    lags = np.where(finite, 2.0 * poles_rad_s / (s + poles_rad_s), 0.0)
    return np.concatenate([ones, lags * np.cumprod(np.concatenate([ones, passed], axis=1), axis=1)], axis=1)


@dataclass(frozen=True, eq=False)
class ChainRatio:
    """K = X/Y with X and Y real combinations of the chain's functions; n poles make a K of order n.

    Parameters
    ----------
    poles : (n,) positive array
    x, y : (n + 1,) arrays; y[0] is not zero
    """

    poles: Floats
    x: Floats
    y: Floats

    def numerator_denominator(self, omega_rad_s: Floats) -> tuple[Complexes, Complexes]:
        """X(jω) and Y(jω)."""
        basis = chain_basis(self.poles, omega_rad_s)
        return basis @ self.x, basis @ self.y

    def response(self, omega_rad_s: Floats) -> Complexes:
        """K(jω), (w,)."""
        numerator, denominator = self.numerator_denominator(omega_rad_s)
        return np.asarray(numerator / denominator)

    def controller(self) -> StateSpace:
        """The quotient as a state-space system of order n.

        Section k has the state v_k' = −p_k v_k + √(2 p_k) e_k, passes e_{k+1} = e_k − √(2 p_k) v_k on, and √(2 p_k) v_k
        is its basis function; so A + Aᵀ = −B Bᵀ. The chain is driven by w = (e − Σ y_k √(2 p_k) v_k)/y0.
        """
        root = np.sqrt(2.0 * self.poles)
        a = -np.tril(np.outer(root, root), -1) - np.diag(self.poles)
        direct = self.x[0] / self.y[0]
        x_row, y_row = self.x[1:] * root / self.y[0], self.y[1:] * root / self.y[0]
        return StateSpace.of(a - np.outer(root, y_row), root[:, None], (x_row - direct * y_row)[None, :], [[direct]])

"""All stabilising controllers of the nominal plant, K = (U0 + M Q)/(V0 + N Q), with Q in the span of first-order lags.

In the scaled problem G = 1/(s² − 1) at the nominal mass. With M = (s² − 1)/(s + α)² and N = 1/(s + α)² the Bezout
identity M V0 − N U0 = 1 gives V0 = v/(s + α)² and U0 = u/(s + α)², where v = s² + 4 α s + 6 α² + 1 and
u = −(4 α³ + 4 α) s − α⁴ − 6 α² − 1. The closed loop depends on Q through K S = M (U0 + M Q), which is affine.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.lti.state_space import StateSpace
from magbear_cli.synthesis.lag_ratio import lag_basis

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class YoulaController:
    """The controller of the scaled nominal plant with Q = q0 + Σ q_k p_k/(s + p_k).

    Parameters
    ----------
    alpha : the speed of the factors
    poles : (n,) positive array
    q : (n + 1,) array
    """

    alpha: float
    poles: Floats
    q: Floats

    def _numerators(self, s: Complexes) -> tuple[Complexes, Complexes]:
        alpha = self.alpha
        u = -(4 * alpha**3 + 4 * alpha) * s - alpha**4 - 6 * alpha**2 - 1
        return u, s**2 + 4 * alpha * s + 6 * alpha**2 + 1

    def response(self, omega_rad_s: Floats) -> Complexes:
        """K(jω), (w,); at ∞ it is Q(∞)."""
        finite = np.isfinite(omega_rad_s)
        s = 1j * np.where(finite, omega_rad_s, 1.0)
        free = lag_basis(self.poles, omega_rad_s) @ self.q
        u, v = self._numerators(s)
        return np.asarray(np.where(finite, (u + (s**2 - 1) * free) / (v + free), free))

    def affine_terms(self, omega_rad_s: Floats) -> tuple[Complexes, Complexes]:
        """K S = r0 + B q on the axis: r0 (w,) and B (w, n + 1)."""
        finite = np.isfinite(omega_rad_s)
        s = 1j * np.where(finite, omega_rad_s, 1.0)
        factor = np.where(finite, (s**2 - 1) / (s + self.alpha) ** 2, 1.0)
        offset = np.where(finite, self._numerators(s)[0] / (s + self.alpha) ** 2, 0.0)
        return factor * offset, (factor**2)[:, None] * lag_basis(self.poles, omega_rad_s)

    def controller(self) -> StateSpace:
        """The controller with two states for the observer and one for each lag.

        The observer-based form of the same factors (Zhou, Doyle and Glover, Robust and Optimal Control, 1996,
        chapter 12): state feedback F and injection L each put both poles at −alpha.
        """
        alpha, poles = self.alpha, self.poles
        a = np.array([[0.0, 1.0], [1.0, 0.0]])
        b, c = np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]])
        feedback = np.array([[-(alpha**2) - 1.0, -2.0 * alpha]])
        injection = np.array([[-2.0 * alpha], [-(alpha**2) - 1.0]])
        # xhat' = (A + B F + L C) xhat − L y + B v, u = F xhat + v, v = Q (y − C xhat)
        root = np.sqrt(poles)
        q_b, q_c, q_d = root[:, None], (self.q[1:] * root)[None, :], self.q[0]
        observer = a + b @ feedback + injection @ c - q_d * (b @ c)
        state = np.block([[observer, b @ q_c], [-q_b @ c, np.diag(-poles)]])
        enter = np.concatenate([-injection + q_d * b, q_b])
        leave = np.concatenate([feedback - q_d * c, q_c], axis=1)
        return StateSpace.of(state, enter, leave, [[q_d]])

"""The adaptive law of local function estimation (thesis section 4.4) as numbers: gains, reference model, sphere.

With x = (position, speed) of the measured signal, e = x_m − x and x_m' = A_m x_m + B_m r:

    u = −K x + (ω²/b) r − u_ad,    u_ad = C0 + C1 (x − x_i),
    C0' = −γ bᵀP e,    C1' = −γ bᵀP e (x − x_i)ᵀ    while the adaptation is on, else 0.

Signs. u_ad is subtracted, so where the rotor lags (e > 0) it must fall for the current to rise: hence the minus, which
the thesis leaves to the reader. With A_mᵀP + P A_m = −I this makes eᵀPe + |C − C*|²/γ fall for every unknown force that
enters where the current does.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError


class Trigger(StrEnum):
    """Which error leaves the sphere: that of the position, or the norm of position (m) and speed (m/s) together."""

    POSITION = "position"
    STATE = "state"


@dataclass(frozen=True)
class AdaptiveLaw:
    """State feedback towards a reference model, and an estimate of the unknown force that learns outside a sphere.

    Attributes
    ----------
    omega_rad_s, zeta : the reference model ω²/(s² + 2 ζ ω s + ω²) (thesis eqs. 4.12-4.15)
    gain_position_a_per_m, gain_speed_a_s_per_m : K
    input_gain_m_per_s2_a : b, the acceleration per ampere that the law presumes
    gamma : the adaptation gain, in the units that make C0 an ampere: A² s/m², up to those hidden in P
    rho_m, sigma_m : the adaptation begins at ‖e‖ >= rho + sigma and ends at ‖e‖ < rho − sigma
    taylor_order : 0 for a constant alone, 1 for a constant and its slopes
    trigger : what ‖e‖ is
    adaptation_input_gain_m_per_s2_a : the b of the adaptation's bᵀP e; None for that of the law
    """

    omega_rad_s: float
    zeta: float
    gain_position_a_per_m: float
    gain_speed_a_s_per_m: float
    input_gain_m_per_s2_a: float
    gamma: float
    rho_m: float
    sigma_m: float
    taylor_order: int = 1
    trigger: Trigger = Trigger.POSITION
    adaptation_input_gain_m_per_s2_a: float | None = None

    def __post_init__(self) -> None:
        """Refuse numbers that describe no law."""
        for name in ("omega_rad_s", "zeta", "input_gain_m_per_s2_a", "rho_m"):
            if not 0 < getattr(self, name) < np.inf:
                raise NumericsError(f"{name} must be a positive number, not {getattr(self, name)}")
        own = self.adaptation_input_gain_m_per_s2_a
        if own is not None and not 0 < own < np.inf:
            raise NumericsError(f"adaptation_input_gain_m_per_s2_a must be a positive number, not {own}")
        if not 0 <= self.gamma < np.inf:
            raise NumericsError(f"gamma must be zero or positive, not {self.gamma}")
        if not 0 <= self.sigma_m <= self.rho_m:
            raise NumericsError(f"sigma_m must lie in 0 to rho_m = {self.rho_m}, not {self.sigma_m}")
        if not np.isfinite([self.gain_position_a_per_m, self.gain_speed_a_s_per_m]).all():
            raise NumericsError("the state feedback gain must hold finite numbers")
        if self.taylor_order not in {0, 1}:
            raise NumericsError(f"taylor_order must be 0 or 1, not {self.taylor_order}")
        if self.trigger not in tuple(Trigger):
            raise NumericsError(f"trigger must be position or state, not {self.trigger}")

    @cached_property
    def lyapunov(self) -> NDArray[np.float64]:
        """P (2, 2), the solution of A_mᵀP + P A_m = −I, in closed form (thesis eq. 4.11)."""
        square, damping = self.omega_rad_s**2, 2.0 * self.zeta * self.omega_rad_s
        cross = 0.5 / square
        speed = (1.0 + 2.0 * cross) / (2.0 * damping)
        return np.array([[damping * cross + square * speed, cross], [cross, speed]])

    @property
    def adaptation_gain(self) -> float:
        """γ b, from P e to the rate of the estimate."""
        return self.gamma * (self.adaptation_input_gain_m_per_s2_a or self.input_gain_m_per_s2_a)

    @property
    def feedforward_a_per_m(self) -> float:
        """ω²/b, from the command to the current."""
        return self.omega_rad_s**2 / self.input_gain_m_per_s2_a

    @property
    def outer_m(self) -> float:
        """Rho + sigma: where the adaptation begins."""
        return self.rho_m + self.sigma_m

    @property
    def inner_m(self) -> float:
        """Rho − sigma: where it ends."""
        return self.rho_m - self.sigma_m

"""The force of a pair of electromagnets on the rotor between them, exactly and linearised at any operating point.

Positions are measured from the middle of the gap, z > 0 towards the upper magnet; u > 0 pulls up. The linear model is
m z̈ = k_z z + k_i u with k_z > 0: the bearing without control is unstable.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magbear_cli.errors import NumericsError

Floats = NDArray[np.float64]


class CurrentLaw(StrEnum):
    """How the amplifiers turn the control current u into the two coil currents."""

    FULL = "full"
    HALF_SWITCHED = "half_switched"


@dataclass(frozen=True)
class Bearing:
    """A thrust bearing: the air gap at the middle, the force constant, the bias current and the law of the currents.

    ``full``: the coils carry i0 + u and i0 − u (thesis eq. 2.1). The equation is kept as printed: beyond |u| > i0 one
    current is negative, and because the force goes with its square that coil still pulls.

    ``half_switched``: the coils carry i0 + u/2 and i0 − u/2, and a coil whose current would be negative, |u| > 2 i0,
    is switched off (thesis eq. 4.1).
    """

    air_gap_m: float
    force_constant_n_m2_per_a2: float
    bias_current_a: float
    current_law: CurrentLaw = CurrentLaw.FULL

    def __post_init__(self) -> None:
        """Refuse figures that are not positive and finite, and an unknown law of the currents."""
        for name in ("air_gap_m", "force_constant_n_m2_per_a2", "bias_current_a"):
            if not 0 < getattr(self, name) < np.inf:
                raise NumericsError(f"{name} must be a positive number, not {getattr(self, name)}")
        if self.current_law not in tuple(CurrentLaw):
            raise NumericsError(f"current_law must be full or half_switched, not {self.current_law}")

    @property
    def current_share(self) -> float:
        """The share of u that reaches each coil: 1 in the full law, 1/2 in the half law."""
        return 1.0 if self.current_law == CurrentLaw.FULL else 0.5

    @property
    def switching_current_a(self) -> float:
        """The |u| beyond which one coil is off: 2 i0 in the half law, infinite in the full law."""
        return np.inf if self.current_law == CurrentLaw.FULL else 2.0 * self.bias_current_a


@dataclass(frozen=True)
class Linearization:
    """m z̈ = force + k_z (z − z_op) + k_i (u − u_op) about an operating point."""

    negative_stiffness_n_per_m: float
    current_stiffness_n_per_a: float
    force_n: float


def coil_currents(bearing: Bearing, current_a: ArrayLike) -> tuple[Floats, Floats]:
    """The currents of the upper and of the lower coil in A, each of the shape of the control current."""
    share = bearing.current_share * np.asarray(current_a, dtype=float)
    upper, lower = bearing.bias_current_a + share, bearing.bias_current_a - share
    if bearing.current_law == CurrentLaw.HALF_SWITCHED:
        return np.maximum(upper, 0.0), np.maximum(lower, 0.0)
    return upper, lower


def magnetic_force(bearing: Bearing, position_m: ArrayLike, current_a: ArrayLike) -> Floats:
    """The force k0 (i_upper²/(z0 − z)² − i_lower²/(z0 + z)²) in N, thesis eqs. 2.1 and 4.1 without gravity.

    Positions and currents broadcast. At the magnets and beyond them the force has no meaning and is NaN.
    """
    position = np.asarray(position_m, dtype=float)
    inside = np.where(np.abs(position) < bearing.air_gap_m, position, np.nan)
    return force_and_slopes(bearing, inside, np.asarray(current_a, dtype=float))[0]


def force_and_slopes(bearing: Bearing, position_m: Floats, current_a: Floats) -> tuple[Floats, Floats, Floats]:
    """The force in N, ∂F/∂z in N/m and ∂F/∂u in N/A; arrays that broadcast, of positions inside the gap.

    At |u| = 2 i0 of the half law the slopes are still continuous; the curvature is not.
    """
    k0, share = bearing.force_constant_n_m2_per_a2, bearing.current_share
    upper, lower = coil_currents(bearing, current_a)
    above, below = bearing.air_gap_m - position_m, bearing.air_gap_m + position_m
    field_upper, field_lower = upper / above, lower / below  # up to constants
    pull_upper, pull_lower = k0 * field_upper**2, k0 * field_lower**2
    return (
        pull_upper - pull_lower,
        2.0 * (pull_upper / above + pull_lower / below),
        2.0 * share * k0 * (field_upper / above + field_lower / below),
    )


def force_in_floats(bearing: Bearing) -> Callable[[float, float], float]:
    """The same force of one position (m) and one current (A), without the cost of arrays; NaN outside the gap."""
    k0, bias, share, gap = (
        bearing.force_constant_n_m2_per_a2, bearing.bias_current_a, bearing.current_share, bearing.air_gap_m,
    )  # fmt: skip
    least = 0.0 if bearing.current_law == CurrentLaw.HALF_SWITCHED else -np.inf

    def force(position_m: float, current_a: float) -> float:
        if not -gap < position_m < gap:
            return np.nan
        upper = max(bias + share * current_a, least) / (gap - position_m)
        lower = max(bias - share * current_a, least) / (gap + position_m)
        return k0 * (upper * upper - lower * lower)

    return force


def linearization(bearing: Bearing, position_m: float = 0.0, current_a: float = 0.0) -> Linearization:
    """The force and its exact slopes at an operating point (thesis eqs. 2.5, 2.6 at the origin, eq. 4.2 elsewhere).

    At the origin k_z = 4 k0 i0²/z0³, and k_i = 4 k0 i0/z0² in the full law, half of it in the half law.

    Raises
    ------
    NumericsError
        when the position is not inside the gap or a number is not finite.
    """
    if not (abs(position_m) < bearing.air_gap_m and np.isfinite(current_a)):
        raise NumericsError(
            f"the operating point {position_m} m, {current_a} A is not inside the gap of {bearing.air_gap_m} m"
        )
    force, stiffness, gain = force_and_slopes(bearing, np.asarray(position_m), np.asarray(current_a))
    return Linearization(float(stiffness), float(gain), float(force))


def balancing_current(bearing: Bearing, force_n: float, position_m: float = 0.0) -> float:
    """The control current in A whose exact force at a position is the given one.

    With p = k0/(z0 − z)² and q = k0/(z0 + z)² the force of the full law is a quadratic in the current, and of its
    two roots the one that is continuous with the middle of the gap is taken. The half law rises monotonically from
    −∞ to ∞: the same quadratic within the switching current, one coil's square root beyond it.

    Raises
    ------
    NumericsError
        when the position is not inside the gap, or no current of the full law makes that force.
    """
    if not (abs(position_m) < bearing.air_gap_m and np.isfinite(force_n)):
        raise NumericsError(f"no current is sought for {force_n} N at {position_m} m")
    k0, bias = bearing.force_constant_n_m2_per_a2, bearing.bias_current_a
    p, q = k0 / (bearing.air_gap_m - position_m) ** 2, k0 / (bearing.air_gap_m + position_m) ** 2
    if bearing.current_law == CurrentLaw.HALF_SWITCHED:
        if force_n > p * 4.0 * bias**2:
            return float(2.0 * (np.sqrt(force_n / p) - bias))
        if force_n < -q * 4.0 * bias**2:
            return float(-2.0 * (np.sqrt(-force_n / q) - bias))
    half_slope, constant = bias * (p + q), bias**2 * (p - q) - force_n
    discriminant = half_slope**2 - (p - q) * constant
    if discriminant < 0.0:
        raise NumericsError(f"no current of the full law makes {force_n} N at {position_m} m")
    return float(-constant / (half_slope + np.sqrt(discriminant)) / bearing.current_share)


def gravity_current(bearing: Bearing, mass_kg: float, gravity_m_per_s2: float) -> float:
    """The control current in A that carries the rotor's weight in the middle of the gap, by the exact force law."""
    return balancing_current(bearing, mass_kg * gravity_m_per_s2)


def linear_gravity_current(bearing: Bearing, mass_kg: float, gravity_m_per_s2: float) -> float:
    """The weight over k_i in A: thesis eq. 4.18, whose constant is that of the half law.

    In the full law it is exact; in the half law it is exact up to the switching current and too large beyond.
    """
    return mass_kg * gravity_m_per_s2 / linearization(bearing).current_stiffness_n_per_a

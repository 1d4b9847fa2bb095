"""What is asked of a controller: the linear bearing, the range of the mass, and the bounds on S and T.

The loop is SISO, in positive feedback: y = z + d, u = K y, G = k_i/(m s² − k_z), S = 1/(1 − K G), T = −K G S.
Robust performance at level g: for every mass of the range and every frequency, |W1 S| + |W3 T| ≤ g.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magbear_cli.errors import NumericsError

Member = TypeVar("Member", float, NDArray[np.float64])


@dataclass(frozen=True)
class MassRange:
    """The rotor's mass in kg, known (low = high) or uncertain between two bounds.

    1/m = 1/nominal + deviation·δ with real δ in [−1, 1] (thesis eqs. 2.16-2.21).
    """

    low_kg: float
    high_kg: float

    def __post_init__(self) -> None:
        """Refuse a range that is empty or not positive."""
        if not 0 < self.low_kg <= self.high_kg < np.inf:
            raise NumericsError(f"a mass range needs 0 < low <= high, not [{self.low_kg}, {self.high_kg}]")

    @property
    def is_fixed(self) -> bool:
        """Whether the range is one mass."""
        return self.low_kg == self.high_kg

    @property
    def nominal_kg(self) -> float:
        """The mass at the middle of 1/m."""
        return 2.0 / (1.0 / self.low_kg + 1.0 / self.high_kg)

    @property
    def inverse_deviation_per_kg(self) -> float:
        """The half-width of 1/m (the thesis's Delta_2)."""
        return (1.0 / self.low_kg - 1.0 / self.high_kg) / 2.0

    def samples_kg(self, count: int) -> NDArray[np.float64]:
        """Masses from low to high, evenly spaced in 1/m, ends included exactly."""
        if self.is_fixed:
            return np.array([self.low_kg])
        masses = 1.0 / np.linspace(1.0 / self.low_kg, 1.0 / self.high_kg, count)
        masses[0], masses[-1] = self.low_kg, self.high_kg
        return masses


@dataclass(frozen=True)
class RationalWeight:
    """A scalar weight num(s)/den(s), coefficients by descending powers of s (rad/s)."""

    num: tuple[float, ...]
    den: tuple[float, ...]

    @classmethod
    def low_pass(cls, dc_gain: float, corner_rad_s: float) -> RationalWeight:
        """The weight dc_gain·corner/(s + corner)."""
        return cls((dc_gain * corner_rad_s,), (1.0, corner_rad_s))

    def __call__(self, s: ArrayLike) -> NDArray[np.complex128]:
        """The weight at complex frequencies s, of the shape of s."""
        points = np.asarray(s, dtype=complex)
        return np.asarray(np.polyval(self.num, points) / np.polyval(self.den, points), dtype=complex)

    @cached_property
    def poles_rad_s(self) -> NDArray[np.complex128]:
        """The roots of the denominator."""
        return np.asarray(np.roots(self.den), dtype=complex)


class UncertainParameter(StrEnum):
    """Which real parameter of the plant the range of masses stands for."""

    MASS = "mass"
    NEGATIVE_STIFFNESS = "negative_stiffness"


@dataclass(frozen=True)
class ControlProblem:
    """A linearised bearing, its mass range, W1 on S, and W3 = s²/omega_c² on T (None: no bandwidth limit).

    Where the negative stiffness is uncertain in place of the mass, ``mass`` holds equivalent masses: that which gives
    the nominal k_z the same unstable pole. The mass itself is then the nominal one, and 1/m is as affine as before.
    """

    negative_stiffness_n_per_m: float
    current_stiffness_n_per_a: float
    mass: MassRange
    performance: RationalWeight
    omega_c_rad_s: float | None = None
    uncertain: UncertainParameter = UncertainParameter.MASS

    def __post_init__(self) -> None:
        """Refuse a bearing that does not pull, and a limit that is not a frequency."""
        for name in ("negative_stiffness_n_per_m", "current_stiffness_n_per_a"):
            if not 0 < getattr(self, name) < np.inf:
                raise NumericsError(f"{name} must be a positive number, not {getattr(self, name)}")
        if self.omega_c_rad_s is not None and not 0 < self.omega_c_rad_s < np.inf:
            raise NumericsError(f"omega_c_rad_s must be a positive number, not {self.omega_c_rad_s}")

    @property
    def natural_rad_s(self) -> float:
        """sqrt(k_z/m) at the nominal mass: the speed of the unstable pole."""
        return float(np.sqrt(self.negative_stiffness_n_per_m / self.mass.nominal_kg))

    @property
    def end_masses_kg(self) -> tuple[float, ...]:
        """The masses that span the range: one, or the lowest and the highest."""
        return (self.mass.low_kg,) if self.mass.is_fixed else (self.mass.low_kg, self.mass.high_kg)

    def inertia_kg(self, mass_kg: Member) -> Member:
        """The mass that moves, for a mass of the range."""
        if self.uncertain is UncertainParameter.MASS:
            return mass_kg
        return mass_kg * 0.0 + self.mass.nominal_kg

    def stiffness_n_per_m(self, mass_kg: Member) -> Member:
        """The negative stiffness, for a mass of the range."""
        if self.uncertain is UncertainParameter.MASS:
            return mass_kg * 0.0 + self.negative_stiffness_n_per_m
        return self.negative_stiffness_n_per_m * self.mass.nominal_kg / mass_kg

    def dynamic_stiffness_n_per_m(self, omega_rad_s: ArrayLike, mass_kg: ArrayLike) -> NDArray[np.float64]:
        """The force per displacement m ω² + k_z = −k_i/G(jω); masses of the range and frequencies broadcast."""
        omega, mass = np.asarray(omega_rad_s, dtype=float), np.asarray(mass_kg, dtype=float)
        return np.asarray(self.inertia_kg(mass) * omega**2 + self.stiffness_n_per_m(mass), dtype=float)

    def plant(self, omega_rad_s: ArrayLike, mass_kg: ArrayLike) -> NDArray[np.complex128]:
        """G(jω) = −k_i/(m ω² + k_z) in m/A for masses and frequencies that broadcast; it is real on the axis."""
        stiffness = self.dynamic_stiffness_n_per_m(omega_rad_s, mass_kg)
        return np.asarray(-self.current_stiffness_n_per_a / stiffness, dtype=complex)

    def performance_bound(self, omega_rad_s: ArrayLike) -> NDArray[np.float64]:
        """|W1(jω)|, of the shape of omega."""
        return np.abs(self.performance(1j * np.asarray(omega_rad_s, dtype=float)))

    def bandwidth_bound(self, omega_rad_s: ArrayLike) -> NDArray[np.float64]:
        """|W3(jω)| = (ω/ω_c)², of the shape of omega; zero without a bandwidth limit."""
        omega = np.asarray(omega_rad_s, dtype=float)
        return np.zeros_like(omega) if self.omega_c_rad_s is None else (omega / self.omega_c_rad_s) ** 2

"""What is asked of a controller: the family of plants, and the bounds on S and T.

The loop is SISO, in positive feedback: y = z + d, u = K y, G = k_i/(m s² − k_z), S = 1/(1 − K G), T = −K G S.
Robust performance at level g: for every plant of the family and every frequency, |W1 S| + |W3 T| ≤ g.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.model.family import Plant, PlantFamily


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


@dataclass(frozen=True)
class ControlProblem:
    """A family of plants, W1 on S, and W3 = s²/omega_c² on T (None: no bandwidth limit)."""

    family: PlantFamily
    performance: RationalWeight
    omega_c_rad_s: float | None = None

    def __post_init__(self) -> None:
        """Refuse a limit that is not a frequency."""
        if self.omega_c_rad_s is not None and not 0 < self.omega_c_rad_s < np.inf:
            raise NumericsError(f"omega_c_rad_s must be a positive number, not {self.omega_c_rad_s}")

    @classmethod
    def of_mass(
        cls,
        negative_stiffness_n_per_m: float,
        current_stiffness_n_per_a: float,
        mass_kg: tuple[float, float],
        performance: RationalWeight,
        omega_c_rad_s: float | None = None,
    ) -> ControlProblem:
        """The problem of known magnets and a range of the mass from low to high, which may be one mass."""
        stiffness = (negative_stiffness_n_per_m, negative_stiffness_n_per_m)
        current = (current_stiffness_n_per_a, current_stiffness_n_per_a)
        return cls(PlantFamily.of_ranges(mass_kg, stiffness, current), performance, omega_c_rad_s)

    @property
    def nominal(self) -> Plant:
        """The plant in the middle of the family."""
        return self.family.nominal

    @property
    def natural_rad_s(self) -> float:
        """The speed of the nominal unstable pole."""
        return self.nominal.pole_rad_s

    def plant(self, omega_rad_s: ArrayLike, share: ArrayLike) -> NDArray[np.complex128]:
        """G(jω) = −1/ρ in m/A for shares and frequencies that broadcast; it is real on the axis."""
        return np.asarray(-1.0 / self.family.current_per_displacement(omega_rad_s, share), dtype=complex)

    def performance_bound(self, omega_rad_s: ArrayLike) -> NDArray[np.float64]:
        """|W1(jω)|, of the shape of omega."""
        return np.abs(self.performance(1j * np.asarray(omega_rad_s, dtype=float)))

    def bandwidth_bound(self, omega_rad_s: ArrayLike) -> NDArray[np.float64]:
        """|W3(jω)| = (ω/ω_c)², of the shape of omega; zero without a bandwidth limit."""
        omega = np.asarray(omega_rad_s, dtype=float)
        return np.zeros_like(omega) if self.omega_c_rad_s is None else (omega / self.omega_c_rad_s) ** 2

    def performance_at_infinity(self) -> float:
        """|W1(∞)|: the ratio of leading coefficients, zero or infinite where the degrees differ."""
        num, den = np.trim_zeros(self.performance.num, "f"), np.trim_zeros(self.performance.den, "f")
        if len(num) != len(den):
            return 0.0 if len(num) < len(den) else float("inf")
        return abs(float(num[0]) / float(den[0]))

    def level_at_infinity(self, gain_a_per_m: ArrayLike) -> NDArray[np.float64]:
        """The limit of the worst case at ω → ∞ for direct gains K(∞), of their shape.

        There S → 1 and W3 T → b K/ω_c², largest for the first end, where b = k_i/m is.
        """
        level = self.performance_at_infinity() + 0.0 * np.abs(np.asarray(gain_a_per_m))
        if self.omega_c_rad_s is None:
            return np.asarray(level, dtype=float)
        scale = self.family.first.acceleration_per_current / self.omega_c_rad_s**2
        return np.asarray(level + scale * np.abs(np.asarray(gain_a_per_m)), dtype=float)

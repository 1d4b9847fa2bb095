"""A family of plants between two: whatever is uncertain, one real number tells its members apart.

A rigid rotor on magnets is k_i/(m s² − k_z). On the axis only ρ(ω) = (m ω² + k_z)/k_i matters, the current that a
displacement costs: G = −1/ρ. If mass, current stiffness and negative stiffness lie in ranges, ρ lies at every ω
between its values at two corners of the box, whatever ω is: the light rotor on soft, strong magnets (least m and k_z,
largest k_i) and the opposite one. So the box is, for any loop at one frequency, the segment between these two plants.

The members are counted by a share t from the first end (0) to the last (1). With a = k_z/m, the square of the unstable
pole, and b = k_i/m, the acceleration that a current makes, G = −b/(ω² + a). Along the family a and b are affine in t:
of a range of the mass alone t runs along 1/m (thesis eqs. 2.16-2.21), of one of k_z alone along k_z.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magbear_cli.errors import NumericsError

Floats = NDArray[np.float64]
Share = TypeVar("Share", float, NDArray[np.float64])

NOMINAL = 0.5  # the share of the nominal member
FIRST, LAST = 0.0, 1.0  # the shares of the ends


@dataclass(frozen=True)
class Plant:
    """One rigid rotor on linearised magnets, k_i/(m s² − k_z)."""

    mass_kg: float
    negative_stiffness_n_per_m: float
    current_stiffness_n_per_a: float

    def __post_init__(self) -> None:
        """Refuse a rotor without mass and magnets that do not pull."""
        for name in ("mass_kg", "negative_stiffness_n_per_m", "current_stiffness_n_per_a"):
            if not 0 < getattr(self, name) < np.inf:
                raise NumericsError(f"{name} must be a positive number, not {getattr(self, name)}")

    @property
    def pole_squared(self) -> float:
        """A = k_z/m in (rad/s)², the square of the unstable pole."""
        return self.negative_stiffness_n_per_m / self.mass_kg

    @property
    def acceleration_per_current(self) -> float:
        """B = k_i/m in m/(s² A)."""
        return self.current_stiffness_n_per_a / self.mass_kg

    @property
    def pole_rad_s(self) -> float:
        """The unstable pole √(k_z/m)."""
        return float(np.sqrt(self.negative_stiffness_n_per_m / self.mass_kg))


@dataclass(frozen=True)
class PlantFamily:
    """All plants between two ends, the first with the lesser ρ at every frequency; one plant where they are equal."""

    first: Plant
    last: Plant
    box_poles: tuple[float, float] | None = None  # the least and the largest k_z/m in the box behind the ends

    @classmethod
    def of_one(cls, plant: Plant) -> PlantFamily:
        """A plant that is known."""
        return cls(plant, plant)

    @classmethod
    def of_ranges(
        cls,
        mass_kg: tuple[float, float],
        negative_stiffness_n_per_m: tuple[float, float],
        current_stiffness_n_per_a: tuple[float, float],
    ) -> PlantFamily:
        """The family of a box, each side from its least to its largest value.

        Raises
        ------
        NumericsError
            when a range falls, or holds what is no positive number.
        """
        for low, high in (mass_kg, negative_stiffness_n_per_m, current_stiffness_n_per_a):
            if not 0 < low <= high < np.inf:
                raise NumericsError(f"a range needs 0 < low <= high, not [{low}, {high}]")
        (light, heavy), (soft, stiff), (weak, strong) = mass_kg, negative_stiffness_n_per_m, current_stiffness_n_per_a
        return cls(Plant(light, soft, strong), Plant(heavy, stiff, weak), (soft / heavy, stiff / light))

    @property
    def is_fixed(self) -> bool:
        """Whether the family is one plant."""
        return self.first == self.last

    @property
    def end_shares(self) -> tuple[float, ...]:
        """The shares of the ends: one of a known plant, else two."""
        return (FIRST,) if self.is_fixed else (FIRST, LAST)

    @property
    def ends(self) -> tuple[Plant, ...]:
        """The ends themselves, in that order."""
        return (self.first,) if self.is_fixed else (self.first, self.last)

    @property
    def nominal(self) -> Plant:
        """The member in the middle of a and b: of a range of the mass the one in the middle of 1/m."""
        return self.first if self.is_fixed else self.member(NOMINAL)

    @property
    def spread(self) -> tuple[float, float]:
        """Half of what a and b change by from the last end to the first."""
        first, last = self.first, self.last
        return (
            (first.pole_squared - last.pole_squared) / 2.0,
            (first.acceleration_per_current - last.acceleration_per_current) / 2.0,
        )

    @property
    def relative_spread(self) -> float:
        """The larger of both over the nominal a and b: for a range of the mass the relative half-width of 1/m."""
        nominal = self.nominal
        a, b = self.spread
        return max(abs(a) / nominal.pole_squared, abs(b) / nominal.acceleration_per_current)

    @property
    def pole_range(self) -> tuple[float, float]:
        """The least and the largest √(k_z/m) of all plants of the box, in rad/s."""
        ends = (self.first.pole_squared, self.last.pole_squared)
        low, high = self.box_poles or (min(ends), max(ends))
        return float(np.sqrt(low)), float(np.sqrt(high))

    @property
    def is_known_at_rest(self) -> bool:
        """Whether all members have one k_z/k_i, exactly."""
        first, last = self.first, self.last
        return (first.negative_stiffness_n_per_m, first.current_stiffness_n_per_a) == (
            last.negative_stiffness_n_per_m,
            last.current_stiffness_n_per_a,
        )

    def shares(self, count: int) -> Floats:
        """So many shares from the first end to the last, evenly; one of a known plant."""
        return np.array([FIRST]) if self.is_fixed else np.linspace(FIRST, LAST, count)

    def shown_shares(self) -> Floats:
        """Both ends and the middle; one of a known plant."""
        return np.array([FIRST]) if self.is_fixed else np.array([FIRST, NOMINAL, LAST])

    def pole_squared(self, share: Share) -> Share:
        """A of a member, of the shape of the shares."""
        return self.first.pole_squared * (1.0 - share) + self.last.pole_squared * share

    def acceleration_per_current(self, share: Share) -> Share:
        """B of a member, of the shape of the shares."""
        return self.first.acceleration_per_current * (1.0 - share) + self.last.acceleration_per_current * share

    def mass_kg(self, share: Share) -> Share:
        """The mass of a member: 1/m is taken as affine along the family."""
        return 1.0 / ((1.0 - share) / self.first.mass_kg + share / self.last.mass_kg)

    def member(self, share: float) -> Plant:
        """A member by its parameters, which lie between those of the ends; exactly those at the ends."""
        if share == FIRST or self.is_fixed:
            return self.first
        if share == LAST:
            return self.last
        mass = float(self.mass_kg(share))

        def between(first: float, last: float, weighted: float) -> float:
            return first if first == last else float(np.clip(weighted * mass, min(first, last), max(first, last)))

        return Plant(
            mass if self.first.mass_kg != self.last.mass_kg else self.first.mass_kg,
            between(
                self.first.negative_stiffness_n_per_m,
                self.last.negative_stiffness_n_per_m,
                float(self.pole_squared(share)),
            ),
            between(
                self.first.current_stiffness_n_per_a,
                self.last.current_stiffness_n_per_a,
                float(self.acceleration_per_current(share)),
            ),
        )

    def current_per_displacement(self, omega_rad_s: ArrayLike, share: ArrayLike) -> Floats:
        """ρ = (ω² + a)/b in A/m; frequencies and shares broadcast."""
        omega, at = np.asarray(omega_rad_s, dtype=float), np.asarray(share, dtype=float)
        return np.asarray((omega**2 + self.pole_squared(at)) / self.acceleration_per_current(at), dtype=float)

"""The bearing as a sampled controller meets it: position sampled, current held between samples and applied late.

With q = k_z/m and c = cosh(√q T) the rotor answers a held current by (zero-order hold; Åström and Wittenmark 1997,
chapter 2)

    G(z) = (k_i/k_z)(c − 1)(r0 z² + (2 − r0 − r2) z + r2)/(z^(d+1) (z² − 2 c z + 1)),

r0 = (sinh(√q (T − τ)/2)/sinh(√q T/2))² and r2 likewise of τ, where the current comes d whole samples and the part τ of
a sample late. In s = (z − 1)/(z + 1) this is

    G = k_i h(s)/(µ s² − k_z),  µ = k_z coth²(√q T/2),
    h = (1 + (r0 − r2) s + (r0 + r2 − 1) s²) ((1 − s)/(1 + s))^(d+1):

the bearing in continuous time with another mass, seen through a filter that hardly depends on the mass.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.family import Plant

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_SAME = 1e-9  # of a sample: a delay this close to a whole number of them is that number


@dataclass(frozen=True)
class Sampling:
    """The time between samples, and from taking a sample until the current computed from it is applied."""

    sample_time_s: float
    delay_s: float = 0.0

    def __post_init__(self) -> None:
        """Refuse times that are not times."""
        if not 0.0 < self.sample_time_s < np.inf:
            raise NumericsError(f"the sample time must be a positive number, not {self.sample_time_s}")
        if not 0.0 <= self.delay_s < np.inf:
            raise NumericsError(f"the computation delay must not be negative, as {self.delay_s} is")

    @property
    def whole_samples(self) -> int:
        """d: whole samples in the delay."""
        return int(np.floor(self.delay_s / self.sample_time_s + _SAME))

    @property
    def part_s(self) -> float:
        """τ: the rest of the delay, at least zero and less than a sample."""
        rest = self.delay_s - self.whole_samples * self.sample_time_s
        return rest if rest > _SAME * self.sample_time_s else 0.0

    @property
    def nyquist_rad_s(self) -> float:
        """π/T, where what the samples tell ends."""
        return float(np.pi / self.sample_time_s)


def hold_stiffness(plant: Plant, sampling: Sampling) -> float:
    """µ = k_z coth²(√q T/2) in N/m; it rises with the mass and with k_z."""
    return float(plant.negative_stiffness_n_per_m / np.tanh(_half_angle(plant, sampling)) ** 2)


def hold_shares(plant: Plant, sampling: Sampling) -> tuple[float, float]:
    """(r0, r2), each between 0 and 1; both fall with the speed of the unstable pole."""
    return hold_shares_at(plant.pole_rad_s, sampling)


def hold_shares_at(pole_rad_s: float, sampling: Sampling) -> tuple[float, float]:
    """(r0, r2) for an unstable pole at this speed."""
    half = 0.5 * sampling.sample_time_s * pole_rad_s
    part = sampling.part_s / sampling.sample_time_s
    r0, r2 = ((np.sinh(share * half) / np.sinh(half)) ** 2 for share in (1.0 - part, part))
    return float(r0), float(r2)


def hold_filter(sampling: Sampling, shares: tuple[float, float], angle_rad: Floats) -> Complexes:
    """The hold's h cos²(θ/2) at s = j tan(θ/2); the angle θ is ω T, and everything broadcasts."""
    r0, r2 = shares
    cosine, sine = np.cos(angle_rad / 2.0), np.sin(angle_rad / 2.0)
    even, odd = cosine**2 - (r0 + r2 - 1.0) * sine**2, (r0 - r2) * sine * cosine
    return np.asarray((even + 1j * odd) * np.exp(-1j * angle_rad * (sampling.whole_samples + 1)), dtype=complex)


def held_plant(plant: Plant, sampling: Sampling) -> StateSpace:
    """The same plant as exact matrices in δ = z − 1: position, speed, and the currents that are still to be applied."""
    time, part, waiting = sampling.sample_time_s, sampling.part_s, sampling.whole_samples + (sampling.part_s > 0.0)
    rate, push = plant.pole_rad_s, plant.acceleration_per_current

    def moved(duration: float) -> Floats:  # what a unit current does to position and speed
        return push * np.array([2.0 * (np.sinh(rate * duration / 2.0) / rate) ** 2, np.sinh(rate * duration) / rate])

    n = 2 + waiting
    a, b = np.zeros((n, n)), np.zeros((n, 1))
    a[:2, :2] = 2.0 * np.sinh(rate * time / 2.0) ** 2 * np.eye(2)
    a[0, 1], a[1, 0] = np.sinh(rate * time) / rate, rate * np.sinh(rate * time)
    a[2:, 2:] = np.eye(waiting, k=1) - np.eye(waiting)  # the oldest current stands first
    early = moved(time - part)
    targets = [moved(time) - early, early] if part > 0.0 else [early]
    for place, effect in zip(range(2, 2 + len(targets)), targets, strict=True):
        if place < n:
            a[:2, place] += effect
        else:
            b[:2, 0] += effect
    if waiting:
        b[-1, 0] = 1.0
    return StateSpace(a, b, np.eye(1, n), np.zeros((1, 1)))


def _half_angle(plant: Plant, sampling: Sampling) -> float:
    return 0.5 * sampling.sample_time_s * plant.pole_rad_s

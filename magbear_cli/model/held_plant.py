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
from numpy.typing import ArrayLike, NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, UncertainParameter

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


def hold_mass(problem: ControlProblem, sampling: Sampling, mass_kg: ArrayLike) -> Floats:
    """µ = k_z coth²(√q T/2) in N/m, of the shape of the masses; it rises with the mass."""
    mass = np.asarray(mass_kg, dtype=float)
    return np.asarray(problem.stiffness_n_per_m(mass) / np.tanh(_half_angle(problem, sampling, mass)) ** 2, dtype=float)


def hold_shares(problem: ControlProblem, sampling: Sampling, mass_kg: ArrayLike) -> tuple[Floats, Floats]:
    """(r0, r2), each of the shape of the masses and between 0 and 1; both rise with the mass."""
    half = _half_angle(problem, sampling, np.asarray(mass_kg, dtype=float))
    part = sampling.part_s / sampling.sample_time_s
    shares = [(np.sinh(share * half) / np.sinh(half)) ** 2 for share in (1.0 - part, part)]
    return shares[0], shares[1]


def hold_filter(sampling: Sampling, shares: tuple[Floats, Floats], angle_rad: Floats) -> Complexes:
    """The hold's h cos²(θ/2) at s = j tan(θ/2); the angle θ is ω T, and everything broadcasts."""
    r0, r2 = shares
    cosine, sine = np.cos(angle_rad / 2.0), np.sin(angle_rad / 2.0)
    even, odd = cosine**2 - (r0 + r2 - 1.0) * sine**2, (r0 - r2) * sine * cosine
    return np.asarray((even + 1j * odd) * np.exp(-1j * angle_rad * (sampling.whole_samples + 1)), dtype=complex)


def held_plant(problem: ControlProblem, sampling: Sampling, mass_kg: float) -> StateSpace:
    """The same plant as exact matrices in δ = z − 1: position, speed, and the currents that are still to be applied."""
    time, part, waiting = sampling.sample_time_s, sampling.part_s, sampling.whole_samples + (sampling.part_s > 0.0)
    rate = float(np.sqrt(problem.stiffness_n_per_m(mass_kg) / problem.inertia_kg(mass_kg)))
    push = problem.current_stiffness_n_per_a / problem.inertia_kg(mass_kg)

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


def _half_angle(problem: ControlProblem, sampling: Sampling, mass_kg: Floats) -> Floats:
    rate = np.sqrt(problem.stiffness_n_per_m(mass_kg) / problem.inertia_kg(mass_kg))
    return np.asarray(0.5 * sampling.sample_time_s * rate, dtype=float)


def stiffness_residue_n_per_m(problem: ControlProblem, sampling: Sampling) -> tuple[float, float]:
    """Bounds of µ − (4 m/T² + 2 k_z/3), where the stiffness is uncertain and µ is not affine in it.

    k (coth² x − 1/x² − 2/3) with x² = k T²/(4 m) rises from zero with k, as x²/15 does.
    """
    if problem.uncertain is UncertainParameter.MASS:
        return 0.0, 0.0
    stiffness = problem.stiffness_n_per_m(problem.mass.low_kg)  # the stiffest bearing has the least equivalent mass
    square = float(_half_angle(problem, sampling, np.array(problem.mass.low_kg))) ** 2
    return 0.0, 1.001 * stiffness * square / 15.0

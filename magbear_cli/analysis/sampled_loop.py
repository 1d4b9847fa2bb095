"""A sampled controller around the bearing: poles, worst case and margins at the sampling instants, up to π/T.

At the angle θ = ω T, everything times cos²(θ/2), the loop is K G = −κ/a with the dynamic stiffness
a = µ sin² + k_z cos² and the force per displacement κ = k_i K h cos² (``model.held_plant``). So S = a/(a + κ) and
T = κ/(a + κ), as in continuous time. Between the samples nothing is said here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magbear_cli.analysis.margins import Margins, is_crossing
from magbear_cli.analysis.supremum import sign_changes, supremum
from magbear_cli.analysis.worst_case import WorstCase
from magbear_cli.lti.eigenvalues import eigenvalues_with_error
from magbear_cli.lti.resonance import resonance_frequencies
from magbear_cli.lti.sampled_system import SampledSystem, delta_polynomials
from magbear_cli.model.held_plant import Sampling, held_plant, hold_filter, hold_mass, hold_shares
from magbear_cli.model.problem import ControlProblem

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_MASSES = 33
_POINTS_PER_DECADE = 60
_SLOWEST = 1e-3  # of the slowest corner: where the grid begins


@dataclass(frozen=True, eq=False)
class SampledLoop:
    """What is around what, and how it is sampled; the controller's own sample time is that of the sampling."""

    problem: ControlProblem
    controller: SampledSystem
    sampling: Sampling

    def stiffness_and_force(self, omega_rad_s: ArrayLike, mass_kg: ArrayLike) -> tuple[Floats, Complexes]:
        """The dynamic stiffness a and the force κ in N/m, for frequencies and masses that broadcast."""
        omega, mass = np.asarray(omega_rad_s, dtype=float), np.asarray(mass_kg, dtype=float)
        angle = omega * self.sampling.sample_time_s
        shares = hold_shares(self.problem, self.sampling, mass)
        force = self.problem.current_stiffness_n_per_a * self.controller.response(angle)
        stiffness = hold_mass(self.problem, self.sampling, mass) * np.sin(angle / 2.0) ** 2
        stiffness = stiffness + self.problem.stiffness_n_per_m(mass) * np.cos(angle / 2.0) ** 2
        return stiffness, force * hold_filter(self.sampling, shares, angle)

    def level(self, omega_rad_s: ArrayLike, mass_kg: ArrayLike) -> Floats:
        """|W1 S| + |W3 T| for frequencies and masses that broadcast; the weights are those of continuous time."""
        stiffness, force = self.stiffness_and_force(omega_rad_s, mass_kg)
        weighted = self.problem.performance_bound(omega_rad_s) * stiffness
        weighted = weighted + self.problem.bandwidth_bound(omega_rad_s) * np.abs(force)
        return np.asarray(weighted / np.abs(stiffness + force), dtype=float)

    def frequencies(self) -> Floats:
        """An ascending grid (w,) in rad/s from far below all corners to π/T, denser in its last decade."""
        weight, period = self.problem.performance, self.sampling.sample_time_s
        own: list[Complexes] = []
        for section in self.controller.sections:
            num, den = delta_polynomials(section)
            own += [np.asarray(np.roots(part) / period, dtype=complex) for part in (num, den)]
        corners = [self.problem.natural_rad_s, *np.abs(weight.poles_rad_s)]
        corners += [abs(root) for roots in own[1::2] for root in roots]
        discrete = 1.0 + period * np.concatenate([np.zeros(0), *own])
        closed = [sampled_poles(self, mass) for mass in self.problem.end_masses_kg]
        discrete = np.concatenate([discrete, *closed])
        continuous = np.log(discrete[np.abs(discrete) > 0].astype(complex)) / period
        near = resonance_frequencies(np.concatenate([weight.poles_rad_s, np.roots(weight.num), continuous]))
        low = _SLOWEST * min((corner for corner in corners if corner > 0.0), default=1.0)
        high = self.sampling.nyquist_rad_s
        count = int(np.ceil(_POINTS_PER_DECADE * max(np.log10(high / low), 1.0)))
        grids = [np.geomspace(low, high, count), np.linspace(0.1 * high, high, 200), near[near < high]]
        return np.unique(np.concatenate(grids))


def sampled_poles(loop: SampledLoop, mass_kg: float) -> Complexes:
    """The closed loop's poles in the plane of z, from the matrices of the held plant and of the chain."""
    plant, own = held_plant(loop.problem, loop.sampling, mass_kg), loop.controller.incremental
    closed = np.block(
        [[plant.a + plant.b @ own.d @ plant.c, plant.b @ own.c], [own.b @ plant.c, own.a]],
    )
    return 1.0 + eigenvalues_with_error(closed)[0]


def is_stable_on_samples(loop: SampledLoop, masses: int = _MASSES) -> bool:
    """Whether all poles are inside the circle for sample masses of the range; no proof for those between them."""
    return all(
        bool((np.abs(sampled_poles(loop, float(mass))) < 1.0).all()) for mass in loop.problem.mass.samples_kg(masses)
    )


def sampled_worst_case(loop: SampledLoop, masses: int = _MASSES) -> WorstCase:
    """The largest |W1 S| + |W3 T| found over sample masses and 0 < ω ≤ π/T."""
    samples = loop.problem.mass.samples_kg(masses)[:, None]

    def over_mass(omega: Floats) -> Floats:
        return np.asarray(loop.level(omega, samples).max(axis=0), dtype=float)

    level, omega = supremum(over_mass, loop.frequencies())
    mass = samples[int(loop.level(np.array([omega]), samples)[:, 0].argmax()), 0]
    return WorstCase(level, float(mass), omega)


def sampled_margins(loop: SampledLoop) -> Margins:
    """The margins of a loop that is stable, at their least over both end masses and the middle one."""
    found = [_margins(loop, mass) for mass in np.unique([*loop.problem.end_masses_kg, loop.problem.mass.nominal_kg])]
    return Margins(
        max(margins.gain_low for margins in found),
        *(min(getattr(margins, name) for margins in found) for name in ("gain_high", "phase_deg", "delay_s", "disk")),
    )


def _margins(loop: SampledLoop, mass_kg: float) -> Margins:
    omega = loop.frequencies()

    def ratio(at: Floats) -> Complexes:  # −K G = κ/a, critical at −1
        stiffness, force = loop.stiffness_and_force(at, mass_kg)
        return np.asarray(force / stiffness, dtype=complex)

    at_rest = np.zeros(0 if loop.controller.has_integrator else 1)  # the loop is real at z = 1, and nowhere near it
    at_real = ratio(np.concatenate([at_rest, sign_changes(lambda at: ratio(at).imag, omega), omega[-1:]]))
    real = at_real[is_crossing(at_real)].real
    factors = -1.0 / real[real < 0.0]
    crossovers = sign_changes(lambda at: np.abs(ratio(at)) - 1.0, omega)
    angles = np.angle(-ratio(crossovers))
    disk = supremum(lambda at: np.abs((1.0 - ratio(at)) / (1.0 + ratio(at))), omega)[0]
    return Margins(
        float(factors[factors < 1.0].max(initial=0.0)),
        float(factors[factors >= 1.0].min(initial=np.inf)),
        float(np.degrees(np.abs(angles).min(initial=np.pi))),
        float((np.mod(angles, 2.0 * np.pi) / crossovers).min(initial=np.inf)),
        2.0 / disk,
    )

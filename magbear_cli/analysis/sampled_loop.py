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
from magbear_cli.model.held_plant import Sampling, held_plant, hold_filter, hold_shares, hold_stiffness
from magbear_cli.model.problem import ControlProblem

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_MEMBERS = 33
_POINTS_PER_DECADE = 60
_SLOWEST = 1e-3  # of the slowest corner: where the grid begins


@dataclass(frozen=True, eq=False)
class SampledLoop:
    """What is around what, and how it is sampled; the controller's own sample time is that of the sampling."""

    problem: ControlProblem
    controller: SampledSystem
    sampling: Sampling

    def stiffness_and_force(self, omega_rad_s: ArrayLike, share: float) -> tuple[Floats, Complexes]:
        """The dynamic stiffness a and the force κ in N/m of a member, each (w,)."""
        omega = np.asarray(omega_rad_s, dtype=float)
        plant, angle = self.problem.family.member(share), omega * self.sampling.sample_time_s
        force = plant.current_stiffness_n_per_a * self.controller.response(angle)
        stiffness = hold_stiffness(plant, self.sampling) * np.sin(angle / 2.0) ** 2
        stiffness = stiffness + plant.negative_stiffness_n_per_m * np.cos(angle / 2.0) ** 2
        return stiffness, force * hold_filter(self.sampling, hold_shares(plant, self.sampling), angle)

    def level(self, omega_rad_s: ArrayLike, share: float) -> Floats:
        """|W1 S| + |W3 T| of a member, (w,); the weights are those of continuous time."""
        stiffness, force = self.stiffness_and_force(omega_rad_s, share)
        weighted = self.problem.performance_bound(omega_rad_s) * stiffness
        weighted = weighted + self.problem.bandwidth_bound(omega_rad_s) * np.abs(force)
        return np.asarray(weighted / np.abs(stiffness + force), dtype=float)

    def levels(self, omega_rad_s: ArrayLike, shares: Floats) -> Floats:
        """The levels of several members, (k, w)."""
        return np.stack([self.level(omega_rad_s, float(share)) for share in shares])

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
        closed = [sampled_poles(self, share) for share in self.problem.family.end_shares]
        discrete = np.concatenate([discrete, *closed])
        continuous = np.log(discrete[np.abs(discrete) > 0].astype(complex)) / period
        near = resonance_frequencies(np.concatenate([weight.poles_rad_s, np.roots(weight.num), continuous]))
        low = _SLOWEST * min((corner for corner in corners if corner > 0.0), default=1.0)
        high = self.sampling.nyquist_rad_s
        count = int(np.ceil(_POINTS_PER_DECADE * max(np.log10(high / low), 1.0)))
        grids = [np.geomspace(low, high, count), np.linspace(0.1 * high, high, 200), near[near < high]]
        return np.unique(np.concatenate(grids))


def sampled_poles(loop: SampledLoop, share: float) -> Complexes:
    """The closed loop's poles in the plane of z, from the matrices of the held plant and of the chain."""
    plant, own = held_plant(loop.problem.family.member(share), loop.sampling), loop.controller.incremental
    closed = np.block(
        [[plant.a + plant.b @ own.d @ plant.c, plant.b @ own.c], [own.b @ plant.c, own.a]],
    )
    return 1.0 + eigenvalues_with_error(closed)[0]


def is_stable_on_samples(loop: SampledLoop, members: int = _MEMBERS) -> bool:
    """Whether all poles are inside the circle for sample members of the family; no proof for those between them."""
    shares = loop.problem.family.shares(members)
    return all(bool((np.abs(sampled_poles(loop, float(share))) < 1.0).all()) for share in shares)


def sampled_worst_case(loop: SampledLoop, members: int = _MEMBERS) -> WorstCase:
    """The largest |W1 S| + |W3 T| found over sample members and 0 < ω ≤ π/T."""
    shares = loop.problem.family.shares(members)

    def over_family(omega: Floats) -> Floats:
        return np.asarray(loop.levels(omega, shares).max(axis=0), dtype=float)

    level, omega = supremum(over_family, loop.frequencies())
    share = shares[int(loop.levels(np.array([omega]), shares)[:, 0].argmax())]
    return WorstCase(level, float(share), omega)


def sampled_margins(loop: SampledLoop) -> Margins:
    """The margins of a loop that is stable, at their least over both ends of the family and its middle."""
    found = [_margins(loop, float(share)) for share in loop.problem.family.shown_shares()]
    return Margins(
        max(margins.gain_low for margins in found),
        *(min(getattr(margins, name) for margins in found) for name in ("gain_high", "phase_deg", "delay_s", "disk")),
    )


def _margins(loop: SampledLoop, share: float) -> Margins:
    omega = loop.frequencies()

    def ratio(at: Floats) -> Complexes:  # −K G = κ/a, critical at −1
        stiffness, force = loop.stiffness_and_force(at, share)
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

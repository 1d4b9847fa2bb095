"""How far the loop is from instability, at its worst over the family: gain, phase, delay and disk margins.

On s = jω the loop gain is K G = −K/ρ, critical at +1, and ρ = (m ω² + k_z)/k_i is positive. So its phase does not
depend on the member: it is real where K is, and a crossover at ω belongs to the member with ρ = |K|.
The plant is unstable, so the gain may neither rise nor fall too far.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.analysis.loop_functions import controller_response
from magbear_cli.analysis.pole_family import real_response_frequencies
from magbear_cli.analysis.supremum import sign_changes, supremum
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class Margins:
    """The worst margins over the family of a loop that is stable over it."""

    gain_low: float  # the loop gain may fall to this factor (0: to nothing)
    gain_high: float  # and rise to this one (infinite: without end)
    phase_deg: float
    delay_s: float  # the delay that makes the loop unstable
    disk: float  # 1/‖(S − T)/2‖∞, at most 2


def stability_margins(problem: ControlProblem, controller: StateSpace, omega_rad_s: Floats) -> Margins:
    """All margins of a loop that is known to be stable for every member.

    Parameters
    ----------
    omega_rad_s : (w,) ascending grid, which may start with zero
    """
    positive = omega_rad_s[omega_rad_s > 0]
    gain_low, gain_high = gain_margins(problem, controller, omega_rad_s)
    phase = _least_over_crossovers(problem, controller, positive, lambda _, angle: np.abs(angle))
    delay = _least_over_crossovers(problem, controller, positive, lambda w, angle: np.mod(angle, 2.0 * np.pi) / w)
    return Margins(gain_low, gain_high, float(np.degrees(phase)), delay, disk_margin(problem, controller, omega_rad_s))


def gain_margins(problem: ControlProblem, controller: StateSpace, omega_rad_s: Floats) -> tuple[float, float]:
    """The factors (low, high) to which the loop gain may fall and rise before a member becomes unstable.

    At a real K < 0 the loop with gain factor f has a pole on the axis for f = ρ/(−K).

    Parameters
    ----------
    omega_rad_s : (w,) ascending grid, to find where K is real beside ω = 0
    """
    # K is real at ω = 0 itself and at no frequency near it: beside a pole at zero the real part of K means nothing
    omega = np.concatenate([[0.0], real_response_frequencies(controller, omega_rad_s[omega_rad_s > 0])])
    response = controller_response(controller, omega)
    real = is_crossing(response)
    omega, force = omega[real], -response[real].real
    rho = problem.family.current_per_displacement(omega, np.array(problem.family.end_shares)[:, None])
    factors = (rho[:, force > 0] / force[force > 0]).ravel()
    low, high = factors[factors < 1.0], factors[factors >= 1.0]
    return float(low.max(initial=0.0)), float(high.min(initial=np.inf))


def is_crossing(response: Complexes) -> NDArray[np.bool_]:
    """Where Im K has a zero, among the points (k,) at which it changes sign: at a pole on the axis it does so too.

    A response at zero is a crossing when it is finite; a pole within rounding of zero leaves a factor next to nothing.
    """
    return np.asarray(np.isfinite(response) & (np.abs(response.imag) <= np.abs(response.real)), dtype=bool)


def disk_margin(problem: ControlProblem, controller: StateSpace, omega_rad_s: Floats) -> float:
    """1/‖(S − T)/2‖∞ at its least over the family: the disk margin without skew (Seiler, Packard, Gahinet 2020).

    S − T = (ρ − K)/(ρ + K); its modulus is stationary in ρ at ρ = |K| only. With
    margin α the loop stays stable for complex gains (1 + α δ/2)/(1 − α δ/2), |δ| < 1.
    """

    def largest(omega: Floats) -> Floats:
        force = controller_response(controller, omega)
        low, high = _rho_ends(problem, omega)
        candidates = np.stack([low, high, np.clip(np.abs(force), low, high)])
        return np.asarray((np.abs(candidates - force) / np.abs(candidates + force)).max(axis=0), dtype=float)

    return 2.0 / supremum(largest, omega_rad_s, 1.0)[0]


def _rho_ends(problem: ControlProblem, omega_rad_s: Floats) -> tuple[Floats, Floats]:
    """The least and the largest ρ over the family."""
    ends = problem.family.current_per_displacement(omega_rad_s, np.array(problem.family.end_shares)[:, None])
    return ends.min(axis=0), ends.max(axis=0)


def _least_over_crossovers(
    problem: ControlProblem,
    controller: StateSpace,
    omega_rad_s: Floats,
    margin: Callable[[Floats, Floats], Floats],
) -> float:
    """The least margin(ω, arg K G) over the frequencies that are a crossover for some member."""

    def force(omega: Floats) -> Floats:
        return np.asarray(np.abs(controller_response(controller, omega)), dtype=float)

    def beyond(omega: Floats, share: float) -> Floats:
        return np.asarray(force(omega) - problem.family.current_per_displacement(omega, share), dtype=float)

    def negative_margin(omega: Floats) -> Floats:
        return -margin(omega, np.angle(-controller_response(controller, omega)))

    def inside(omega: Floats) -> Floats:
        (low, high), found = _rho_ends(problem, omega), force(omega)
        return np.where((found >= low) & (found <= high), negative_margin(omega), -np.inf)

    best = -np.inf if problem.family.is_fixed else supremum(inside, omega_rad_s)[0]
    for share in problem.family.end_shares:
        edges = sign_changes(lambda omega, share=share: beyond(omega, share), omega_rad_s)  # type: ignore[misc]
        if edges.size:
            best = max(best, float(negative_margin(edges).max()))
    return -best

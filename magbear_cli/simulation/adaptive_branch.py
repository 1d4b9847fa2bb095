"""The net force between two of its kinks, as a smooth function that goes on beyond them.

The force has a kink where the current meets its limit and where a coil is switched off. A step is made with the branch
on which it begins, and cut off where the current leaves that branch: so no step has to resolve a kink.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from magbear_cli.simulation.loop import Magnets

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Branch:
    """The net force without the pulse while the demand lies between ``low_a`` and ``high_a``.

    With the coil currents (upper, lower) = base + rise·demand, times the root of k0: (2, 1) arrays.
    """

    low_a: float
    high_a: float
    base: Floats
    rise: Floats
    load_n: float

    def force(self, distances_m: Floats, demand_a: Floats) -> tuple[Floats, Floats, Floats]:
        """The force (k,) and its slopes to position and demand; distances (2, k) to the upper and the lower magnet."""
        field = self.rise * demand_a
        field += self.base
        field /= distances_m
        pull = field * field
        force = pull[0] - pull[1]
        force -= self.load_n
        pull /= distances_m
        field /= distances_m
        field *= self.rise
        stiffness, gain = pull[0] + pull[1], field[0] - field[1]
        stiffness *= 2.0
        gain *= 2.0
        return force, stiffness, gain


@dataclass(frozen=True, eq=False)
class LinearBranch:
    """The same by the slopes at the operating point: base + stiffness·(distance to the lower magnet) + gain·demand.

    ``base_n`` holds the limited part of the current too.
    """

    low_a: float
    high_a: float
    base_n: float
    stiffness_n_per_m: float
    gain_n_per_a: float

    def force(self, distances_m: Floats, demand_a: Floats) -> tuple[Floats, Floats, Floats]:
        """The force (k,) and its slopes; see ``Branch``."""
        force = self.base_n + self.stiffness_n_per_m * distances_m[1] + self.gain_n_per_a * demand_a
        return force, np.full(1, self.stiffness_n_per_m), np.full(1, self.gain_n_per_a)


def branches(magnets: Magnets) -> list[Branch | LinearBranch]:
    """The branches of the force, in the order of the demand."""
    limit = np.inf if magnets.scenario.current_limit_a is None else magnets.scenario.current_limit_a
    switching = np.inf if magnets.is_linear else magnets.bearing.switching_current_a
    kinks = sorted({side * kink for kink in (limit, switching) if kink < np.inf and kink <= limit for side in (-1, 1)})
    between = list(pairwise((-np.inf, *kinks, np.inf)))
    return [_branch(magnets, ends, limit, switching) for ends in between]


def branch_at(choices: Sequence[Branch | LinearBranch], demand_a: float) -> int:
    """The place of the branch on which a demand lies."""
    return next((at for at, one in enumerate(choices) if demand_a <= one.high_a), len(choices) - 1)


def _branch(magnets: Magnets, ends: tuple[float, float], limit: float, switching: float) -> Branch | LinearBranch:
    bearing, standing = magnets.bearing, magnets.standing_current_a
    low, high = ends  # of the wanted current
    is_limited = high <= -limit or low >= limit
    held = float(np.clip(high if low == -np.inf else low, -limit, limit))
    constant, rise = (held, 0.0) if is_limited else (standing, 1.0)
    demands = low - standing, high - standing
    if magnets.is_linear:
        k_z, k_i = magnets.slopes
        base = k_i * (constant - magnets.scenario.current_a) - magnets.weight_n + k_z * magnets.gap_m[0]
        return LinearBranch(*demands, base, k_z, k_i * rise)
    least, most = max(low, -limit), min(high, limit)
    on = np.array([most > -switching, least < switching], dtype=float) * np.sqrt(bearing.force_constant_n_m2_per_a2)
    shares = np.array([bearing.current_share, -bearing.current_share])
    base = on * (bearing.bias_current_a + shares * constant)
    return Branch(*demands, base[:, None], (on * shares * rise)[:, None], magnets.load_n)

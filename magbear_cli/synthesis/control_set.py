"""The values of K S, frequency by frequency, that keep the specification: a convex part of them about a present one.

With the plant n/d on the axis, G = n/d at the nominal mass and r = K S there, K = X/Y with X = r and Y = S = 1 + G r.
So the loop of another mass, Y d − X n, is affine in r.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import control_sensitivity, interconnection, open_interconnection
from magbear_cli.synthesis.descent import Responds
from magbear_cli.synthesis.half_plane import (
    complex_mu_level,
    nearest_direction,
    over_radius,
    plant_factors,
    real_mass_level,
)
from magbear_cli.synthesis.parrott import held_scales, level_discs

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Uncertainty = Literal["real", "complex"]

_SMALLEST = 1e-3  # of one: what a modulus is measured in where the present one vanishes


@dataclass(frozen=True)
class Modulus:
    """|offset + slope r| at each frequency, (w,) arrays, near one for the present r."""

    offset: Complexes
    slope: Complexes


@dataclass(frozen=True)
class Row:
    """Σ weights·moduli ≤ Re(offset + slope r) at each frequency; weights (k, w), the rest (w,)."""

    weights: Floats
    offset: Complexes
    slope: Complexes


@dataclass(frozen=True)
class ControlSet:
    """The r that satisfy all rows, at each frequency."""

    moduli: Sequence[Modulus]
    rows: Sequence[Row]


def specification_level(
    scaled: ControlProblem, controller: Responds, omega: Floats, uncertainty: Uncertainty
) -> Floats:
    """What must not exceed one at each frequency: the worst case over the real mass, or mu with complex blocks."""
    level = real_mass_level if uncertainty == "real" else complex_mu_level
    return level(scaled, controller.response(omega), omega)


def held_set(
    scaled: ControlProblem, present: Responds, omega: Floats, level: float, uncertainty: Uncertainty
) -> ControlSet:
    """A convex set of r within the specification at this level, which holds the present one if that does.

    Complex blocks: the disc that its D-scales leave. Real mass: the half-plane that separates the discs of both end
    masses from zero in the direction with the most room.
    """
    if uncertainty == "real":
        return _half_planes(scaled, control_sensitivity(scaled, present.response(omega), omega), omega, level)
    matrices = interconnection(scaled, present.response(omega), omega)
    discs = level_discs(open_interconnection(scaled, omega), held_scales(matrices, level), level)
    one, radius = np.ones((1, omega.size)), np.maximum(discs.radius, 1e-9 * (1.0 + np.abs(discs.centre)))
    inside = Modulus(np.asarray(-discs.centre / radius), np.asarray(1.0 / radius, dtype=complex))
    return ControlSet([inside], [Row(one, one[0].astype(complex), np.zeros(omega.size, dtype=complex))])


def _half_planes(scaled: ControlProblem, present: Complexes, omega: Floats, level: float) -> ControlSet:
    """Re(θ χ) above the radius for both end masses, θ the direction of the discs' hull nearest to zero."""
    d_nominal, n_nominal, _, _ = plant_factors(scaled, omega, scaled.nominal)
    plant = n_nominal / d_nominal
    sensitivity = 1.0 + plant * present
    s_size = np.maximum(np.abs(sensitivity), _SMALLEST)
    r_size = np.maximum(np.abs(present), _SMALLEST)
    slopes, ends, roomy = [], [], []
    for d, n, w1_d, w3_n in (plant_factors(scaled, omega, plant) for plant in scaled.family.ends):
        slope = plant * d - n
        centre = d + slope * present
        radius = w1_d * np.abs(sensitivity) + w3_n * np.abs(present)
        roomy.append(over_radius(centre, radius))
        slopes.append(slope)
        ends.append((d, np.stack([w1_d * s_size, w3_n * r_size]), centre))
    turn = np.conj(nearest_direction(roomy[0], roomy[-1]))
    rows = []
    for (d, radius, centre), slope in zip(ends, slopes, strict=True):
        side = level * turn / np.maximum(level * (turn * centre).real, _SMALLEST * np.abs(centre))
        rows.append(Row(radius * np.abs(side) / level, np.asarray(side * d), np.asarray(side * slope)))
    moduli = [
        Modulus(_complex(1.0 / s_size), _complex(plant / s_size)),
        Modulus(_complex(0.0 * r_size), _complex(1.0 / r_size)),
    ]
    return ControlSet(moduli, rows)


def _complex(values: Floats) -> Complexes:
    return np.asarray(values, dtype=np.complex128)

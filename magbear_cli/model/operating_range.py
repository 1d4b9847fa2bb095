"""How much the negative stiffness changes over an operating range, told as a change of mass (thesis section 4.3).

The linear bearing accelerates by k_z/m per metre. A k_z that varies over the range while m stays is, in that element of
the system matrix alone, a mass that varies while k_z stays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.optimize import minimize_scalar

from magbear_cli.errors import NumericsError
from magbear_cli.model.bearing import Bearing, linearization


@dataclass(frozen=True)
class OperatingRange:
    """A box of positions and control currents: [low, high] each, a point where low = high."""

    position_m: tuple[float, float]
    current_a: tuple[float, float]

    def __post_init__(self) -> None:
        """Refuse a box turned inside out."""
        for low, high in (self.position_m, self.current_a):
            if not -np.inf < low <= high < np.inf:
                raise NumericsError(f"an operating range needs low <= high, not [{low}, {high}]")


def stiffness_range(bearing: Bearing, operating_range: OperatingRange) -> tuple[float, float]:
    """The least and the largest negative stiffness in N/m over the box, exact.

    k_z = 2 k0 (i_upper²/(z0 − z)³ + i_lower²/(z0 + z)³) is convex in the position and in the current, each with the
    other held: the largest is at a corner. The least is on an edge: for a free current the least over it,
    4 k0 i0²/(z0³ + 3 z0 z²), falls with |z|, so that it leads to an end of the positions or to one of the currents.

    Raises
    ------
    NumericsError
        when the box leaves the gap.
    """
    positions, currents = operating_range.position_m, operating_range.current_a

    def stiffness(position_m: float, current_a: float) -> float:
        return linearization(bearing, position_m, current_a).negative_stiffness_n_per_m

    largest = max(stiffness(z, u) for z in positions for u in currents)
    across_currents = [_least(partial(stiffness, z), currents) for z in positions]
    across_positions = [_least(partial(_swapped, stiffness, u), positions) for u in currents]
    return min(across_currents + across_positions), largest


def equivalent_mass_uncertainty(bearing: Bearing, operating_range: OperatingRange, low_kg: float = 3.0) -> float:
    """The width m_Δ in kg of the mass range [low, low + m_Δ] that spreads k_z/m as the operating range does.

    low · (largest k_z / least k_z − 1), thesis Table 4.1, where the lightest rotor has 3 kg.
    """
    least, largest = stiffness_range(bearing, operating_range)
    return low_kg * (largest / least - 1.0)


def _swapped(function: Callable[[float, float], float], second: float, first: float) -> float:
    """The function with its arguments in the other order."""
    return function(first, second)


def _least(function: Callable[[float], float], interval: tuple[float, float]) -> float:
    """The minimum of a convex function over an interval."""
    low, high = interval
    ends = min(function(low), function(high))
    if low == high:
        return ends
    inner = minimize_scalar(function, bounds=interval, method="bounded", options={"xatol": 1e-10 * (high - low)})
    return min(ends, float(inner.fun))

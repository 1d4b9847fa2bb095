"""The second-order filters around the loop: the prefilter of the command and the dynamics of the position sensor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from magbear_cli.errors import NumericsError
from magbear_cli.lti.state_space import StateSpace


@dataclass(frozen=True)
class Prefilter:
    """The filter of the command, ω²/(s² + 2 ζ ω s + ω²) (thesis eq. 3.7)."""

    omega_rad_s: float
    zeta: float

    def __post_init__(self) -> None:
        """Refuse a frequency or a damping that is not positive."""
        _require_positive(self, "omega_rad_s", "zeta")

    def state_space(self) -> StateSpace:
        """The filter with unit gain at rest."""
        return _second_order(self.omega_rad_s, 2.0 * self.zeta * self.omega_rad_s)


@dataclass(frozen=True)
class SensorDynamics:
    """The position sensor, ω²/(s² + damping s + ω²); 4000 and 560 rad/s in thesis eq. 2.11."""

    omega_rad_s: float
    damping_rad_s: float

    def __post_init__(self) -> None:
        """Refuse a resonance or a damping that is not positive."""
        _require_positive(self, "omega_rad_s", "damping_rad_s")

    def state_space(self) -> StateSpace:
        """The sensor with unit gain at rest."""
        return _second_order(self.omega_rad_s, self.damping_rad_s)


def _require_positive(part: Prefilter | SensorDynamics, *names: str) -> None:
    """Refuse fields that are not positive and finite."""
    for name in names:
        if not 0 < getattr(part, name) < np.inf:
            raise NumericsError(f"{name} must be a positive number, not {getattr(part, name)}")


def _second_order(omega_rad_s: float, damping_rad_s: float) -> StateSpace:
    """ω²/(s² + damping s + ω²) in states of equal size: the output, and its rate over ω."""
    return StateSpace.of(
        [[0.0, omega_rad_s], [-omega_rad_s, -damping_rad_s]], [[0.0], [omega_rad_s]], [[1.0, 0.0]], [[0.0]]
    )

"""The rotor as the magnets feel it and the sensor sees it: one rigid mass, or two masses on a spring."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from magbear_cli.errors import NumericsError
from magbear_cli.lti.state_space import StateSpace


@dataclass(frozen=True)
class FlexibleRotor:
    """An elastic rotor (thesis section 4.7): the magnets pull one mass, the sensor looks at another.

    The sensor's mass is a part of the rotor's total mass; the rest is at the magnets.
    """

    sensor_mass_kg: float
    stiffness_n_per_m: float
    damping_n_s_per_m: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a mass or a spring that is not positive, and a damper that drives."""
        for name in ("sensor_mass_kg", "stiffness_n_per_m"):
            if not 0 < getattr(self, name) < np.inf:
                raise NumericsError(f"{name} must be a positive number, not {getattr(self, name)}")
        if not 0 <= self.damping_n_s_per_m < np.inf:
            raise NumericsError(f"damping_n_s_per_m must be zero or positive, not {self.damping_n_s_per_m}")

    def bearing_mass_kg(self, mass_kg: float) -> float:
        """The mass at the magnets, of a rotor of the given total mass.

        Raises
        ------
        NumericsError
            when the sensor's mass leaves nothing for the magnets.
        """
        if not self.sensor_mass_kg < mass_kg:
            raise NumericsError(f"a rotor of {mass_kg} kg has no sensor mass of {self.sensor_mass_kg} kg")
        return mass_kg - self.sensor_mass_kg

    def resonance_rad_s(self, mass_kg: float) -> float:
        """The undamped frequency of the free rotor, sqrt(k (1/m1 + 1/m2))."""
        bearing_mass = self.bearing_mass_kg(mass_kg)
        return float(np.sqrt(self.stiffness_n_per_m * (1.0 / bearing_mass + 1.0 / self.sensor_mass_kg)))


def rotor_dynamics(mass_kg: float, flexible: FlexibleRotor | None = None) -> StateSpace:
    """From the force at the magnets (N) to the positions at the magnets and at the sensor (m).

    Parameters
    ----------
    mass_kg : the rotor's total mass
    flexible : its elasticity; None for a rigid rotor, whose two positions are one

    Returns
    -------
    StateSpace with one input and two outputs; states: position and speed at the magnets, then at the sensor

    Raises
    ------
    NumericsError
        when the mass is not positive, or not larger than the sensor's mass.
    """
    if not 0 < mass_kg < np.inf:
        raise NumericsError(f"the rotor's mass must be a positive number, not {mass_kg}")
    if flexible is None:
        return StateSpace.of(
            [[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0 / mass_kg]], [[1.0, 0.0], [1.0, 0.0]], [[0.0], [0.0]]
        )
    m1, m2 = flexible.bearing_mass_kg(mass_kg), flexible.sensor_mass_kg
    k, c = flexible.stiffness_n_per_m, flexible.damping_n_s_per_m
    return StateSpace.of(
        [
            [0.0, 1.0, 0.0, 0.0],
            [-k / m1, -c / m1, k / m1, c / m1],
            [0.0, 0.0, 0.0, 1.0],
            [k / m2, c / m2, -k / m2, -c / m2],
        ],
        [[0.0], [1.0 / m1], [0.0], [0.0]],
        [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
        [[0.0], [0.0]],
    )

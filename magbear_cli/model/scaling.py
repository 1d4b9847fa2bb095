"""The control problem in its own units: nominal mass and stiffnesses 1, so that metres, amperes and rad/s drop out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.family import Plant, PlantFamily
from magbear_cli.model.problem import ControlProblem, RationalWeight


@dataclass(frozen=True)
class Scaling:
    """One unit of frequency (rad/s) and of controller gain (A/m) of the scaled problem."""

    omega_rad_s: float
    gain_a_per_m: float

    def controller(self, scaled: StateSpace) -> StateSpace:
        """The controller of the scaled problem in SI units: K(s) = gain·K'(s/omega)."""
        root = np.sqrt(self.omega_rad_s * self.gain_a_per_m)
        return StateSpace.of(
            scaled.a * self.omega_rad_s, scaled.b * root, scaled.c * root, scaled.d * self.gain_a_per_m
        )


def scale_problem(problem: ControlProblem) -> tuple[ControlProblem, Scaling]:
    """The problem with time in units of the nominal unstable pole and current in those of k_z/k_i, and the way back.

    m s² z = k_z z + k_i u becomes m' s'² z = k_z' z + k_i' u' with each parameter in units of the nominal plant's,
    s' = s/ω0, ω0² = k_z/m. S, T and hence every level stay as they are.
    """
    nominal, omega = problem.nominal, problem.natural_rad_s
    first, last = (
        Plant(
            plant.mass_kg / nominal.mass_kg,
            plant.negative_stiffness_n_per_m / nominal.negative_stiffness_n_per_m,
            plant.current_stiffness_n_per_a / nominal.current_stiffness_n_per_a,
        )
        for plant in (problem.family.first, problem.family.last)
    )
    scaled = ControlProblem(
        PlantFamily(first, last),
        scale_weight(problem.performance, omega),
        None if problem.omega_c_rad_s is None else problem.omega_c_rad_s / omega,
    )
    return scaled, Scaling(omega, nominal.negative_stiffness_n_per_m / nominal.current_stiffness_n_per_a)


def scale_weight(weight: RationalWeight, omega_rad_s: float) -> RationalWeight:
    """The weight as a function of s' = s/omega, its denominator monic."""
    den = [c * omega_rad_s**power for power, c in zip(range(len(weight.den) - 1, -1, -1), weight.den, strict=True)]
    num = [c * omega_rad_s**power for power, c in zip(range(len(weight.num) - 1, -1, -1), weight.num, strict=True)]
    lead = next(c for c in den if c != 0)
    return RationalWeight(tuple(c / lead for c in num), tuple(c / lead for c in den))

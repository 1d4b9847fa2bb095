"""The control problem in its own units: k_z = k_i = 1, nominal mass 1, so that metres, amperes and rad/s drop out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, MassRange, RationalWeight


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
    """The problem with time in units of the unstable pole and current in units of k_z/k_i, and the way back.

    m s² z = k_z z + k_i u becomes m' s'² z = z + u' with m' = m/m_nominal, s' = s/ω0, ω0² = k_z/m_nominal. S, T and
    hence every level stay as they are.
    """
    omega = problem.natural_rad_s
    nominal = problem.mass.nominal_kg
    low = problem.mass.low_kg / nominal
    high = low if problem.mass.is_fixed else problem.mass.high_kg / nominal
    scaled = replace(
        problem,
        negative_stiffness_n_per_m=1.0,
        current_stiffness_n_per_a=1.0,
        mass=MassRange(low, high),
        performance=scale_weight(problem.performance, omega),
        omega_c_rad_s=None if problem.omega_c_rad_s is None else problem.omega_c_rad_s / omega,
    )
    gain = problem.negative_stiffness_n_per_m / problem.current_stiffness_n_per_a
    return scaled, Scaling(omega, gain)


def scale_weight(weight: RationalWeight, omega_rad_s: float) -> RationalWeight:
    """The weight as a function of s' = s/omega, its denominator monic."""
    den = [c * omega_rad_s**power for power, c in zip(range(len(weight.den) - 1, -1, -1), weight.den, strict=True)]
    num = [c * omega_rad_s**power for power, c in zip(range(len(weight.num) - 1, -1, -1), weight.num, strict=True)]
    lead = next(c for c in den if c != 0)
    return RationalWeight(tuple(c / lead for c in num), tuple(c / lead for c in den))

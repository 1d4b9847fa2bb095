"""Whether a controller holds the rotor at all: the closed-loop poles in the middle and at the ends of the range."""

from __future__ import annotations

import numpy as np

from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem


def stabilises(scaled: ControlProblem, controller: StateSpace) -> bool:
    """Whether all poles of the scaled loop lie in the left half-plane for the lowest, nominal and highest mass.

    A descent needs this beside its level: a pole that changes sides between two frequencies of the grid, or beyond its
    ends, leaves no trace in the level. It is a screen for candidates, not a verification.
    """
    masses = {scaled.mass.low_kg, scaled.mass.nominal_kg, scaled.mass.high_kg}
    return all(_poles_left(scaled, controller, mass) for mass in masses)


def _poles_left(scaled: ControlProblem, controller: StateSpace, mass_kg: float) -> bool:
    inertia, k_z, k_i = scaled.inertia_kg(mass_kg), scaled.stiffness_n_per_m(mass_kg), scaled.current_stiffness_n_per_a
    plant = np.array([[0.0, 1.0], [k_z / inertia, 0.0]])
    enter, leave = np.array([[0.0], [k_i / inertia]]), np.array([[1.0, 0.0]])
    through = plant + enter @ controller.d @ leave
    closed = np.block([[through, enter @ controller.c], [controller.b @ leave, controller.a]])
    return bool(np.linalg.eigvals(closed).real.max() < 0.0)

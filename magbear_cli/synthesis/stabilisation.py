"""Whether a controller holds the rotor at all: the closed-loop poles in the middle and at the ends of the range."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from magbear_cli.lti.conversion import zeros_poles_gain
from magbear_cli.lti.resonance import resonance_frequencies
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem


def stabilises(scaled: ControlProblem, controller: StateSpace) -> bool:
    """Whether all poles of the scaled loop lie in the left half-plane for the lowest, nominal and highest mass.

    A descent needs this beside its level: a pole that changes sides between two frequencies of the grid, or beyond its
    ends, leaves no trace in the level. It is a screen for candidates, not a verification.
    """
    masses = {scaled.mass.low_kg, scaled.mass.nominal_kg, scaled.mass.high_kg}
    return all(bool(loop_poles(scaled, controller, mass).real.max() < 0.0) for mass in masses)


def loop_resonances(problem: ControlProblem, controller: StateSpace) -> NDArray[np.float64]:
    """Frequencies (w,) near the resonances of the controller's poles and zeros and of the loop of both end masses."""
    zeros, poles, _ = zeros_poles_gain(controller)
    closed = [loop_poles(problem, controller, mass) for mass in problem.end_masses_kg]
    return resonance_frequencies(np.concatenate([zeros, poles, *closed]))


def loop_poles(scaled: ControlProblem, controller: StateSpace, mass_kg: float) -> NDArray[np.complex128]:
    """The poles (n + 2,) of the loop with one mass, in the problem's own units."""
    inertia, k_z, k_i = scaled.inertia_kg(mass_kg), scaled.stiffness_n_per_m(mass_kg), scaled.current_stiffness_n_per_a
    plant = np.array([[0.0, 1.0], [k_z / inertia, 0.0]])
    enter, leave = np.array([[0.0], [k_i / inertia]]), np.array([[1.0, 0.0]])
    through = plant + enter @ controller.d @ leave
    closed = np.block([[through, enter @ controller.c], [controller.b @ leave, controller.a]])
    return np.asarray(np.linalg.eigvals(closed), dtype=complex)

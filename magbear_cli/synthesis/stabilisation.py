"""Whether a controller holds the rotor at all: the closed-loop poles in the middle and at the ends of the range."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from magbear_cli.lti.conversion import zeros_poles_gain
from magbear_cli.lti.resonance import resonance_frequencies
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem


def stabilises(scaled: ControlProblem, controller: StateSpace) -> bool:
    """Whether all poles of the scaled loop lie in the left half-plane for both ends of the family and its middle.

    A descent needs this beside its level: a pole that changes sides between two frequencies of the grid, or beyond its
    ends, leaves no trace in the level. It is a screen for candidates, not a verification.
    """
    return all(
        bool(loop_poles(scaled, controller, float(share)).real.max() < 0.0) for share in scaled.family.shown_shares()
    )


def loop_resonances(problem: ControlProblem, controller: StateSpace) -> NDArray[np.float64]:
    """Frequencies (w,) near the resonances of the controller's poles and zeros and of the loop of both ends."""
    zeros, poles, _ = zeros_poles_gain(controller)
    closed = [loop_poles(problem, controller, share) for share in problem.family.end_shares]
    return resonance_frequencies(np.concatenate([zeros, poles, *closed]))


def loop_poles(scaled: ControlProblem, controller: StateSpace, share: float) -> NDArray[np.complex128]:
    """The poles (n + 2,) of the loop of one member, in the problem's own units."""
    plant = np.array([[0.0, 1.0], [scaled.family.pole_squared(share), 0.0]])
    enter, leave = np.array([[0.0], [scaled.family.acceleration_per_current(share)]]), np.array([[1.0, 0.0]])
    through = plant + enter @ controller.d @ leave
    closed = np.block([[through, enter @ controller.c], [controller.b @ leave, controller.a]])
    return np.asarray(np.linalg.eigvals(closed), dtype=complex)

"""The loop over frequency for members of a family: K, S, T and K S."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magbear_cli.analysis.supremum import supremum
from magbear_cli.errors import NumericsError
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class LoopFunctions:
    """S = 1/(1 − K G), T = −K G S and K S, for members (rows) and frequencies (columns)."""

    omega_rad_s: Floats  # (w,)
    shares: Floats  # (k,)
    sensitivity: Complexes  # (k, w)
    complementary_sensitivity: Complexes  # (k, w)
    control_sensitivity_a_per_m: Complexes  # (k, w)
    controller_a_per_m: Complexes  # (w,)


def controller_response(controller: StateSpace, omega_rad_s: Floats) -> Complexes:
    """K(jω) in A/m, of shape (w,).

    Raises
    ------
    NumericsError
        when the controller does not map one measurement to one current.
    """
    if (controller.inputs, controller.outputs) != (1, 1):
        raise NumericsError(
            f"the loop needs a controller of one input and one output, not {controller.inputs} and {controller.outputs}"
        )
    return np.asarray(frequency_response(controller, np.asarray(omega_rad_s, dtype=float))[:, 0, 0], dtype=complex)


def loop_functions(
    problem: ControlProblem, controller: StateSpace, omega_rad_s: Floats, shares: ArrayLike
) -> LoopFunctions:
    """K, S, T and K S of every member at every frequency.

    Notes
    -----
    With G = −1/ρ, S is formed as ρ/(ρ + K), which is exact at the ends where 1 − K G would cancel.
    """
    response = controller_response(controller, omega_rad_s)
    members = np.atleast_1d(np.asarray(shares, dtype=float))
    rho = problem.family.current_per_displacement(omega_rad_s, members[:, None])
    closed = rho + response
    sensitivity = rho / closed
    return LoopFunctions(omega_rad_s, members, sensitivity, response / closed, response * sensitivity, response)


def peak_controller_gain(controller: StateSpace, omega_rad_s: Floats) -> tuple[float, float]:
    """The supremum of |K| over frequency in A/m, and its frequency in rad/s."""
    return supremum(
        lambda omega: np.abs(controller_response(controller, omega)), omega_rad_s, abs(float(controller.d[0, 0]))
    )


def peak_control_sensitivity(
    problem: ControlProblem, controller: StateSpace, omega_rad_s: Floats, share: float
) -> tuple[float, float]:
    """The supremum of |K S| over frequency in A/m for one member, and its frequency in rad/s."""
    quantity: Callable[[Floats], Floats] = lambda omega: np.abs(  # noqa: E731 - one expression, used once
        loop_functions(problem, controller, omega, share).control_sensitivity_a_per_m[0]
    )
    return supremum(quantity, omega_rad_s, abs(float(controller.d[0, 0])))

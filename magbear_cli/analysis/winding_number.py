"""The number of unstable closed-loop poles, counted on the Nyquist curve and not by eigenvalues.

F(s) = a + b K(s) − s² has the closed-loop poles for zeros, the poles of K for poles, and two more poles at
infinity. By the argument principle on the right half-plane, an upward half of the axis turns F by π (1 + P − Z), where
P poles of K and Z closed-loop poles are unstable. A hidden unstable mode of K is in both counts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magbear_cli.analysis.pole_family import controller_poles
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_LARGEST_TURN = 0.3  # rad between neighbouring points
_HALVINGS = 40
_MOST_POINTS = 200_000
_WHOLE = 0.02  # how far from a whole number a count may lie
_ENTRIES_AT_ONCE = 2_000_000


@dataclass(frozen=True)
class UnstablePoles:
    """A count of unstable closed-loop poles; None where the curve cannot be followed, with the reason.

    ``shift_rad_s`` is how far to the right of the axis the curve ran: poles between the two are not counted.
    """

    count: int | None
    points: int
    shift_rad_s: float = 0.0
    reason: str = ""


def dense_response(controller: StateSpace, s: NDArray[np.complexfloating[Any, Any]]) -> Complexes:
    """K(s) at any complex frequencies (w,), each by a dense linear solve with partial pivoting.

    Slower than the response by a Hessenberg form, and independent of it. The states should be of comparable size.
    """
    n = controller.order
    response = np.full(s.shape, complex(controller.d[0, 0]))
    if n == 0:
        return response
    chunk = max(1, _ENTRIES_AT_ONCE // (n * n))
    for start in range(0, s.size, chunk):
        points = s[start : start + chunk]
        states = np.linalg.solve(
            points[:, None, None] * np.eye(n) - controller.a, np.broadcast_to(controller.b, (1, n, 1))
        )
        response[start : start + chunk] += (controller.c @ states)[:, 0, 0]
    return response


def unstable_poles(problem: ControlProblem, controller: StateSpace, share: float, omega_rad_s: Floats) -> UnstablePoles:
    """The number of closed-loop poles in the right half-plane for one member, from the turning of F.

    Parameters
    ----------
    omega_rad_s : (w,) positive ascending frequencies to start from; intervals that turn too much are halved

    Notes
    -----
    The poles of K whose sign is below their rounding error are left to the left of the curve, which is shifted to the
    right by twice that error; the closed-loop poles between the axis and the curve are then not seen.
    """
    a, b = float(problem.family.pole_squared(share)), float(problem.family.acceleration_per_current(share))
    values, errors = controller_poles(controller)
    doubtful = np.abs(values.real) <= errors
    shift = 2.0 * float(np.max(np.maximum(errors, np.abs(values.real))[doubtful], initial=0.0))
    unstable = int((values.real > shift).sum())

    def curve(omega: Floats) -> Complexes:
        s = shift + 1j * omega
        return np.asarray(a + b * dense_response(controller, s) - s**2, dtype=complex)

    try:
        omega = np.concatenate([[0.0], omega_rad_s, _far((a, b), controller, omega_rad_s[-1])])
        turned, points = _turning(curve, omega)
    except np.linalg.LinAlgError:
        return UnstablePoles(None, 0, shift, "the controller has a pole on the curve")
    if not np.isfinite(turned):
        return UnstablePoles(
            None, points, shift, "the curve turns too fast to be followed: a pole lies on the imaginary axis"
        )
    count = 1 + unstable - turned / np.pi
    if abs(count - round(count)) > _WHOLE or round(count) < 0:
        return UnstablePoles(None, points, shift, f"the curve turns by {turned / np.pi:.4g}π, which counts no poles")
    return UnstablePoles(round(count), points, shift)


def _far(plant: tuple[float, float], controller: StateSpace, last: float) -> Floats:
    """Frequencies from the last to where ω² is 1e6 times all that a and b K can add."""
    gain = abs(complex(dense_response(controller, np.array([1j * last]))[0]))
    gain = max(gain, abs(float(controller.d[0, 0])))
    end = max(1e3 * float(np.sqrt(plant[1] * gain + plant[0])), 10.0 * last)
    return np.geomspace(last, end, 100)[1:]


def _turning(curve: Callable[[Floats], Complexes], omega: Floats) -> tuple[float, int]:
    """The angle in rad that the curve turns about zero, and the points it took; NaN where it cannot be followed."""
    values = curve(omega)
    total, points = 0.0, omega.size
    low, high, at_low, at_high = omega[:-1], omega[1:], values[:-1], values[1:]
    for _ in range(_HALVINGS):
        if not (np.isfinite(at_low).all() and np.isfinite(at_high).all() and (at_low != 0).all()):
            return float("nan"), points
        turn = np.angle(at_high / at_low)
        # a step that changes the modulus much may hide a turn as well as one that turns much
        steep = np.abs(np.log(np.maximum(np.abs(at_high / at_low), 1e-300))) > 2.0 * _LARGEST_TURN
        coarse = (np.abs(turn) > _LARGEST_TURN) | (steep & (np.abs(turn) > 0.01))
        total += float(turn[~coarse].sum())
        low, high, at_low, at_high = low[coarse], high[coarse], at_low[coarse], at_high[coarse]
        if low.size == 0:
            return total, points
        middle = np.where(low > 0, np.sqrt(np.maximum(low, 1e-300) * high), high / 2.0)
        points += middle.size
        if points > _MOST_POINTS:
            break
        at_middle = curve(middle)
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
        at_low, at_high = np.concatenate([at_low, at_middle]), np.concatenate([at_middle, at_high])
    return float("nan"), points

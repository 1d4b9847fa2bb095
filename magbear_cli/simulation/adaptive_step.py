"""One smooth step of the adaptive loop: the forces at Radau's points by Newton's method, and how far they are right.

Only the forces are unknown. From them follow the states (``adaptive_flow``) and, while the law adapts, the estimate:
its constant is linear as the states are, its slopes are the integrals of one product.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgesv

from magbear_cli.simulation.adaptive_branch import Branch, LinearBranch
from magbear_cli.simulation.adaptive_flow import (
    AWAY,
    DEMAND,
    LEARNED,
    STAGES,
    Flow,
    at_points_of,
    highest_degrees,
)
from magbear_cli.simulation.collocation import radau_points

Floats = NDArray[np.float64]

NEWTON_STEPS = 12
_IDENTITY, _ONE, _TINY = np.eye(STAGES), np.ones(1), float(np.finfo(float).tiny)
RUNAWAY_N = 1e12  # a change of the forces beyond this is no solution


@dataclass(frozen=True, eq=False)
class Start:
    """Where a step begins: the states and the three coefficients (n + 3,), and what stays the same within it.

    ``centre`` (2, 1) is what the estimate is expanded about, ``slopes`` whether it has slopes that learn.
    """

    state: Floats
    centre: Floats
    branch: Branch | LinearBranch
    pulse_n: float
    slopes: bool


def solve_step(flow: Flow, start: Start, guess: Floats, tolerance_n: float) -> tuple[Floats, Floats] | None:
    """The states and coefficients at the knots, (n + 3, s + 1), and the forces at the points, (s,); None without any.

    Parameters
    ----------
    guess : (s,) forces to begin with
    tolerance_n : the change of the forces (root of the mean square) at which Newton's method has arrived
    """
    order, branch = start.state.size - 3, start.branch
    coefficients, forces, forced = start.state[order:, None], guess, flow.forced
    known = np.concatenate((start.state[:order], _ONE, guess))
    begin = known[: order + 1]
    free = flow.free.dot(begin).reshape(-1, STAGES)
    free[DEMAND] -= start.state[order]
    free[AWAY:LEARNED] -= start.centre
    slopes, arrived = coefficients[1:], STAGES * tolerance_n**2
    before = np.inf
    for _ in range(NEWTON_STEPS):
        outputs = free + forced.dot(forces).reshape(-1, STAGES)
        near = outputs[AWAY:LEARNED]
        if start.slopes:
            slopes = coefficients[1:] + (outputs[LEARNED] * near).dot(flow.integral)
        estimate = slopes * near
        values, stiffness, gain = branch.force(outputs[:DEMAND], outputs[DEMAND] - estimate[0] - estimate[1])
        # the estimate's slopes are left out of the derivative: they are the square of a small distance
        jacobian = stiffness[:, None] * flow.position
        jacobian += gain[:, None] * flow.demand
        np.subtract(_IDENTITY, jacobian, out=jacobian)
        _, _, change, singular = dgesv(jacobian, values + start.pulse_n - forces, 1, 1)
        forces = forces + change
        size = float(change.dot(change))
        if singular or not size < STAGES * RUNAWAY_N**2:
            return None
        if size <= arrived or size * size <= arrived * before < np.inf:
            break
        before = size
    else:
        return None
    outputs = free + forced.dot(forces).reshape(-1, STAGES)
    if isinstance(branch, Branch) and not outputs[:DEMAND].min() > 0.0:
        return None
    known[order + 1 :] = forces
    knots = np.empty((order + 3, STAGES + 1))
    knots[:, 0] = start.state
    knots[:order, 1:] = flow.states.dot(known).reshape(order, STAGES)
    knots[order:, 1:] = coefficients
    knots[order, 1:] += outputs[LEARNED].dot(flow.integral)
    if start.slopes:
        knots[order + 1 :, 1:] += (outputs[LEARNED] * outputs[AWAY:LEARNED]).dot(flow.integral)
    return knots, forces


def relative_error(knots: Floats, absolute: Floats, relative: float) -> float:
    """The error of the polynomials through the knots, over what is allowed: absolute (n + 3,) and relative ones.

    It is the size that the first coefficients of Legendre's series left out would have, if they went on as the last
    two pairs do (in pairs, as every other may be zero), in the state where that is worst.
    """
    last = np.abs(knots.dot(highest_degrees()))
    before, end = np.maximum(last[:, 0], last[:, 1]), np.maximum(last[:, 2], last[:, 3])
    end *= end / np.maximum(np.maximum(before, end), _TINY)
    return float((end / (absolute + relative * np.abs(knots).max(axis=1))).max())


def carried_on(forces: Floats, place: float, ratio: float) -> Floats:
    """Forces to begin with: those of the step before, beyond the place where it was cut off, and then its last one.

    ``ratio`` is the new width over the old one.
    """
    if place >= 1.0:
        return np.full(STAGES, forces[-1])
    return np.asarray(at_points_of(np.minimum(place + ratio * radau_points(STAGES), 1.0)).dot(forces))

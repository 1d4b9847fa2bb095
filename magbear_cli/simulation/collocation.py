"""One step of the loop: the linear part by its matrix exponential, the force by collocation at Radau's points.

Over a step of width h the force is the polynomial through its values at the points c_1 h … c_s h, c_s = 1. The response
of the linear part to a polynomial is exact, so only the s numbers f_i = force(outputs at c_i h) are unknown: Newton's
method finds them. Controllers with poles of 1e6 rad/s and more cost nothing but their exponential, and as with Radau
IIA methods (Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.5) a fast loop is damped.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import factorial

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.linalg import expm

from magbear_cli.simulation.loop import DEMAND, MAGNETS, Loop

Floats = NDArray[np.float64]

STAGES = 6
NEWTON_STEPS = 10
ROUNDING = 3e-14  # of the pulls: some ten operations, and the extrapolation of their errors by the polynomial
FINE = np.linspace(0.0, 1.0, 17)  # where the force of the interpolated outputs is compared with the polynomial


@cache
def radau_points() -> Floats:
    """The right Radau points of (0, 1]: the roots of P_s − P_(s−1), the last one 1."""
    roots = legendre.legroots([0.0] * (STAGES - 1) + [-1.0, 1.0])
    points = (np.sort(np.real(roots)) + 1.0) / 2.0
    points[-1] = 1.0
    return points


@cache
def knots() -> Floats:
    """The start of the step and the Radau points: where the outputs of a step are kept, as fractions of its width."""
    return np.append(0.0, radau_points())


@cache
def probes() -> Floats:
    """Two points of a step, half-way between Radau points, where the force is checked against the polynomial."""
    points = radau_points()
    return np.array([(points[1] + points[2]) / 2.0, (points[3] + points[4]) / 2.0])


def interpolation(nodes: Floats, points: Floats) -> Floats:
    """The matrix that takes the values of a polynomial at the nodes to its values at the points."""
    degree = nodes.size
    at_nodes, at_points = (legendre.legvander(2.0 * x - 1.0, degree - 1) for x in (nodes, points))
    return np.asarray(np.linalg.solve(at_nodes.T, at_points.T).T)


@cache
def carried_on(ratio: float) -> Floats:
    """The matrix that takes the forces of a step to those of the next one, wider by a ratio, on the same polynomial."""
    return interpolation(radau_points(), 1.0 + ratio * radau_points())


@cache
def _force_at_probes() -> Floats:
    return interpolation(radau_points(), probes())


@cache
def _force_at_fine() -> Floats:
    return interpolation(radau_points(), FINE)


@cache
def _outputs_at_fine() -> Floats:
    return interpolation(knots(), FINE)


@dataclass(frozen=True, eq=False)
class Propagator:
    """The linear part over a step of one width: from the state and the forces at the Radau points.

    Outputs at the points followed by the probes: free @ x + forced @ f, of shapes (s + 2, 4, n) and (s + 2, 4, s).
    State at the end: end_free @ x + end_forced @ f.
    """

    width_s: float
    free: Floats
    forced: Floats
    end_free: Floats
    end_forced: Floats


def build_propagator(loop: Loop, width_s: float) -> Propagator:
    """The exact response of the linear part over one width, by one matrix exponential a point."""
    order = loop.b.size
    size = order + STAGES
    # z' = h A z + h B q_0, q_k' = q_(k+1): q_k are the derivatives of the polynomial at the start, in units of h
    generator = np.zeros((size, size))
    generator[:order, :order] = width_s * loop.a
    generator[:order, order] = width_s * loop.b
    generator[order:, order:] = np.eye(STAGES, k=1)
    points = np.concatenate([radau_points(), probes()])
    flows = expm(points[:, None, None] * generator)[:, :order]
    derivatives = radau_points()[:, None] ** np.arange(STAGES) / [factorial(k) for k in range(STAGES)]
    free = flows[:, :, :order]
    forced = flows[:, :, order:] @ np.linalg.inv(derivatives)
    return Propagator(width_s, loop.c @ free, loop.c @ forced, free[STAGES - 1], forced[STAGES - 1])


@dataclass(frozen=True, eq=False)
class Step:
    """A step that was solved: its end state, the forces at the Radau points, the outputs at the knots, its defect.

    ``defect_n`` is the largest difference found between the force of the outputs and the polynomial; ``noise_n`` the
    rounding error of the force.
    """

    end: Floats
    forces: Floats
    outputs: Floats
    defect_n: float
    noise_n: float


def solve_step(
    loop: Loop, propagator: Propagator, start: Floats, pulse_n: float, guess: Floats, tolerance_n_s: float
) -> Step | None:
    """The step from a state, or None when Newton's method fails or leaves the gap.

    Parameters
    ----------
    start : (n,) state
    pulse_n : constant force on top of that of the magnets
    guess : (s,) forces to begin with
    tolerance_n_s : the impulse to which Newton's method is driven, rounding permitting
    """
    free = propagator.free @ start
    forces = guess
    stage_z, stage_v = propagator.forced[:STAGES, MAGNETS], propagator.forced[:STAGES, DEMAND]
    for _ in range(NEWTON_STEPS):
        values, stiffness, gain = loop.magnets.force(
            free[:STAGES, MAGNETS] + stage_z @ forces, free[:STAGES, DEMAND] + stage_v @ forces
        )
        residual = values + pulse_n - forces
        if not np.isfinite(residual).all():
            return None
        jacobian = np.eye(STAGES) - stiffness[:, None] * stage_z - gain[:, None] * stage_v
        try:
            change = np.linalg.solve(jacobian, residual)
        except np.linalg.LinAlgError:
            return None
        forces = forces + change
        noise = _noise(loop, stiffness)
        if propagator.width_s * np.abs(change).max() <= tolerance_n_s + propagator.width_s * noise:
            return _finish(loop, propagator, start, pulse_n, free, forces)
    return None


def _finish(
    loop: Loop, propagator: Propagator, start: Floats, pulse_n: float, free: Floats, forces: Floats
) -> Step | None:
    """The step with these forces, and how far its polynomial is from the force; None outside the gap."""
    outputs = free + propagator.forced @ forces
    end = propagator.end_free @ start + propagator.end_forced @ forces
    kept = np.vstack([loop.c @ start, outputs[:STAGES]])
    below, above = loop.magnets.gap_m
    inside = (below < outputs[:, MAGNETS]).all() and (outputs[:, MAGNETS] < above).all()
    if not (np.isfinite(end).all() and np.isfinite(kept).all()) or not (inside or loop.magnets.is_linear):
        return None
    checked = np.vstack([outputs[STAGES:], _outputs_at_fine() @ kept])
    values, stiffness, _ = loop.magnets.force(checked[:, MAGNETS], checked[:, DEMAND])
    polynomial = np.concatenate([_force_at_probes() @ forces, _force_at_fine() @ forces])
    defect = float(np.abs(values + pulse_n - polynomial).max())
    return Step(end, forces, kept, defect, _noise(loop, stiffness))


def _noise(loop: Loop, stiffness: Floats) -> float:
    """The rounding error of the force at the checked points; z0/2 times the stiffness is at least the two pulls."""
    return ROUNDING * float(np.abs(stiffness).max()) * loop.magnets.bearing.air_gap_m

"""One step of many loops: the linear part by its matrix exponential, the force by collocation at Radau's points.

Over a step of width h the force is the polynomial through its values at the points c_1 h … c_s h, c_s = 1. The response
of the linear part to a polynomial is exact, so only the s numbers f_i = force(outputs at c_i h) are unknown: Newton's
method finds them. Controllers with poles of 1e6 rad/s and more cost nothing but their exponential, and as with Radau
IIA methods (Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.5) a fast loop is damped.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from math import comb

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from magbear_cli.simulation.loop import DEMAND, MAGNETS, Fleet
from magbear_cli.simulation.propagation import Propagator

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Booleans = NDArray[np.bool_]

STAGES = 7
NEWTON_STEPS = 10
ROUNDING = 3e-14  # of the pulls: some ten operations, and the extrapolation of their errors by the polynomial
_IDENTITY = np.eye(STAGES)
FINE = np.linspace(0.0, 1.0, 17)  # where the force of the interpolated outputs is compared with the polynomial


@cache
def radau_points(stages: int = STAGES) -> Floats:
    """The right Radau points of (0, 1]: the roots of P_s − P_(s−1), the last one 1."""
    roots = legendre.legroots([0.0] * (stages - 1) + [-1.0, 1.0])
    points = (np.sort(np.real(roots)) + 1.0) / 2.0
    points[-1] = 1.0
    return points


@cache
def knots(stages: int = STAGES) -> Floats:
    """The start of the step and the Radau points: where the outputs of a step are kept, as fractions of its width."""
    return np.append(0.0, radau_points(stages))


@cache
def probes() -> Floats:
    """Two points of a step, half-way between Radau points, where the force is checked against the polynomial."""
    points, middle = radau_points(), STAGES // 2
    return np.array([(points[middle - 2] + points[middle - 1]) / 2.0, (points[middle] + points[middle + 1]) / 2.0])


@cache
def hull(stages: int = STAGES) -> Floats:
    """The matrix that takes values at the knots to coefficients between which their polynomial stays over the step.

    They are those of Bernstein's form; the first and the last are the values at the ends of the step.
    """
    x, k = knots(stages)[:, None], np.arange(stages + 1)
    binomials = np.array([comb(stages, at) for at in k], dtype=float)
    return np.asarray(np.linalg.inv(binomials * x**k * (1.0 - x) ** (stages - k)))


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
def _force_at_checks() -> Floats:
    return interpolation(radau_points(), np.append(probes(), FINE))


@cache
def _outputs_at_fine() -> Floats:
    return interpolation(knots(), FINE)


@dataclass(frozen=True, eq=False)
class Steps:
    """Steps that were tried, one a loop, k of them.

    ``solved`` (k,) is False where Newton's method failed or left the gap, and the rest of that row means nothing. Else
    the end state (k, n), the forces at the Radau points (k, s) and the outputs at the knots (k, s + 1, 4); ``defect_n``
    (k,) is the largest difference found between the force of the outputs and the polynomial, and ``noise_n`` (k,) the
    rounding error of the force.
    """

    solved: Booleans
    end: Floats
    forces: Floats
    outputs: Floats
    defect_n: Floats
    noise_n: Floats

    def at(self, places: Indices) -> Steps:
        """Some of them."""
        if places.size == self.solved.size:
            return self
        return Steps(
            self.solved[places],
            self.end[places],
            self.forces[places],
            self.outputs[places],
            self.defect_n[places],
            self.noise_n[places],
        )


@dataclass(frozen=True, eq=False)
class Task:
    """What is to be stepped: which loops of a fleet, from which states (k, n), under which constant force on top.

    ``width_s`` (k,) are the widths, and ``of_width`` (k,) tells each loop's place among the propagators.
    """

    fleet: Fleet
    rows: Indices
    propagators: tuple[Propagator, ...]
    of_width: Indices
    width_s: Floats
    start: Floats
    pulse_n: float

    def groups(self) -> Iterator[tuple[Propagator, Indices | slice]]:
        """The propagators with the places of those that use them."""
        if len(self.propagators) == 1:
            yield self.propagators[0], slice(None)
            return
        for at, propagator in enumerate(self.propagators):
            yield propagator, np.flatnonzero(self.of_width == at)

    def forced(self) -> Floats:
        """The outputs at the points per unit force at the Radau points, (k, s + 2, 4, s)."""
        shares = self.fleet.shares[self.rows, None, None, None]
        if len(self.propagators) == 1:
            return np.asarray(self.propagators[0].forced * shares)
        return np.asarray(np.stack([propagator.forced for propagator in self.propagators])[self.of_width] * shares)


def solve_steps(task: Task, guess: Floats, tolerance_n_s: Floats) -> Steps:
    """One step of every loop of a task.

    Parameters
    ----------
    guess : (k, s) forces to begin with
    tolerance_n_s : (k,) the impulses to which Newton's method is driven, rounding permitting
    """
    count, order = task.start.shape
    free = np.empty((count, STAGES + 2, 4))
    for propagator, at in task.groups():
        free[at] = (task.start[at] @ propagator.free).reshape(-1, STAGES + 2, 4)
    forced = task.forced()
    forces, solved = _collocated(task, free, forced, guess, tolerance_n_s)
    outputs = free + (forced.reshape(count, -1, STAGES) @ forces[:, :, None]).reshape(free.shape)
    end, moved = np.empty((count, order)), forces * task.fleet.shares[task.rows, None]
    for propagator, at in task.groups():
        end[at] = task.start[at] @ propagator.end_free + moved[at] @ propagator.end_forced
    kept = np.empty((count, STAGES + 1, 4))
    kept[:, 0], kept[:, 1:] = task.start @ task.fleet.one.c.T, outputs[:, :STAGES]
    checked = np.empty((count, 2 + FINE.size, 4))
    checked[:, :2], checked[:, 2:] = outputs[:, STAGES:], _outputs_at_fine() @ kept
    values, stiffness, _ = task.fleet.force(task.rows, checked[:, :, MAGNETS], checked[:, :, DEMAND])
    defect = np.abs(values + task.pulse_n - forces @ _force_at_checks().T).max(axis=1)
    solved &= np.isfinite(defect + end.sum(axis=1))
    if not task.fleet.one.magnets.is_linear:
        solved &= _inside(outputs[:, :, MAGNETS], task.fleet.one.magnets.gap_m)
    return Steps(solved, end, forces, kept, defect, _noise(task.fleet, stiffness))


def _inside(positions: Floats, gap_m: tuple[float, float]) -> Booleans:
    """Which rows lie within the gap."""
    below, above = gap_m
    return np.asarray((positions.min(axis=1) > below) & (positions.max(axis=1) < above))


def _collocated(
    task: Task, free: Floats, forced: Floats, guess: Floats, tolerance_n_s: Floats
) -> tuple[Floats, Booleans]:
    """The forces at the Radau points by Newton's method, (k, s), and where it converged."""
    stage_z, stage_v = forced[:, :STAGES, MAGNETS], forced[:, :STAGES, DEMAND]
    free_z, free_v = free[:, :STAGES, MAGNETS], free[:, :STAGES, DEMAND]
    forces, width, identity = guess, task.width_s, _IDENTITY
    solved = failed = np.zeros(guess.shape[0], dtype=bool)
    for _ in range(NEWTON_STEPS):
        column = forces[:, :, None]
        position, demand = free_z + (stage_z @ column)[:, :, 0], free_v + (stage_v @ column)[:, :, 0]
        values, stiffness, gain = task.fleet.force(task.rows, position, demand)
        residual = values + task.pulse_n - forces
        failed = failed | ~np.isfinite(residual.sum(axis=1))
        jacobian = identity - stiffness[:, :, None] * stage_z - gain[:, :, None] * stage_v
        if failed.any():
            jacobian[failed], residual[failed] = identity, 0.0
        change = _solved(jacobian, residual)
        largest = np.abs(change).max(axis=1)
        failed = failed | ~np.isfinite(largest)
        settled = solved | failed
        if settled.any():
            change[settled] = 0.0
        forces = forces + change
        near = width * largest <= tolerance_n_s + width * _noise(task.fleet, stiffness)
        solved = solved | (near & ~failed)
        if (solved | failed).all():
            break
    return forces, solved


def _solved(matrices: Floats, right: Floats) -> Floats:
    """The solutions (k, s) of linear equations; not a number where a matrix is singular."""
    try:
        return np.asarray(np.linalg.solve(matrices, right[:, :, None])[:, :, 0])
    except np.linalg.LinAlgError:
        if right.shape[0] == 1:
            return np.full_like(right, np.nan)
        return np.concatenate([_solved(matrices[at : at + 1], right[at : at + 1]) for at in range(right.shape[0])])


def _noise(fleet: Fleet, stiffness: Floats) -> Floats:
    """The rounding error of the force at the checked points; z0/2 times the stiffness is at least the two pulls."""
    return np.asarray(ROUNDING * np.abs(stiffness).max(axis=1) * fleet.one.magnets.bearing.air_gap_m, dtype=float)

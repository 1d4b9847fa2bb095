"""The scaling D of least σ(D M D⁻¹) among the positive definite ones of a structure, by Newton steps on smooth norms.

Along e^{tX} D, X Hermitian and of the structure, the logarithm of every unitarily invariant norm of D M D⁻¹ is convex
in t, whatever D the line starts from: in the eigenvectors of X the scaling is diagonal, and there the entries are
exponentials. So each step is a damped Newton step in X from the present D, on the logarithm of the Schatten norm of
index 2p, with p rising towards the largest singular value.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Indices = NDArray[np.intp]

_FIRST_P = 4.0
_LONGEST_STEP = 1.0  # in log d
_STATIONARY = 1e-8  # of the gradient; its square is the error in log σ


@dataclass(frozen=True)
class Schedule:
    """How p rises: σ at the minimiser is within log(n)/2p of the least."""

    factor: float
    last: float
    steps: int


SWIFT = Schedule(64.0, 2e9, 90)  # up to three blocks with a number each: it ends within 1e-6
MANY_NUMBERS = Schedule(1.3, 1e6, 400)  # more than three blocks: several singular values coincide at the least
PATIENT = Schedule(2.0, 1e6, 150)  # along the narrow valleys of matrix scalings, where many singular values coincide


def schedule_of_numbers(count: int) -> Schedule:
    """How p rises where each of so many blocks is scaled by a number."""
    return SWIFT if count <= 3 else MANY_NUMBERS


class Motion(Protocol):
    """Scaled matrices on their way, many at once, and the Hermitian directions E_k of their structure.

    The last direction is held: with it the others would contain a common factor of D, which changes nothing.
    """

    def stack(self, rows: Indices) -> Complexes:
        """D M D⁻¹ where these rows are now, (rows, p, m)."""

    def trial(self, rows: Indices, step: Floats) -> Complexes:
        """D M D⁻¹ after steps (rows, k)."""

    def move(self, rows: Indices, step: Floats) -> None:
        """Take these steps."""

    def forms(self, u: Complexes, v: Complexes) -> tuple[Complexes, Complexes, Floats]:
        """Uᴴ E_k U with the directions of the outputs and Vᴴ E_k V with those of the inputs, (w, k, m, m).

        Third is the difference of their diagonals, (w, k, m).
        """

    def squares(self, u: Complexes, weight: Floats) -> Floats:
        """Σ_i weight_i u_iᴴ E_k E_l u_i, its part symmetric in k and l, (w, k, k)."""


@dataclass
class _Smoothed:
    """log of the Schatten norm of index 2p: value (w,), gradient (w, k), Hessian (w, k, k).

    ``top`` is the gradient of the logarithm of the largest singular value, where that is simple.
    """

    value: Floats
    gradient: Floats
    hessian: Floats
    top: Floats

    @classmethod
    def at(cls, motion: Motion, stack: Complexes, p: Floats) -> _Smoothed:
        """Derivatives through the eigenvectors of AᴴA, A = e^X M e^−X, with divided differences of λᵖ⁻¹."""
        size = np.abs(stack).max(axis=(1, 2))
        size = np.where(size > 0, size, 1.0)
        stack = stack / size[:, None, None]  # a matrix whose mu is zero can be scaled until its squares underflow
        eigenvalue, v = np.linalg.eigh(stack.conj().swapaxes(1, 2) @ stack)
        largest = np.maximum(eigenvalue[:, -1], np.finfo(float).tiny)
        lam = np.maximum(eigenvalue / largest[:, None], 1e-30)
        sigma = np.sqrt(lam)
        u = (stack @ v) / (sigma * np.sqrt(largest)[:, None])[:, None, :]
        log_lam, power = np.log(lam), p[:, None]
        weight = np.exp(power * log_lam)
        total = weight.sum(axis=1)
        qq, pp, slope = motion.forms(u, v)
        gradient = (slope * weight[:, None, :]).sum(axis=2) / total[:, None]
        pair = sigma[:, :, None] * sigma[:, None, :]
        first = 2.0 * pair[:, None] * qq - (lam[:, :, None] + lam[:, None, :])[:, None] * pp
        lead = weight / lam  # λᵖ⁻¹
        # each Hessian term is a Gram matrix over the pairs (i, j)
        hessian = _gram(first, first, _divided_difference(log_lam, p))
        both = 2.0 * lead[:, :, None] * (lam[:, :, None] + lam[:, None, :])
        hessian += _gram(pp, pp, both)
        # Σ_j |u_iᴴ h u_j|² = u_iᴴ h² u_i: no need of the u_j of a vanishing singular value
        hessian += 4.0 * motion.squares(u, weight)
        cross = _gram(pp, qq, 4.0 * lead[:, :, None] * pair)
        hessian -= cross + cross.swapaxes(1, 2)
        hessian = hessian / (2.0 * total[:, None, None])
        hessian -= 2.0 * power[:, :, None] * gradient[:, :, None] * gradient[:, None, :]
        value = (np.log(total) / p + np.log(largest)) / 2.0 + np.log(size)
        return cls(value, gradient, hessian, slope[:, :, -1])

    def put(self, rows: NDArray[np.bool_], values: _Smoothed) -> None:
        """Replace these rows by the values."""
        self.value[rows], self.gradient[rows] = values.value, values.gradient
        self.hessian[rows], self.top[rows] = values.hessian, values.top

    def rows(self, rows: NDArray[np.bool_]) -> _Smoothed:
        """Only these rows."""
        return _Smoothed(self.value[rows], self.gradient[rows], self.hessian[rows], self.top[rows])


def _gram(left: Complexes, right: Complexes, weight: Floats) -> Floats:
    w, n = left.shape[:2]
    weighted = (left * weight[:, None]).reshape(w, n, -1)
    return np.asarray((weighted @ right.reshape(w, n, -1).conj().swapaxes(1, 2)).real, dtype=float)


def _divided_difference(log_lam: Floats, p: Floats) -> Floats:
    """(λi^(p−1) − λj^(p−1))/(λi − λj), its limit where the two are equal, without cancellation."""
    high = np.maximum(log_lam[:, :, None], log_lam[:, None, :])
    gap = np.minimum(log_lam[:, :, None], log_lam[:, None, :]) - high
    power = p[:, None, None]
    same = gap > -1e-300
    safe = np.where(same, -1.0, gap)
    ratio = np.where(same, power - 1.0, np.expm1((power - 1.0) * safe) / np.expm1(safe))
    return np.asarray(np.exp((power - 2.0) * high) * ratio, dtype=float)


def descend(motion: Motion, count: int, schedule: Schedule = SWIFT) -> None:
    """Move all rows of a motion to the least largest singular value; only matrices that still move are worked on."""
    rows: Indices = np.arange(count)
    p, damping = np.full(count, _FIRST_P), np.full(count, 1e-6)
    here = _Smoothed.at(motion, motion.stack(rows), p)
    for _ in range(schedule.steps):
        step = _damped_step(here, damping)
        there = _Smoothed.at(motion, motion.trial(rows, step), p)
        better = there.value <= here.value + 1e-13 * np.maximum(1.0, np.abs(here.value))
        decrement = -(here.gradient * step).sum(axis=1)
        motion.move(rows[better], step[better])
        here.put(better, there.rows(better))
        damping = np.where(better, np.maximum(damping / 10.0, 1e-12), np.minimum(damping * 30.0, 1e6))
        # a Schatten norm is followed only until its error in log σ is below what rising p will change anyway
        followed = (decrement * p < 0.3) | (damping > 1e5)
        done = (np.abs(here.top).max(axis=1) < _STATIONARY) | (followed & (p >= schedule.last) & (decrement * p < 1e-4))
        done |= (damping > 1e5) & (p >= schedule.last)
        left = ~done
        if not left.any():
            break
        rise = followed & left
        p[rise] = np.minimum(p[rise] * schedule.factor, schedule.last)
        damping[rise] = 1e-6
        rows, p, damping, rise = rows[left], p[left], damping[left], rise[left]
        here = here.rows(left)
        if rise.any():
            here.put(rise, _Smoothed.at(motion, motion.stack(rows[rise]), p[rise]))


def _damped_step(here: _Smoothed, damping: Floats) -> Floats:
    """The Newton step with the last coordinate held, no longer than allowed."""
    w, n = here.gradient.shape
    reduced = here.hessian[:, :-1, :-1]
    size = np.trace(reduced, axis1=1, axis2=2) + 1e-12
    reduced = reduced + (damping * size)[:, None, None] * np.eye(n - 1)
    step = np.zeros((w, n))
    step[:, :-1] = -np.linalg.solve(reduced, here.gradient[:, :-1, None])[:, :, 0]
    longest = np.abs(step).max(axis=1)
    return np.asarray(step * np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, 1e-300))[:, None], dtype=float)

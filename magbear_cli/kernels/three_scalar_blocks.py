"""The least σ(D M D⁻¹) for three complex scalar blocks, by Newton steps on the largest root of a cubic.

With A = D M D⁻¹, x = log d and e_ij = exp 2(x_i − x_j),

    det(λ I − AᴴA) = λ³ − λ² Σ α_ij e_ij + λ Σ β_ij e_ij − |det M|².

α_ij is |M_ij|², and β_ij the squared modulus of the minor without row j and column i, as a minor of rows R and columns
C is scaled by Π_R d / Π_C d (Horn and Johnson, Matrix Analysis, section 0.8). So the largest eigenvalue λ, its gradient
and its Hessian over x follow from nine exponentials by implicit differentiation: no eigenvector is needed. log λ is
convex in x (``scaling_descent``), and where λ is a simple root its least value is found by damped Newton steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Booleans = NDArray[np.bool_]
Indices = NDArray[np.intp]

_STEPS = 40
_LONGEST_STEP = 1.0  # in log d
_CLOSE = 1e-18  # of log σ: what another step would still gain; D itself is then right to some 1e-9
_ROUNDING = 1e-14  # of log λ
_LEAST_DAMPING = 1e-9  # of the Hessian
_POLISHING = 2  # Newton's steps after the closed form of the root
_LARGEST_POLISH = 1e-6  # of the root; where roots coincide Newton's method may go anywhere
_OPEN = 1e-3  # least product of the relative distances of λ to the other two roots
_OTHERS = ((1, 2), (0, 2), (0, 1))  # the rows or columns that are left without one


def least_log_scaling(stack: Complexes) -> tuple[Floats, Booleans]:
    """Log D of the least largest singular value, for matrices that are balanced already.

    Parameters
    ----------
    stack : (w, 3, 3) array, rows and columns of comparable size

    Returns
    -------
    log_d : (w, 3) array, the last column zero
    found : (w,) array, whether Newton's method came to rest; it does not where two singular values coincide at the
        least, or where the least is not attained
    """
    count = stack.shape[0]
    log_d, found, rows = np.zeros((2, count)), np.zeros(count, dtype=bool), np.arange(count)
    cubic, damping = _Cubic.of(stack), np.full(count, _LEAST_DAMPING)
    with np.errstate(all="ignore"):  # a row that fails is told by ``found``
        here = cubic.at(log_d)
        for _ in range(_STEPS):
            step, gain = here.newton_step(damping)
            done = here.is_simple & (gain < _CLOSE)
            found[rows[done]] = True
            left = np.flatnonzero(~done)
            if left.size == 0:
                break
            if left.size < rows.size:
                rows, cubic, here, damping, step = (
                    rows[left],
                    cubic.rows(left),
                    here.rows(left),
                    damping[left],
                    step[:, left],
                )
            there = cubic.at(log_d[:, rows] + step)
            better = there.log_root <= here.log_root + _ROUNDING
            log_d[:, rows] += np.where(better, step, 0.0)
            here = there.where(better, here)
            damping = np.where(better, np.maximum(damping / 10.0, _LEAST_DAMPING), np.minimum(damping * 10.0, 1e6))
    return np.stack([*log_d, np.zeros(count)], axis=1), found


@dataclass(frozen=True)
class _Cubic:
    """The coefficients of the characteristic polynomial as sums of exponentials; (9, w), (9, w) and (w,)."""

    alpha: Floats
    beta: Floats
    last: Floats

    @classmethod
    def of(cls, stack: Complexes) -> _Cubic:
        m = stack.transpose(1, 2, 0)
        minors = {(i, j): _minor(m, _OTHERS[j], _OTHERS[i]) for i in range(3) for j in range(3)}
        determinant = sum((-1) ** j * m[0, j] * minors[j, 0] for j in range(3))
        beta = np.array([_square(minors[i, j]) for i in range(3) for j in range(3)])
        return cls(_square(m).reshape(9, -1), beta, _square(np.asarray(determinant)))

    def rows(self, rows: Indices) -> _Cubic:
        """Only these matrices."""
        return _Cubic(self.alpha[:, rows], self.beta[:, rows], self.last[rows])

    def at(self, x: Floats) -> _Root:
        """The largest root and its derivatives with log d = (x, 0)."""
        full = np.vstack([x, np.zeros(x.shape[1])])
        scale = np.exp(2.0 * (full[:, None] - full[None, :])).reshape(9, -1)
        alpha, beta = self.alpha * scale, self.beta * scale
        first, second = alpha.sum(axis=0), beta.sum(axis=0)
        root = _largest_root(first, second, self.last)
        # −F = Σ g_ij + … with g = λ² α − λ β, and its derivative along λ
        own, along = root * (root * alpha - beta), 2.0 * root * alpha - beta
        slope = 3.0 * root**2 - along.sum(axis=0)
        curve = 6.0 * root - 2.0 * first
        gradient = 2.0 * _differences(own) / slope
        mixed = -2.0 * _differences(along)
        hessian = np.empty((3, x.shape[1]))  # of the pairs 00, 01, 11
        for at, (i, j) in enumerate(((0, 0), (0, 1), (1, 1))):
            bent = 4.0 * _second_differences(own, i, j) - mixed[i] * gradient[j] - mixed[j] * gradient[i]
            hessian[at] = (bent - curve * gradient[i] * gradient[j]) / slope
        gradient = gradient / root
        hessian = hessian / root - np.stack([gradient[0] ** 2, gradient[0] * gradient[1], gradient[1] ** 2])
        return _Root(np.log(root), gradient, hessian, slope / root**2)


@dataclass(frozen=True)
class _Root:
    """log λ (w,), its gradient (2, w) and Hessian (3, w) over the first two log d, and how far λ stands alone (w,)."""

    log_root: Floats
    gradient: Floats
    hessian: Floats
    openness: Floats

    @property
    def is_simple(self) -> Booleans:
        """Whether λ is far enough from the other roots to be differentiated."""
        return np.asarray(self.openness > _OPEN)

    def newton_step(self, damping: Floats) -> tuple[Floats, Floats]:
        """The damped step (2, w), no longer than allowed, and what the undamped one would gain (w,), in log σ."""
        whole, determinant = self._solved(np.zeros_like(damping))
        gain = np.where(determinant > 0.0, -0.25 * (self.gradient * whole).sum(axis=0), np.inf)
        step, _ = self._solved(damping)
        return step * np.minimum(1.0, _LONGEST_STEP / np.maximum(np.abs(step).max(axis=0), 1e-300)), gain

    def _solved(self, damping: Floats) -> tuple[Floats, Floats]:
        """−H⁻¹ g and det H, with a part of the trace added to the diagonal of H."""
        (g0, g1), (h00, h01, h11) = self.gradient, self.hessian
        added = damping * (np.abs(h00) + np.abs(h11)) + 1e-300
        h00, h11 = h00 + added, h11 + added
        determinant = h00 * h11 - h01 * h01
        return -np.stack([h11 * g0 - h01 * g1, h00 * g1 - h01 * g0]) / determinant, determinant

    def rows(self, rows: Indices) -> _Root:
        """Only these matrices."""
        return _Root(self.log_root[rows], self.gradient[:, rows], self.hessian[:, rows], self.openness[rows])

    def where(self, condition: Booleans, other: _Root) -> _Root:
        """Itself where the condition holds, the other elsewhere."""
        return _Root(
            np.where(condition, self.log_root, other.log_root),
            np.where(condition, self.gradient, other.gradient),
            np.where(condition, self.hessian, other.hessian),
            np.where(condition, self.openness, other.openness),
        )


def _largest_root(first: Floats, second: Floats, last: Floats) -> Floats:
    """The largest root of λ³ − first λ² + second λ − last, which has three real ones and none below zero.

    In λ = first/3 + r cos φ the cubic is cos 3φ = q (Viète); a few of Newton's steps remove the rounding of that.
    """
    centre = first / 3.0
    radius = np.sqrt(np.maximum(centre**2 - second / 3.0, 0.0))
    offset = centre**3 - centre * second / 2.0 + last / 2.0
    cosine = np.clip(offset / np.maximum(radius**3, 1e-300), -1.0, 1.0)
    root = centre + 2.0 * radius * np.cos(np.arccos(cosine) / 3.0)
    for _ in range(_POLISHING):
        value = ((root - first) * root + second) * root - last
        slope = (3.0 * root - 2.0 * first) * root + second
        change = np.where(slope > 0.0, value / np.where(slope > 0.0, slope, 1.0), 0.0)
        root = root - np.clip(change, -_LARGEST_POLISH * root, _LARGEST_POLISH * root)
    return np.asarray(root, dtype=float)


def _minor(m: Complexes, rows: tuple[int, int], columns: tuple[int, int]) -> Complexes:
    (i, k), (j, h) = rows, columns
    return np.asarray(m[i, j] * m[k, h] - m[i, h] * m[k, j])


def _square(values: Complexes) -> Floats:
    return np.asarray(values.real**2 + values.imag**2, dtype=float)


def _differences(terms: Floats) -> Floats:
    """Σ_ij (s_ij)_k terms_ij for k = 0, 1 with s_ij = e_i − e_j, (2, w)."""
    t = terms.reshape(3, 3, -1)
    return np.stack([t[0, 1] + t[0, 2] - t[1, 0] - t[2, 0], t[1, 0] + t[1, 2] - t[0, 1] - t[2, 1]])


def _second_differences(terms: Floats, k: int, h: int) -> Floats:
    """Σ_ij (s_ij)_k (s_ij)_h terms_ij, (w,)."""
    t = terms.reshape(3, 3, -1)
    if k != h:
        return np.asarray(-(t[0, 1] + t[1, 0]))
    others = _OTHERS[k]
    return np.asarray(sum(t[k, j] + t[j, k] for j in others))

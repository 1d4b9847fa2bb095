"""The structured singular value of complex scalar blocks, from above by scalings and from below by perturbations.

For M of shape (n, n) and Δ = diag(δ1 … δn), mu(M) = 1/min{‖Δ‖ : det(I − MΔ) = 0} (Doyle 1982). For every positive
diagonal D and every Δ of unit-modulus entries, ρ(MΔ) ≤ mu(M) ≤ σ(D M D⁻¹); both ends are recomputed here from the Δ
and the D that are returned. For n ≤ 3 the least upper bound is mu itself (Packard and Doyle 1993, section 8).

D is found by ``three_scalar_blocks`` and ``scaling_descent``. Repeated and full blocks are in ``block_singular_value``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.scaling_descent import descend, schedule_of_numbers
from magbear_cli.kernels.three_scalar_blocks import least_log_scaling

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Indices = NDArray[np.intp]
Slices = tuple[slice, ...] | None

_OSBORNE_SWEEPS = 30
_ZERO_ENTRY_LOG = -300.0  # stands for log 0 beside a largest entry of 1: the infimum over D need not be attained
_LARGEST_LOG_D = 300.0
_POWER_STEPS = 60
_CLOSED_GAP = 1e-9


def mu_upper_bound(matrices: Complexes) -> tuple[Floats, Floats]:
    """The least σ(D M D⁻¹) over positive diagonal D, for many matrices at once.

    Parameters
    ----------
    matrices : (w, n, n) array

    Returns
    -------
    upper : (w,) array, recomputed with the D returned
    d : (w, n) array, the diagonals of D, with product one

    Raises
    ------
    NumericsError
        when an entry is not finite.
    """
    problem = _Balanced.of(matrices)
    log_d = _least_log_scaling(problem)
    return problem.scale * _largest_singular_value(problem.scaled(log_d)), np.exp(log_d)


def mu_lower_bound(matrices: Complexes) -> tuple[Floats, Complexes]:
    """The largest spectral radius of M Δ that was found over unit-modulus diagonal Δ, for many matrices at once.

    Δ is turned so that the eigenvalue is real and positive: I − M Δ/lower is singular.

    Parameters
    ----------
    matrices : (w, n, n) array

    Returns
    -------
    lower : (w,) array, recomputed with the Δ returned
    delta : (w, n) array, the diagonals of Δ

    Raises
    ------
    NumericsError
        when an entry is not finite.
    """
    problem = _Balanced.of(matrices)
    lower, delta, _, _ = _bounds(problem)
    return problem.scale * lower, delta


def mu_bounds(matrices: Complexes) -> tuple[Floats, Floats]:
    """Both bounds (upper, lower), each (w,), for the price of one search over D.

    Raises
    ------
    NumericsError
        when an entry is not finite.
    """
    problem = _Balanced.of(matrices)
    lower, _, upper, _ = _bounds(problem)
    return problem.scale * upper, problem.scale * lower


@dataclass(frozen=True)
class _Balanced:
    """Matrices with largest entry one, kept as logarithms of the moduli and phases, so that no scaling overflows."""

    log_modulus: Floats  # (w, n, n), −inf for a zero
    phase: Complexes  # (w, n, n)
    scale: Floats  # (w,)

    @classmethod
    def of(cls, matrices: Complexes) -> _Balanced:
        stack = np.asarray(matrices, dtype=complex)
        if stack.ndim != 3 or stack.shape[1] != stack.shape[2] or stack.shape[1] == 0:
            raise NumericsError(f"the structured singular value needs matrices of shape (w, n, n), not {stack.shape}")
        if not np.isfinite(stack).all():
            raise NumericsError("the structured singular value was asked of a matrix with a number that is not finite")
        parts = np.maximum(np.abs(stack.real), np.abs(stack.imag)).max(axis=(1, 2))
        scale = np.where(parts > 0, parts, 1.0)
        # two divisions: 1/scale overflows for the smallest numbers, and abs() of an unscaled entry for the largest
        unit = stack / scale[:, None, None]
        modulus = np.abs(unit)
        zero = modulus == 0
        log_modulus = np.where(zero, -np.inf, np.log(np.where(zero, 1.0, modulus)))
        return cls(log_modulus, np.where(zero, 0.0, unit / np.where(zero, 1.0, modulus)), scale)

    def rows(self, rows: Indices) -> _Balanced:
        """Only these matrices."""
        return _Balanced(self.log_modulus[rows], self.phase[rows], self.scale[rows])

    def scaled(self, log_d: Floats, rows: Indices | slice = slice(None)) -> Complexes:
        """D M D⁻¹ over scale, for some of the matrices."""
        exponent = self.log_modulus[rows] + log_d[:, :, None] - log_d[:, None, :]
        return np.asarray(np.exp(np.minimum(exponent, 300.0)) * self.phase[rows], dtype=complex)


def _largest_singular_value(stack: Complexes) -> Floats:
    if stack.shape[1] == 1:
        return np.asarray(np.abs(stack[:, 0, 0]), dtype=float)
    return np.asarray(np.linalg.svd(stack, compute_uv=False)[:, 0], dtype=float)


def osborne_log_scaling(log_modulus: Floats) -> Floats:
    """The diagonal that makes row and column norms equal (Osborne 1960), one coordinate at a time."""
    w, n, _ = log_modulus.shape
    power = 2.0 * np.maximum(log_modulus, _ZERO_ENTRY_LOG)
    log_d = np.zeros((w, n))
    for _ in range(_OSBORNE_SWEEPS if n > 2 else 1):
        moved = 0.0
        for k in range(n):
            others = [j for j in range(n) if j != k]
            row = np.logaddexp.reduce(power[:, k, others] - 2.0 * log_d[:, others], axis=1)
            column = np.logaddexp.reduce(power[:, others, k] + 2.0 * log_d[:, others], axis=1)
            new = (column - row) / 4.0
            moved = max(moved, float(np.abs(new - log_d[:, k]).max(initial=0.0)))
            log_d[:, k] = new
        if moved < 1e-3:
            break
    return np.asarray(log_d - log_d.mean(axis=1, keepdims=True), dtype=float)


def _least_log_scaling(problem: _Balanced) -> Floats:
    """Log D of the least largest singular value; exact after Osborne for n ≤ 2, Newton's method for more.

    For n = 2 the determinant does not depend on D, so the largest singular value falls with the Frobenius norm. For
    n = 3 what ``three_scalar_blocks`` leaves over, singular values that coincide, goes the general way.
    """
    n = problem.phase.shape[1]
    if n == 1:
        return np.zeros((problem.phase.shape[0], 1))
    log_d = osborne_log_scaling(problem.log_modulus)
    if n == 2:
        return log_d
    if n == 3:
        further, found = least_log_scaling(problem.scaled(log_d))
        log_d[found] += further[found]
        rest = np.flatnonzero(~found)
        log_d[rest] = _descended(problem.rows(rest), log_d[rest])
    else:
        log_d = _descended(problem, log_d)
    return np.asarray(log_d - log_d.mean(axis=1, keepdims=True), dtype=float)


def _descended(problem: _Balanced, log_d: Floats) -> Floats:
    """Log D of the least largest singular value by the general descent, from a balanced start."""
    motion = _DiagonalMotion(problem, log_d)
    if log_d.shape[0]:
        descend(motion, log_d.shape[0], schedule_of_numbers(log_d.shape[1]))
    return motion.log_d


@dataclass
class _DiagonalMotion:
    """Positive diagonal scalings on their way to the least σ(D M D⁻¹); they commute, so that logarithms add up."""

    problem: _Balanced
    log_d: Floats

    def stack(self, rows: Indices) -> Complexes:
        """D M D⁻¹ where these rows are now."""
        return self.problem.scaled(self.log_d[rows], rows)

    def trial(self, rows: Indices, step: Floats) -> Complexes:
        """D M D⁻¹ after a step."""
        return self.problem.scaled(self._after(rows, step), rows)

    def move(self, rows: Indices, step: Floats) -> None:
        """Take a step."""
        self.log_d[rows] = self._after(rows, step)

    def forms(self, u: Complexes, v: Complexes) -> tuple[Complexes, Complexes, Floats]:
        """The matrices Uᴴ E_k U and Vᴴ E_k V of each direction, (w, n, n, n), and their diagonals' difference."""
        qq, pp = u.conj()[:, :, :, None] * u[:, :, None, :], v.conj()[:, :, :, None] * v[:, :, None, :]
        return qq, pp, np.asarray(np.abs(u) ** 2 - np.abs(v) ** 2)

    def squares(self, u: Complexes, weight: Floats) -> Floats:
        """Σ_i weight_i u_iᴴ E_k E_l u_i, (w, k, l)."""
        diagonal = (np.abs(u) ** 2 * weight[:, None, :]).sum(axis=2)
        return np.asarray(diagonal[:, :, None] * np.eye(u.shape[1]))

    def _after(self, rows: Indices, step: Floats) -> Floats:
        return np.clip(self.log_d[rows] + step, -_LARGEST_LOG_D, _LARGEST_LOG_D)


def _bounds(problem: _Balanced) -> tuple[Floats, Complexes, Floats, Floats]:
    """Lower bound, its Δ, upper bound, its log D, all beside matrices of largest entry one."""
    log_d = _least_log_scaling(problem)
    stack = problem.scaled(log_d)
    n = stack.shape[1]
    if n == 1:
        modulus = np.abs(stack[:, 0, 0])
        return modulus, problem.phase[:, 0].conj() + (modulus == 0)[:, None], modulus, log_d
    left, sigma, right = np.linalg.svd(stack)
    u, v = left, right.conj().swapaxes(1, 2)
    upper = sigma[:, 0]
    lower, delta = _turned(stack, _phases(u[:, :, 0], v[:, :, 0]))
    pairs = np.flatnonzero(lower < upper * (1.0 - _CLOSED_GAP))
    for sign in (1.0, -1.0):
        if pairs.size:
            _keep_better(stack, pairs, _phases(*balanced_combination(u[pairs], v[pairs], sign)), lower, delta)
            pairs = pairs[lower[pairs] < upper[pairs] * (1.0 - _CLOSED_GAP)]
    if pairs.size:
        for start in _starts(delta[pairs]):
            _keep_better(stack, pairs, _power_iteration(stack[pairs], start), lower, delta)
    return lower, delta, upper, log_d


def _keep_better(stack: Complexes, rows: Indices, trial: Complexes, lower: Floats, delta: Complexes) -> None:
    value, turned = _turned(stack[rows], trial)
    better = value > lower[rows]
    lower[rows[better]], delta[rows[better]] = value[better], turned[better]


def _turned(stack: Complexes, delta: Complexes) -> tuple[Floats, Complexes]:
    """Spectral radius of M Δ, and Δ turned so that the eigenvalue of that modulus is real and positive."""
    eigenvalues = np.linalg.eigvals(stack * delta[:, None, :])
    widest = np.abs(eigenvalues).argmax(axis=1)
    largest: Complexes = eigenvalues[np.arange(widest.size), widest].astype(complex)[:, None]
    return np.abs(largest[:, 0]), delta * unit_phase(largest).conj()


def unit_phase(values: Complexes) -> Complexes:
    """The numbers over their moduli; one for zero."""
    modulus = np.abs(values)
    return np.asarray(np.where(modulus > 0, values / np.where(modulus > 0, modulus, 1.0), 1.0 + 0j), dtype=complex)


def _phases(u: Complexes, v: Complexes) -> Complexes:
    """The Δ with Δ u = v, where the moduli of u and v agree."""
    return unit_phase(np.multiply(v, np.conj(u)))


def balanced_combination(
    u: Complexes, v: Complexes, sign: float, rows: Slices = None, columns: Slices = None
) -> tuple[Complexes, Complexes]:
    """U η and V η of equal norms in every block, η a combination of the first two singular pairs.

    With η on the Bloch sphere, ‖(U η)_k‖² = ‖(V η)_k‖² is a plane for every k; for three blocks the planes meet in a
    line, and the least D puts that line through the sphere (so that mu is reached even where two singular values
    coincide). ``rows`` and ``columns`` are the blocks' places in u and v; by default every channel is a block.
    """
    of_outputs, of_inputs = _energies(u, rows), _energies(v, columns)
    first, second, mixed = (mine - other for mine, other in zip(of_outputs, of_inputs, strict=True))
    planes = np.stack([mixed.real, -mixed.imag, (first - second) / 2.0], axis=2)
    left, size, right = np.linalg.svd(planes)
    weight = np.where(size[:, :2] > 1e-12 * (size[:, :1] + 1e-300), 1.0 / np.maximum(size[:, :2], 1e-300), 0.0)
    target = -(first + second) / 2.0
    inner = np.einsum("wki,wk->wi", left[:, :, :2], target) * weight
    point = np.einsum("wi,wij->wj", inner, right[:, :2])
    room = np.sqrt(np.maximum(0.0, 1.0 - (point**2).sum(axis=1)))
    point = point + sign * room[:, None] * right[:, 2]
    point /= np.maximum(np.linalg.norm(point, axis=1, keepdims=True), 1e-300)
    polar = np.arccos(np.clip(point[:, 2], -1.0, 1.0)) / 2.0
    eta = np.stack([np.cos(polar) + 0j, np.sin(polar) * np.exp(1j * np.arctan2(point[:, 1], point[:, 0]))], axis=1)
    return np.einsum("wki,wi->wk", u[:, :, :2], eta), np.einsum("wki,wi->wk", v[:, :, :2], eta)


def _energies(x: Complexes, blocks: Slices) -> tuple[Floats, Floats, Complexes]:
    """The squared norms of the first two columns in every block, and their inner product there."""
    parts = np.abs(x[:, :, 0]) ** 2, np.abs(x[:, :, 1]) ** 2, x[:, :, 0].conj() * x[:, :, 1]
    if blocks is None:
        return parts
    first, second, mixed = (np.stack([part[:, k].sum(axis=1) for k in blocks], axis=1) for part in parts)
    return first.real, second.real, mixed


def _starts(best: Complexes) -> list[Complexes]:
    """The best Δ so far, and fixed others: phases by the golden angle, which never repeat."""
    n = best.shape[1]
    turns = np.pi * (3.0 - np.sqrt(5.0)) * np.outer(np.arange(6), np.arange(n) ** 2)
    return [best, *(np.broadcast_to(np.exp(1j * turn), best.shape) for turn in turns)]


def _power_iteration(stack: Complexes, start: Complexes) -> Complexes:
    """Phases that the power iteration of Packard, Fan and Doyle (1988) goes to; it need not converge."""
    adjoint = stack.conj().swapaxes(1, 2)
    delta, b, modulus = start, start, np.ones(start.shape)
    for _ in range(_POWER_STEPS):
        a = normalised((stack @ b[:, :, None])[:, :, 0])
        w = normalised((adjoint @ (unit_phase(a) * modulus)[:, :, None])[:, :, 0])
        delta, modulus = _phases(a, w), np.abs(w)
        b = delta * a
    return delta


def normalised(vectors: Complexes) -> Complexes:
    """The rows (w, n) at length one; zero stays zero."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300), dtype=complex)

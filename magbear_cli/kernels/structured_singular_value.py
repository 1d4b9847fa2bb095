"""The structured singular value of complex scalar blocks, from above by scalings and from below by perturbations.

For M of shape (n, n) and Δ = diag(δ1 … δn), mu(M) = 1/min{‖Δ‖ : det(I − MΔ) = 0} (Doyle 1982). For every positive
diagonal D and every Δ of unit-modulus entries, ρ(MΔ) ≤ mu(M) ≤ σ(D M D⁻¹); both ends are recomputed here from the Δ
and the D that are returned. For n ≤ 3 the least upper bound is mu itself (Packard and Doyle 1993, section 8).

The logarithm of every unitarily invariant norm of e^X M e^−X is convex in the diagonal X, so X is found by damped
Newton steps on log ‖e^X M e^−X‖ in the Schatten norms of index 2p, p rising towards the largest singular value.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Indices = NDArray[np.intp]

_OSBORNE_SWEEPS = 30
_ZERO_ENTRY_LOG = -300.0  # stands for log 0 beside a largest entry of 1: the infimum over D need not be attained
_FIRST_P, _P_FACTOR, _LAST_P = 4.0, 64.0, 2e9  # σ at the minimiser is within log(n)/2p of the least
_NEWTON_STEPS = 90
_LONGEST_STEP = 1.0  # in log d
_LARGEST_LOG_D = 300.0
_STATIONARY = 1e-8  # of the gradient; its square is the error in log σ
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

    def scaled(self, log_d: Floats, rows: Indices | slice = slice(None)) -> Complexes:
        """D M D⁻¹ over scale, for some of the matrices."""
        exponent = self.log_modulus[rows] + log_d[:, :, None] - log_d[:, None, :]
        return np.asarray(np.exp(np.minimum(exponent, 300.0)) * self.phase[rows], dtype=complex)


def _largest_singular_value(stack: Complexes) -> Floats:
    if stack.shape[1] == 1:
        return np.asarray(np.abs(stack[:, 0, 0]), dtype=float)
    return np.asarray(np.linalg.svd(stack, compute_uv=False)[:, 0], dtype=float)


def _osborne_log_scaling(problem: _Balanced) -> Floats:
    """The diagonal that makes row and column norms equal (Osborne 1960), one coordinate at a time."""
    w, n, _ = problem.log_modulus.shape
    power = 2.0 * np.maximum(problem.log_modulus, _ZERO_ENTRY_LOG)
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
    """Log D of the least largest singular value; exact after Osborne for n ≤ 2, Newton for more.

    For n = 2 the determinant does not depend on D, so the largest singular value falls with the Frobenius norm.
    """
    n = problem.phase.shape[1]
    if n == 1:
        return np.zeros((problem.phase.shape[0], 1))
    log_d = _osborne_log_scaling(problem)
    return log_d if n == 2 else _newton(problem, log_d)


@dataclass
class _Smoothed:
    """log of the Schatten norm of index 2p at points X: value (w,), gradient (w, n), Hessian (w, n, n).

    ``top`` is the gradient of the logarithm of the largest singular value, where that is simple.
    """

    value: Floats
    gradient: Floats
    hessian: Floats
    top: Floats

    @classmethod
    def at(cls, stack: Complexes, p: Floats) -> _Smoothed:
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
        slope = np.abs(u) ** 2 - np.abs(v) ** 2  # d log σ_i / d x_k, (w, k, i)
        gradient = (slope * weight[:, None, :]).sum(axis=2) / total[:, None]
        pp, qq = v.conj()[:, :, :, None] * v[:, :, None, :], u.conj()[:, :, :, None] * u[:, :, None, :]
        pair = sigma[:, :, None] * sigma[:, None, :]
        first = 2.0 * pair[:, None] * qq - (lam[:, :, None] + lam[:, None, :])[:, None] * pp
        difference = _divided_difference(log_lam, p)
        n = lam.shape[1]
        lead = weight / lam  # λᵖ⁻¹
        # each Hessian term is a Gram matrix over the pairs (i, j)
        hessian = _gram(first, first, difference)
        both = 2.0 * lead[:, :, None] * (lam[:, :, None] + lam[:, None, :])
        hessian += _gram(pp, pp, both)
        # Σ_j |u_iᴴ h u_j|² = u_iᴴ h² u_i: no need of the u_j of a vanishing singular value
        diagonal = 4.0 * (np.abs(u) ** 2 * weight[:, None, :]).sum(axis=2)
        hessian[:, range(n), range(n)] += diagonal
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


def _newton(problem: _Balanced, log_d: Floats) -> Floats:
    """Damped Newton steps on the Schatten norms of rising index; only matrices that still move are worked on."""
    answer = log_d.copy()
    rows: Indices = np.arange(log_d.shape[0])
    x, p = log_d.copy(), np.full(rows.size, _FIRST_P)
    damping = np.full(rows.size, 1e-6)
    here = _Smoothed.at(problem.scaled(x, rows), p)
    for _ in range(_NEWTON_STEPS):
        step = _damped_step(here, damping)
        trial = np.clip(x + step, -_LARGEST_LOG_D, _LARGEST_LOG_D)
        there = _Smoothed.at(problem.scaled(trial, rows), p)
        better = there.value <= here.value + 1e-13 * np.maximum(1.0, np.abs(here.value))
        decrement = -(here.gradient * step).sum(axis=1)
        x[better] = trial[better]
        here.put(better, there.rows(better))
        damping = np.where(better, np.maximum(damping / 10.0, 1e-12), np.minimum(damping * 30.0, 1e6))
        # a Schatten norm is followed only until its error in log σ is below what rising p will change anyway
        followed = (decrement * p < 0.3) | (damping > 1e5)
        done = (np.abs(here.top).max(axis=1) < _STATIONARY) | (followed & (p >= _LAST_P) & (decrement * p < 1e-4))
        done |= (damping > 1e5) & (p >= _LAST_P)
        answer[rows] = x
        left = ~done
        if not left.any():
            break
        rise = followed & left
        p[rise] = np.minimum(p[rise] * _P_FACTOR, _LAST_P)
        damping[rise] = 1e-6
        rows, x, p, damping, rise = rows[left], x[left], p[left], damping[left], rise[left]
        here = here.rows(left)
        if rise.any():
            here.put(rise, _Smoothed.at(problem.scaled(x[rise], rows[rise]), p[rise]))
    return np.asarray(answer - answer.mean(axis=1, keepdims=True), dtype=float)


def _damped_step(here: _Smoothed, damping: Floats) -> Floats:
    """The Newton step with the last coordinate held (a common factor of D changes nothing), no longer than allowed."""
    w, n = here.gradient.shape
    reduced = here.hessian[:, :-1, :-1]
    size = np.trace(reduced, axis1=1, axis2=2) + 1e-12
    reduced = reduced + (damping * size)[:, None, None] * np.eye(n - 1)
    step = np.zeros((w, n))
    step[:, :-1] = -np.linalg.solve(reduced, here.gradient[:, :-1, None])[:, :, 0]
    longest = np.abs(step).max(axis=1)
    return np.asarray(step * np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, 1e-300))[:, None], dtype=float)


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
            _keep_better(stack, pairs, _phases(*_balanced_combination(u[pairs], v[pairs], sign)), lower, delta)
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
    return np.abs(largest[:, 0]), delta * _unit(largest).conj()


def _unit(values: Complexes) -> Complexes:
    modulus = np.abs(values)
    return np.asarray(np.where(modulus > 0, values / np.where(modulus > 0, modulus, 1.0), 1.0 + 0j), dtype=complex)


def _phases(u: Complexes, v: Complexes) -> Complexes:
    """The Δ with Δ u = v, where the moduli of u and v agree."""
    return _unit(np.multiply(v, np.conj(u)))


def _balanced_combination(u: Complexes, v: Complexes, sign: float) -> tuple[Complexes, Complexes]:
    """U η and V η of equal moduli, η a combination of the first two singular pairs.

    With η on the Bloch sphere, |(U η)_k|² = |(V η)_k|² is a plane for every k; for n = 3 the planes meet in a line,
    and the least D puts that line through the sphere (so that mu is reached even where two singular values coincide).
    """
    first = np.abs(u[:, :, 0]) ** 2 - np.abs(v[:, :, 0]) ** 2
    second = np.abs(u[:, :, 1]) ** 2 - np.abs(v[:, :, 1]) ** 2
    mixed = u[:, :, 0].conj() * u[:, :, 1] - v[:, :, 0].conj() * v[:, :, 1]
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
        a = _normalised((stack @ b[:, :, None])[:, :, 0])
        w = _normalised((adjoint @ (_unit(a) * modulus)[:, :, None])[:, :, 0])
        delta, modulus = _phases(a, w), np.abs(w)
        b = delta * a
    return delta


def _normalised(vectors: Complexes) -> Complexes:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300), dtype=complex)

"""The structured singular value from below for repeated and full complex blocks: a perturbation and what it does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.kernels.block_scaling import BlockBound, block_upper_bound, require_fitting
from magbear_cli.kernels.block_structure import BlockStructure
from magbear_cli.kernels.structured_singular_value import balanced_combination, mu_lower_bound, normalised, unit_phase

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Indices = NDArray[np.intp]

_POWER_STEPS = 60
_STARTS = 6
_CLOSED_GAP = 1e-9
_TINY = 1e-300


def block_lower_bound(
    matrices: Complexes, structure: BlockStructure, bound: BlockBound | None = None
) -> tuple[Floats, Complexes]:
    """The largest spectral radius of M Δ that was found over the Δ of a structure, for many matrices at once.

    Δ is turned so that the eigenvalue is real and positive: I − M Δ/lower is singular.

    Parameters
    ----------
    matrices : (w, p, m) array, p and m those of the structure
    bound : what ``block_upper_bound`` gave for them, when it is known

    Returns
    -------
    lower : (w,) array, recomputed from the Δ returned
    delta : (w, m, p) array, every block of norm one

    Raises
    ------
    NumericsError
        when the shape is not that of the structure or an entry is not finite.

    Notes
    -----
    The power iteration of Packard, Fan and Doyle (1988) on D M D⁻¹, whose first singular vectors are its fixed point
    wherever mu is the upper bound and the largest singular value is simple. It need not converge, and need not matter.
    """
    stack = require_fitting(matrices, structure)
    if structure.is_scalar:
        lower, phases = mu_lower_bound(stack)
        return lower, np.asarray(phases[:, :, None] * np.eye(phases.shape[1]), dtype=complex)
    bound = bound or block_upper_bound(stack, structure)
    size = np.where(bound.upper > 0, bound.upper, 1.0)
    scaled = bound.left @ (stack / size[:, None, None]) @ np.linalg.inv(bound.right)
    search = _Search(scaled, structure, *_turned(scaled, _identity(scaled, structure)))
    left, sigma, right = np.linalg.svd(scaled)
    u, v = left, right.conj().swapaxes(1, 2)
    search.try_pair(np.arange(size.size), u[:, :, 0], v[:, :, 0])
    if len(structure.blocks) > 1:
        for sign in (1.0, -1.0):
            rows = search.open_rows(sigma[:, 0])
            search.try_pair(rows, *balanced_combination(u[rows], v[rows], sign, structure.rows, structure.columns))
    for number in range(_STARTS):
        rows = search.open_rows(sigma[:, 0])
        if not rows.size:
            break
        search.try_power_iteration(rows, _start(number, v[rows]))
    return size * search.lower, search.delta


@dataclass(eq=False)
class _Search:
    """The best perturbation so far of each scaled matrix."""

    stack: Complexes
    structure: BlockStructure
    lower: Floats
    delta: Complexes

    def open_rows(self, upper: Floats) -> Indices:
        """The matrices whose bounds have not met."""
        return np.flatnonzero(self.lower < upper * (1.0 - _CLOSED_GAP))

    def try_pair(self, rows: Indices, a: Complexes, w: Complexes) -> None:
        """The Δ that takes the outputs a to the inputs w, block by block as far as it can."""
        delta = np.zeros((rows.size, self.structure.inputs, self.structure.outputs), dtype=complex)
        blocks = zip(self.structure.blocks, self.structure.rows, self.structure.columns, strict=True)
        for block, row, column in blocks:
            if self.structure.is_matrix(block):
                turn = unit_phase((a[:, row].conj() * w[:, column]).sum(axis=1))
                delta[:, column, row] = turn[:, None, None] * np.eye(block.outputs)
            else:
                delta[:, column, row] = _direction(w[:, column])[:, :, None] * _direction(a[:, row]).conj()[:, None, :]
        value, turned = _turned(self.stack[rows], delta)
        better = value > self.lower[rows]
        self.lower[rows[better]], self.delta[rows[better]] = value[better], turned[better]

    def try_power_iteration(self, rows: Indices, b: Complexes) -> None:
        """Where the power iteration goes from the inputs b."""
        stack = self.stack[rows]
        adjoint = stack.conj().swapaxes(1, 2)
        w = b
        for _ in range(_POWER_STEPS):
            a = normalised((stack @ b[:, :, None])[:, :, 0])
            z = self._carried(a, w, a_is_output=True)
            w = normalised((adjoint @ z[:, :, None])[:, :, 0])
            b = self._carried(w, a, a_is_output=False)
        self.try_pair(rows, a, w)

    def _carried(self, a: Complexes, w: Complexes, *, a_is_output: bool) -> Complexes:
        """Δᴴ w at the outputs (or Δ a at the inputs) for the Δ that takes a to w, with the moduli of w (or of a)."""
        carried = np.empty_like(a)
        blocks = zip(self.structure.blocks, self.structure.rows, self.structure.columns, strict=True)
        for block, row, column in blocks:
            mine, other = (row, column) if a_is_output else (column, row)
            if self.structure.is_matrix(block):
                carried[:, mine] = unit_phase((w[:, other].conj() * a[:, mine]).sum(axis=1))[:, None] * w[:, other]
            else:
                length = np.linalg.norm(w[:, other], axis=1)
                carried[:, mine] = length[:, None] * _direction(a[:, mine])
        return carried


def _identity(stack: Complexes, structure: BlockStructure) -> Complexes:
    delta = np.zeros((stack.shape[0], structure.inputs, structure.outputs), dtype=complex)
    for row, column in zip(structure.rows, structure.columns, strict=True):
        delta[:, column, row] = np.eye(column.stop - column.start, row.stop - row.start)
    return delta


def _start(number: int, v: Complexes) -> Complexes:
    """The first right singular vectors of D M D⁻¹, then fixed others: phases by the golden angle never repeat."""
    if number < min(2, v.shape[2]):
        return np.asarray(v[:, :, number])
    turns = np.pi * (3.0 - np.sqrt(5.0)) * number * np.arange(1, v.shape[1] + 1) ** 2
    return normalised(np.broadcast_to(np.exp(1j * turns), v.shape[:2]))


def _turned(stack: Complexes, delta: Complexes) -> tuple[Floats, Complexes]:
    """Spectral radius of M Δ, and Δ turned so that the eigenvalue of that modulus is real and positive."""
    eigenvalues = np.linalg.eigvals(stack @ delta).astype(complex)
    largest = eigenvalues[np.arange(eigenvalues.shape[0]), np.abs(eigenvalues).argmax(axis=1)]
    return np.abs(largest), delta * unit_phase(largest).conj()[:, None, None]


def _direction(vectors: Complexes) -> Complexes:
    """The vectors with length one; the first unit vector for zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    first = np.eye(1, vectors.shape[1], dtype=complex)
    return np.asarray(np.where(length > _TINY, vectors / np.maximum(length, _TINY), first), dtype=complex)

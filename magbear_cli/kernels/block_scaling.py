"""The structured singular value from above for repeated and full complex blocks: the least σ(D M D⁻¹)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.block_structure import BlockStructure
from magbear_cli.kernels.scaling_descent import PATIENT, descend, schedule_of_numbers
from magbear_cli.kernels.structured_singular_value import mu_upper_bound, osborne_log_scaling

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Indices = NDArray[np.intp]

_LARGEST_LOG = 300.0  # of an entry: beyond it nothing but zeros of M is scaled
_WIDEST_LOG = 6.0  # of a scale beside the mean of its repeated block, before the first step
_LEAST_FACTOR = 1e-150  # of a scaling whose infimum is not attained


@dataclass(frozen=True, eq=False)
class BlockBound:
    """An upper bound of mu at each of w matrices, and the scalings that prove it.

    Parameters
    ----------
    upper : (w,) array, the largest singular values of left·M·right⁻¹, recomputed with these very matrices
    left, right : (w, p, p) and (w, m, m) arrays, Hermitian positive definite and of the structure (right·Δ = Δ·left for
        every Δ), the geometric mean of the blocks' scales one
    """

    upper: Floats
    left: Complexes
    right: Complexes


def block_upper_bound(matrices: Complexes, structure: BlockStructure) -> BlockBound:
    """The least σ(D M D⁻¹) over the positive definite scalings of a structure, for many matrices at once.

    Parameters
    ----------
    matrices : (w, p, m) array, p and m those of the structure

    Raises
    ------
    NumericsError
        when the shape is not that of the structure or an entry is not finite.

    Notes
    -----
    Doyle 1982; Packard and Doyle 1993. After Osborne's balancing of the norms of the blocks, ``scaling_descent`` takes
    steps D → e^X D, which are geodesics of the positive definite matrices: no semidefinite program is solved.
    """
    stack = require_fitting(matrices, structure)
    if structure.is_scalar:
        upper, d = mu_upper_bound(stack)
        scaling = np.asarray(d[:, :, None] * np.eye(d.shape[1]), dtype=complex)
        return BlockBound(upper, scaling, scaling)
    parts = np.maximum(np.abs(stack.real), np.abs(stack.imag)).max(axis=(1, 2))
    size: Floats = np.asarray(np.where(parts > 0, parts, 1.0), dtype=float)
    unit = stack / size[:, None, None]
    motion = _BlockMotion.balanced(unit, structure)
    if len(motion.left_directions) > 1:
        schedule = PATIENT if structure.has_matrix else schedule_of_numbers(len(structure.blocks))
        descend(motion, unit.shape[0], schedule)
    left, _ = motion.factors(structure.rows, motion.log_rows)
    right, right_inverse = motion.factors(structure.columns, motion.log_columns)
    upper = np.asarray(np.linalg.svd(left @ unit @ right_inverse, compute_uv=False)[:, 0], dtype=float)
    common = _common_factor(left, structure)
    return BlockBound(size * upper, left / common, right / common)


def require_fitting(matrices: Complexes, structure: BlockStructure) -> Complexes:
    """The matrices as complex numbers, refused where they do not fit the structure or are not finite."""
    stack = np.asarray(matrices, dtype=complex)
    if stack.ndim != 3 or stack.shape[1:] != (structure.outputs, structure.inputs):
        wanted = f"(w, {structure.outputs}, {structure.inputs})"
        raise NumericsError(f"the block structure needs matrices of shape {wanted}, not {stack.shape}")
    if not np.isfinite(stack).all():
        raise NumericsError("the structured singular value was asked of a matrix with a number that is not finite")
    return stack


@dataclass(eq=False)
class _BlockMotion:
    """Scalings of a structure on their way: D = T·exp(log), T moved by products of exponentials of Hermitian matrices.

    ``left`` is T for the outputs, ``right`` its inverse for the inputs.
    """

    structure: BlockStructure
    base: Complexes  # (w, p, m), balanced
    log_rows: Floats  # (w, p), Osborne's
    log_columns: Floats  # (w, m)
    left: Complexes
    right: Complexes
    left_directions: Complexes  # (k, p, p)
    right_directions: Complexes  # (k, m, m)

    @classmethod
    def balanced(cls, unit: Complexes, structure: BlockStructure) -> _BlockMotion:
        """The start: Osborne's balancing of the blocks' norms, each channel of a repeated block on its own."""
        rows, columns = _channels(structure)
        energy = np.stack(
            [np.stack([(np.abs(unit[:, r, c]) ** 2).sum(axis=(1, 2)) for c in columns], axis=1) for r in rows], axis=1
        )
        log_modulus = np.where(energy > 0, 0.5 * np.log(np.where(energy > 0, energy, 1.0)), -np.inf)
        log_d = osborne_log_scaling(log_modulus) if len(rows) > 1 else np.zeros(energy.shape[:2])
        _narrow(log_d, structure)
        log_rows = np.repeat(log_d, [r.stop - r.start for r in rows], axis=1)
        log_columns = np.repeat(log_d, [c.stop - c.start for c in columns], axis=1)
        exponent = np.clip(log_rows[:, :, None] - log_columns[:, None, :], -_LARGEST_LOG, _LARGEST_LOG)
        left, right = _directions(structure)
        w, p, m = unit.shape
        ones, other_ones = (np.repeat(np.eye(n, dtype=complex)[None], w, axis=0) for n in (p, m))
        return cls(structure, np.exp(exponent) * unit, log_rows, log_columns, ones, other_ones, left, right)

    def stack(self, rows: Indices) -> Complexes:
        """D M D⁻¹ where these rows are now."""
        return np.asarray(self.left[rows] @ self.base[rows] @ self.right[rows])

    def trial(self, rows: Indices, step: Floats) -> Complexes:
        """D M D⁻¹ after a step."""
        left, right = self._after(rows, step)
        return np.asarray(left @ self.base[rows] @ right)

    def move(self, rows: Indices, step: Floats) -> None:
        """Take a step."""
        if rows.size:
            self.left[rows], self.right[rows] = self._after(rows, step)

    def forms(self, u: Complexes, v: Complexes) -> tuple[Complexes, Complexes, Floats]:
        """Uᴴ E_k U and Vᴴ E_k V, (w, k, m, m), and the difference of their diagonals."""
        qq, pp = _forms(self.left_directions, u), _forms(self.right_directions, v)
        slopes = np.diagonal(qq, axis1=2, axis2=3).real - np.diagonal(pp, axis1=2, axis2=3).real
        return qq, pp, np.asarray(slopes, dtype=float)

    def squares(self, u: Complexes, weight: Floats) -> Floats:
        """Σ_i weight_i Re (E_k u_i)ᴴ(E_l u_i), (w, k, k)."""
        moved = self.left_directions @ u[:, None]
        w, k = moved.shape[:2]
        weighted = (moved * weight[:, None, None, :]).reshape(w, k, -1)
        return np.asarray((weighted @ moved.reshape(w, k, -1).conj().swapaxes(1, 2)).real, dtype=float)

    def factors(self, places: tuple[slice, ...], logs: Floats) -> tuple[Complexes, Complexes]:
        """The Hermitian D with DᴴD = exp(log)·TᴴT·exp(log), and its inverse; ``places`` are of outputs or of inputs."""
        scaling = np.zeros((logs.shape[0], logs.shape[1], logs.shape[1]), dtype=complex)
        inverse = scaling.copy()
        for block, place, row in zip(self.structure.blocks, places, self.structure.rows, strict=True):
            if self.structure.is_matrix(block):
                _, size, turn = np.linalg.svd(self.left[:, row, row] * np.exp(logs[:, None, place]))
                back = turn.conj().swapaxes(1, 2)
                scaling[:, place, place] = back @ (size[:, :, None] * turn)
                inverse[:, place, place] = back @ (turn / np.maximum(size, _LEAST_FACTOR)[:, :, None])
            else:
                d = self.left[:, row.start, row.start].real * np.exp(logs[:, place.start])
                scaling[:, place, place] = d[:, None, None] * np.eye(place.stop - place.start)
                inverse[:, place, place] = np.eye(place.stop - place.start) / d[:, None, None]
        return scaling, inverse

    def _after(self, rows: Indices, step: Floats) -> tuple[Complexes, Complexes]:
        left, right = self.left[rows], self.right[rows]
        for block, row, column in zip(self.structure.blocks, self.structure.rows, self.structure.columns, strict=True):
            start = row.start
            if self.structure.is_matrix(block):
                hermitian = np.einsum("wk,kab->wab", step, self.left_directions[:, row, row])
                value, vector = np.linalg.eigh(hermitian)
                back = vector.conj().swapaxes(1, 2)
                left[:, row] = (vector * np.exp(value)[:, None, :]) @ back @ left[:, row]
                right[:, :, column] = right[:, :, column] @ (vector * np.exp(-value)[:, None, :]) @ back
            else:
                x = (step @ self.left_directions[:, start, start].real)[:, None, None]
                left[:, row], right[:, :, column] = np.exp(x) * left[:, row], np.exp(-x) * right[:, :, column]
        return left, right


def _common_factor(left: Complexes, structure: BlockStructure) -> Floats:
    """The geometric mean of the blocks' scales, that of a matrix being the mean of its eigenvalues, (w, 1, 1)."""
    logs = [np.linalg.slogdet(left[:, row, row])[1] / (row.stop - row.start) for row in structure.rows]
    return np.asarray(np.exp(np.mean(logs, axis=0))[:, None, None], dtype=float)


def _forms(directions: Complexes, vectors: Complexes) -> Complexes:
    return np.asarray(vectors.conj().swapaxes(1, 2)[:, None] @ (directions @ vectors[:, None]))


def _narrow(log_d: Floats, structure: BlockStructure) -> None:
    """Keep the scales of each repeated block within what a matrix can hold; one row a channel, as in ``_channels``."""
    start = 0
    for block in structure.blocks:
        count = block.outputs if structure.is_matrix(block) else 1
        mine = log_d[:, start : start + count]
        middle = mine.mean(axis=1, keepdims=True)
        log_d[:, start : start + count] = middle + np.clip(mine - middle, -_WIDEST_LOG, _WIDEST_LOG)
        start += count


def _channels(structure: BlockStructure) -> tuple[list[slice], list[slice]]:
    """What can be scaled by a number of its own: full blocks, and the channels of repeated ones."""
    rows: list[slice] = []
    columns: list[slice] = []
    for block, row, column in zip(structure.blocks, structure.rows, structure.columns, strict=True):
        matrix = structure.is_matrix(block)
        rows += [slice(k, k + 1) for k in range(row.start, row.stop)] if matrix else [row]
        columns += [slice(k, k + 1) for k in range(column.start, column.stop)] if matrix else [column]
    return rows, columns


def _directions(structure: BlockStructure) -> tuple[Complexes, Complexes]:
    """A basis of the Hermitian matrices of the structure, for outputs and inputs, a diagonal one the last."""
    left, right = [], []
    for block, row, column in zip(structure.blocks, structure.rows, structure.columns, strict=True):
        for mine in _hermitian_basis(block.outputs) if structure.is_matrix(block) else [None]:
            of_outputs = np.zeros((structure.outputs,) * 2, dtype=complex)
            of_inputs = np.zeros((structure.inputs,) * 2, dtype=complex)
            of_outputs[row, row] = np.eye(block.outputs) if mine is None else mine
            of_inputs[column, column] = np.eye(block.inputs) if mine is None else mine
            left.append(of_outputs)
            right.append(of_inputs)
    return np.stack(left), np.stack(right)


def _hermitian_basis(size: int) -> list[Complexes]:
    basis = []
    for i, j in combinations(range(size), 2):
        for entry in (1.0 + 0j, 1j):
            matrix = np.zeros((size, size), dtype=complex)
            matrix[i, j], matrix[j, i] = entry, np.conj(entry)
            basis.append(matrix)
    return [*basis, *(np.diag(row).astype(complex) for row in np.eye(size))]

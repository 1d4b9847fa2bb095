"""A system as a sum of first-order terms, its frequency response from them, and how far that can be trusted.

With A V = V Λ, C (s I − A)⁻¹ B = Σ_k (C v_k)(x_kᵀ B)/(s − λ_k), x_kᵀ the rows of V⁻¹: a few operations a state and
frequency, where solving takes the square of the number of states. But V may be ill conditioned, and terms may cancel.
So V, V⁻¹ and Λ are refined by Newton's method with accurate residuals (Dongarra, Moler and Wilkinson 1983), and what is
left is estimated at every frequency: with A V = V (Λ + E) the response's error is to first order
C V (s − Λ)⁻¹ E (s − Λ)⁻¹ V⁻¹ B, and each term is rounded in proportion to its size.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.lti.state_space import StateSpace

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Matrix = Floats | Complexes
Parts = tuple[Matrix, Matrix, Matrix]

ROUNDING = float(np.finfo(float).eps)
OPERATIONS = 8.0  # roundings of a term: two differences, inverse, two products, and its share of the sum
WORST_CONDITION = 1e7  # of V: beyond it so few steps of Newton's method are not enough
NEWTON_STEPS = 2  # from eigenvectors with half of their digits right, as LAPACK gives them for poles over many decades
AT_ONCE = 500  # frequencies: their terms stay in the cache
LEADING_BITS = 22  # of a factor: the products of two leading parts and a sum of 256 of them are exact


@dataclass(frozen=True, eq=False)
class ModalForm:
    """Poles (n,) as a sum of two numbers, inputs (n, m) and outputs (p, n) of the terms; ``defect`` (n, n) is |E|."""

    poles_rad_s: Complexes
    poles_rest_rad_s: Complexes
    inputs: Complexes
    outputs: Complexes
    defect: Floats

    def response(self, omega_rad_s: Floats) -> tuple[Complexes, Floats]:
        """C (jω I − A)⁻¹ B at each frequency, (w, p, m), and an estimate (w,) of the error of each of its entries.

        The estimate is infinite where jω is a pole.
        """
        count, shape = self.poles_rad_s.size, (self.outputs.shape[0], self.inputs.shape[1])
        residues = (self.outputs.T[:, :, None] * self.inputs[:, None, :]).reshape(count, -1)
        decay = -(self.poles_rad_s.real + self.poles_rest_rad_s.real)[:, None]
        with_square = np.hstack([decay * residues.real, decay * residues.imag]).T
        with_difference = np.hstack([residues.imag, -residues.real]).T
        into, out_of = np.abs(self.inputs).max(axis=1), np.abs(self.outputs).max(axis=0)
        row, column = _majorant(self.defect)
        weights = np.stack([into * out_of, out_of * row, column * into])
        entries, rough = np.empty((2, residues.shape[1], omega_rad_s.size)), np.empty((3, omega_rad_s.size))
        decay_square, position, rest = (
            decay * decay,
            self.poles_rad_s.imag[:, None],
            self.poles_rest_rad_s.imag[:, None],
        )
        for start in range(0, omega_rad_s.size, AT_ONCE):
            part = slice(start, start + AT_ONCE)
            with np.errstate(all="ignore"):
                # 1/(jω − λ) = (decay − j difference)/(decay² + difference²): real numbers, a third of the time
                difference = omega_rad_s[part] - position
                difference -= rest
                square = difference * difference
                square += decay_square
                np.reciprocal(square, out=square)
                difference *= square
                entries[:, :, part] = (with_square @ square + with_difference @ difference).reshape(
                    2, -1, square.shape[1]
                )
                rough[:, part] = weights @ np.sqrt(square, out=square)
        with np.errstate(all="ignore"):
            error = OPERATIONS * ROUNDING * rough[0] + rough[1] * rough[2]
        response = np.empty((omega_rad_s.size, *shape), dtype=complex)
        response.real, response.imag = (half.T.reshape(-1, *shape) for half in entries)
        return response, np.where(np.isfinite(error), error, np.inf)


def _majorant(matrix: Floats) -> tuple[Floats, Floats]:
    """Vectors r and c with r_i c_j ≥ matrix_ij ≥ 0."""
    column = matrix.max(axis=0)
    return (matrix / np.where(column > 0.0, column, 1.0)).max(axis=1), column


def modal_form(system: StateSpace) -> ModalForm | None:
    """The modal form of a system with n ≥ 1 states; None where V is too ill conditioned for it."""
    poles, v = np.linalg.eig(system.a)
    try:
        x = np.linalg.inv(v)
    except np.linalg.LinAlgError:
        return None
    unit = np.exp2(np.round(np.log2(np.abs(v).max(axis=1))))  # of each state: its largest share in a mode
    a, b, c, v = system.a * unit / unit[:, None], system.b / unit[:, None], system.c * unit, v / unit[:, None]
    x = x * unit
    if not np.linalg.norm(v) * np.linalg.norm(x) < WORST_CONDITION:  # not when it is no number either
        return None
    identity, zero = np.eye(poles.size), np.zeros(1)
    distance = poles[None, :] - poles[:, None] + np.diag(np.full(poles.size, np.inf))
    columns, rows = split(v, axis=0), split(x, axis=1)
    scaled = accurate_product(columns, split(poles[None, :], axis=0), np.multiply)
    residual = first = accurate_difference(accurate_product(split(a, axis=1), columns), scaled)  # A V − V Λ
    turn, poles_rest = np.zeros_like(v), np.zeros_like(poles)
    for _ in range(NEWTON_STEPS):  # the eigenvectors are V + V turn
        defect = x @ residual
        poles_rest = poles_rest + np.diag(defect)
        with np.errstate(all="ignore"):  # equal poles, as of several like channels, are told by what is not finite
            turn = turn + defect / distance
        if not np.isfinite(turn).all():
            return None
        v_rest = v @ turn
        residual = first + (a @ v_rest - v_rest * poles) - (v + v_rest) * poles_rest
    missing = accurate_difference((identity, zero, zero), accurate_product(rows, columns))  # I − X V
    if not np.isfinite(missing).all():
        return None
    inputs = sum(accurate_product(rows, split(b, axis=0)))
    outputs = sum(accurate_product(split(c, axis=1), columns))
    return ModalForm(
        poles.astype(complex),
        poles_rest.astype(complex),
        np.linalg.solve(identity + turn, np.linalg.solve(identity - missing, inputs)).astype(complex),
        (outputs + outputs @ turn).astype(complex),
        np.abs(x @ residual),
    )


def split(matrix: Matrix, axis: int) -> Parts:
    """A matrix as two leading parts and a rest; the parts' grids are common along an axis."""
    first = _leading(matrix, axis)
    second = _leading(matrix - first, axis)
    return first, second, (matrix - first) - second


def _times(a: Matrix, b: Matrix) -> Matrix:
    """A B; of a real and a complex matrix without making the real one complex."""
    if np.iscomplexobj(a) or not np.iscomplexobj(b):
        product: Matrix = np.matmul(a, b)
        return product
    return np.asarray((a @ np.ascontiguousarray(b).view(float)).view(complex), dtype=complex)


def accurate_product(a: Parts, b: Parts, multiply: Callable[[Matrix, Matrix], Matrix] = _times) -> Parts:
    """A B to three times the precision, as the sum of an exact matrix, a smaller exact one and a small one.

    The products of leading parts are exact where A is split along its rows and B along its columns (Ozaki, Ogita, Oishi
    and Rump 2012).
    """
    small = multiply(a[0], b[2]) + multiply(a[1], b[1] + b[2]) + multiply(a[2], b[0] + b[1])
    return multiply(a[0], b[0]), multiply(a[0], b[1]) + multiply(a[1], b[0]), small


def accurate_difference(first: Parts, second: Parts) -> Matrix:
    """The difference of two matrices in parts, rounded at the end alone."""
    cancelled: Matrix = (first[0] - second[0]) + (first[1] - second[1])  # exact where the two nearly agree
    return cancelled + (first[2] - second[2])


def _leading(matrix: Matrix, axis: int) -> Matrix:
    """The leading bits of the entries, on one grid for all real and imaginary parts along an axis."""
    largest = np.abs(matrix.real).max(axis=axis, keepdims=True)
    if np.iscomplexobj(matrix):
        largest = np.maximum(largest, np.abs(matrix.imag).max(axis=axis, keepdims=True))
    unit = np.exp2(np.ceil(np.log2(np.where(largest > 0.0, largest, 1.0))) + (52 - LEADING_BITS)) * 1.5
    leading = np.empty_like(matrix)
    leading.real = (matrix.real + unit) - unit
    if np.iscomplexobj(matrix):
        leading.imag = (matrix.imag + unit) - unit
    return leading

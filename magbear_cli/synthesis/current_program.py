"""The cone program of least current: unknown coefficients of K S, the specification held, the largest current least."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.conic import Cone, solve_cone_program
from magbear_cli.synthesis.control_set import ControlSet, Modulus, Row
from magbear_cli.synthesis.current_wish import AffineCurrent

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_MISSED = 300.0  # what missing the specification by one costs, in units of the present current
_PEAKS = 3  # unknowns beside the linear ones and the moduli: both peaks, and by how much the set is missed


@dataclass(frozen=True)
class CurrentUnits:
    """The present peaks of |K S| and of |u|, which are the units, and what each counts in the cost."""

    peaks: tuple[float, float]
    prices: tuple[float, float]


def least_current(current: AffineCurrent, held: ControlSet, units: CurrentUnits, bounds: Floats) -> Floats:
    """The unknowns (m,) that minimise the priced sum of both peaks within the held set.

    The last unknowns, as many as there are ``bounds``, stay within these bounds in size. The set's rows are elastic at
    a high price, so that an answer comes also where so few unknowns cannot hold the set: it is judged afterwards.

    Raises
    ------
    NumericsError
        when the cone program has no answer.
    """
    free = current.columns.shape[1] - bounds.size
    basis, back = _orthonormal(current.columns[:, :free], units.peaks[0])
    columns = np.hstack([basis, current.columns[:, free:]])
    steps = np.hstack([current.step_columns[:, :free] @ back, current.step_columns[:, free:]])
    program = _Program(columns, current.offset, len(held.moduli))
    for modulus in held.moduli:
        program.add_modulus(modulus)
    program.add_peak(units.peaks[0])
    for row in held.rows:
        program.add_row(row)
    program.add_limits(steps / units.peaks[1], current.step_offset / units.peaks[1], bounds)
    x = program.solve((units.prices[0] * units.peaks[0] / units.peaks[1], units.prices[1], _MISSED))
    return np.concatenate([back @ x[:free], x[free : free + bounds.size]])


class _Program:
    """Rows b − A x in cones; x: the linear unknowns, both peaks, the elastic amount, then a number for each modulus."""

    def __init__(self, columns: Complexes, offset: Complexes, moduli: int) -> None:
        self.columns, self.offset = columns, offset
        self.count, self.linear = columns.shape
        self.unknowns = self.linear + _PEAKS + moduli * self.count
        self.cone_rows: list[sparse.spmatrix] = []
        self.cone_rights: list[Floats] = []
        self.rows: list[sparse.spmatrix] = []
        self.rights: list[Floats] = []

    def add_modulus(self, modulus: Modulus) -> None:
        """The next of the numbers is at least |offset + slope r|."""
        first = self.linear + _PEAKS + len(self.cone_rights) * self.count
        self._add_cones(modulus.offset, modulus.slope, first + np.arange(self.count))

    def add_peak(self, unit: float) -> None:
        """The first peak is at least |r|; it follows the moduli."""
        zero = np.zeros(self.count, dtype=complex)
        self._add_cones(zero, np.full_like(zero, 1.0 / unit), np.full(self.count, self.linear))

    def _add_cones(self, offset: Complexes, slope: Complexes, tops: NDArray[np.intp]) -> None:
        matrix, right = np.zeros((3 * self.count, self.linear)), np.zeros(3 * self.count)
        inner, part = offset + slope * self.offset, slope[:, None] * self.columns
        matrix[1::3], matrix[2::3], right[1::3], right[2::3] = -part.real, -part.imag, inner.real, inner.imag
        places = (np.arange(0, 3 * self.count, 3), tops - self.linear)
        shape = (3 * self.count, self.unknowns - self.linear)
        top = sparse.csr_matrix((-np.ones(self.count), places), shape)
        self.cone_rows.append(sparse.hstack([sparse.csr_matrix(matrix), top]))
        self.cone_rights.append(right)

    def add_row(self, row: Row) -> None:
        """Σ weights·moduli ≤ Re(offset + slope r), missed by no more than the elastic amount."""
        side = np.hstack([-(row.slope[:, None] * self.columns).real, np.zeros((self.count, _PEAKS))])
        side[:, -1] = -1.0
        self.rows.append(sparse.hstack([sparse.csr_matrix(side), *(sparse.diags(weight) for weight in row.weights)]))
        self.rights.append((row.offset + row.slope * self.offset).real)

    def add_limits(self, steps: Floats, step_offset: Floats, bounds: Floats) -> None:
        """|u| below the second peak, moves within their bounds, and the last three numbers not negative."""
        signs = (1.0, -1.0)
        under = np.hstack([np.vstack([sign * steps for sign in signs]), np.zeros((2 * step_offset.size, _PEAKS))])
        under[:, -2] = -1.0
        moves = np.hstack([np.zeros((bounds.size, self.linear - bounds.size)), np.eye(bounds.size)])
        within = np.hstack([np.vstack([sign * moves for sign in signs]), np.zeros((2 * bounds.size, _PEAKS))])
        positive = np.hstack([np.zeros((_PEAKS, self.linear)), -np.eye(_PEAKS)])
        dense = sparse.csr_matrix(np.vstack([under, within, positive]))
        none = sparse.csr_matrix((dense.shape[0], self.unknowns - self.linear - _PEAKS))
        self.rows.append(sparse.hstack([dense, none]))
        self.rights += [-step_offset, step_offset, bounds, bounds, np.zeros(_PEAKS)]

    def solve(self, prices: Sequence[float]) -> Floats:
        """The unknowns of least cost, the prices being those of the three peaks."""
        cost = np.zeros(self.unknowns)
        cost[self.linear : self.linear + _PEAKS] = prices
        right = np.concatenate([*self.cone_rights, *self.rights])
        cones = [(Cone.SECOND_ORDER, 3)] * (self.count * len(self.cone_rights))
        cones.append((Cone.NONNEGATIVE, sum(part.size for part in self.rights)))
        answer = solve_cone_program(cost, sparse.vstack([*self.cone_rows, *self.rows]), right, cones, tolerance=1e-8)
        if not answer.is_solved:
            raise NumericsError(f"the cone program of least current ended as {answer.status}")
        return answer.x


def _orthonormal(columns: Complexes, unit: float) -> tuple[Complexes, Floats]:
    """Columns of this size in the mean square that span the same real combinations, and the matrix back."""
    count = columns.shape[0]
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    q, r = np.linalg.qr(np.vstack([columns.real, columns.imag]) / size)
    scale = unit * np.sqrt(count)
    try:
        back = np.linalg.solve(r, np.eye(r.shape[0])) * scale / size[:, None]
    except np.linalg.LinAlgError as error:
        raise NumericsError("the functions of the current's program are not independent") from error
    return np.asarray((q[:count] + 1j * q[count:]) * scale), np.asarray(back)

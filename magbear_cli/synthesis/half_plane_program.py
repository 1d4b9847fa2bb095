"""The half-plane condition for controllers over given lags, and the cone program that widens its margin.

With the plant n_m/d_m and K = X/Y, X and Y stable, level g holds for every mass, stability included, if
|W1 Y d_m| + |W3 X n_m| < g Re(θ (Y d_m − X n_m)) at both end masses and every frequency. θ = 1 over the stable
denominator (s + α)² loses nothing over all stable X and Y; over finitely many functions the directions θ(ω) of a
present controller may serve better. The argument is decision 0010.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.conic import Cone, solve_cone_program
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import worst_level
from magbear_cli.synthesis.half_plane import nearest_direction, over_radius, plant_factors
from magbear_cli.synthesis.lag_chain import ChainRatio, chain_basis
from magbear_cli.synthesis.lag_ratio import LagRatio

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Ratio = LagRatio | ChainRatio
Directions = Callable[[Floats], Complexes]

_LEAST = 1e-4  # of the mean: how small |Y d − X n| may become beside the reference's


@dataclass(frozen=True, eq=False)
class HalfPlaneProgram:
    """The condition for one problem in its own units and one chain of lags.

    Parameters
    ----------
    poles : (n,) positive array, the lags of X and Y
    alpha : the speed of the stable denominator (s + α)²
    reference : a plain stabilising controller, whose |Y d − X n| is the yardstick below
    """

    scaled: ControlProblem
    poles: Floats
    alpha: float
    reference: LagRatio

    def free_directions(self, omega: Floats) -> Complexes:
        """θ = 1 when the plant is written over (s + α)²: the turn of that denominator, −1 at ω = ∞."""
        finite = np.isfinite(omega)
        at = np.where(finite, omega, 0.0)
        return np.asarray(np.where(finite, (self.alpha - 1j * at) / (self.alpha + 1j * at), -1.0))

    def directions_of(self, present: Ratio) -> Directions:
        """The directions in which the present controller meets the condition with the most room."""

        def directions(omega: Floats) -> Complexes:
            x, y = present.numerator_denominator(omega)
            discs = [
                over_radius(y * d - x * n, w1_d * np.abs(y) + w3_n * np.abs(x))
                for d, n, w1_d, w3_n in self._factors(omega)
            ]
            return np.conj(nearest_direction(discs[0], discs[-1]))

        return directions

    def level(self, candidate: ChainRatio, directions: Complexes, omega: Floats) -> Floats:
        """The exact worst case at each frequency; ∞ where an end mass leaves the half-plane that proves stability."""
        x, y = candidate.numerator_denominator(omega)
        inside = [((y * d - x * n) * directions).real > 0 for d, n, _, _ in self._factors(omega)]
        with np.errstate(divide="ignore", invalid="ignore"):
            level = worst_level(self.scaled, x / y, omega)[0]
        return np.asarray(np.where(np.all(inside, axis=0), level, np.inf))

    def widest_margin(self, present: Ratio, directions: Complexes, omega: Floats, level: float) -> ChainRatio:
        """The controller with the largest s in |W1 Y d| + |W3 X n| + s u ≤ level·Re(θ (Y d − X n)), u the present Re.

        X and Y are sought in functions made orthonormal over the grid, in units of the present |X| and |Y|. The mean of
        Re(θ (Y d − X n))/r is one, r the reference's |Y d − X n|, and nowhere is it below a small part of that: else a
        common factor of X and Y could vanish at some frequency, and with it the meaning of the winding number.

        Raises
        ------
        NumericsError
            when the cone program has no answer.
        """
        x, y = present.numerator_denominator(omega)
        x_size, y_size = _floored(np.abs(x)), _floored(np.abs(y))
        basis = chain_basis(self.poles, omega)
        x_basis, x_back = _orthonormal(basis / x_size[:, None])
        y_basis, y_back = _orthonormal(basis / y_size[:, None])
        x_reference, y_reference = self.reference.numerator_denominator(omega)
        size = self.poles.size + 1
        sides, floors, moduli = [], [], []
        for d, n, w1_d, w3_n in self._factors(omega):
            chi = y * d - x * n
            unit = np.maximum((chi * directions).real, 1e-3 * np.abs(chi))
            x_turn, y_turn = -directions * n * x_size / unit, directions * d * y_size / unit
            side = np.hstack([(x_basis * x_turn[:, None]).real, (y_basis * y_turn[:, None]).real])
            moduli.append((w3_n * x_size / unit, w1_d * y_size / unit))
            sides.append(level * side)
            floors.append(side * (unit / np.abs(y_reference * d - x_reference * n))[:, None])
        coefficients = _solve(sides, moduli, np.concatenate(floors), (x_basis, y_basis))
        x_new, y_new = x_back @ coefficients[:size], y_back @ coefficients[size:]
        return ChainRatio(self.poles, x_new, y_new)

    def _factors(self, omega: Floats) -> list[tuple[Floats, Floats, Floats, Floats]]:
        return [plant_factors(self.scaled, omega, plant) for plant in self.scaled.family.ends]


def _solve(
    sides: list[Floats], moduli: list[tuple[Floats, Floats]], floors: Floats, bases: tuple[Complexes, Complexes]
) -> Floats:
    """The coefficients of X and Y that maximise s: w3 |X| + w1 |Y| + s ≤ side·v, floors·v not small, its mean one.

    The unknowns are the coefficients v, |X| and |Y| at each frequency, and s.
    """
    count, half, rows = bases[0].shape[0], bases[0].shape[1], floors.shape[0]
    ends = np.cumsum([2 * half, count, count])
    points = np.arange(count)
    blocks = []
    for side, (of_x, of_y) in zip(sides, moduli, strict=True):
        block = np.zeros((count, ends[-1] + 1))
        block[:, : ends[0]] = -side
        block[points, ends[0] + points], block[points, ends[1] + points], block[:, -1] = of_x, of_y, 1.0
        blocks.append(block)
    blocks.append(np.hstack([-floors, np.zeros((rows, 2 * count + 1))]))
    for which, basis in enumerate(bases):
        cone = np.zeros((count, 3, ends[-1] + 1))
        columns = slice(which * half, (which + 1) * half)
        cone[points, 0, ends[which] + points] = -1.0
        cone[:, 1, columns], cone[:, 2, columns] = -basis.real, -basis.imag
        blocks.append(cone.reshape(3 * count, -1))
    blocks.append(np.concatenate([floors.mean(axis=0), np.zeros(2 * count + 1)])[None, :])
    cost = np.zeros(ends[-1] + 1)
    cost[-1] = -1.0
    answer = solve_cone_program(
        cost,
        np.concatenate(blocks),
        np.concatenate([np.zeros(rows), np.full(rows, -_LEAST), np.zeros(6 * count), [1.0]]),
        [(Cone.NONNEGATIVE, 2 * rows), *[(Cone.SECOND_ORDER, 3)] * (2 * count), (Cone.ZERO, 1)],
        tolerance=1e-8,
    )
    if not answer.is_solved:
        raise NumericsError(f"the cone program of the exact real-mass problem ended as {answer.status}")
    return answer.x[: ends[0]]


def _floored(size: Floats) -> Floats:
    return np.asarray(np.maximum(size, 1e-9 * size.max()))


def _orthonormal(columns: Complexes) -> tuple[Complexes, Floats]:
    """Columns of mean square one that span the same real combinations, and the matrix back to the given ones."""
    count = columns.shape[0]
    q, r = np.linalg.qr(np.vstack([columns.real, columns.imag]) / np.sqrt(count))
    q = q * np.sqrt(count)
    return q[:count] + 1j * q[count:], np.linalg.inv(r)

"""The discs in which K S must lie so that the scaled closed loop stays below a level, frequency by frequency."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.kernels.structured_singular_value import mu_upper_bound

Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class LevelDiscs:
    """|K S − centre| ≤ radius at each frequency (negative radius: no K S will do); ``floor`` is the least level there.

    All arrays (w,).
    """

    centre: Complexes
    radius: NDArray[np.float64]
    floor: NDArray[np.float64]


def level_discs(
    interconnection: tuple[Complexes, Complexes, Complexes], scales: NDArray[np.float64], level: float
) -> LevelDiscs:
    """The set of scalars r for which the largest singular value of D (P11 + r p12 p21ᵀ) D⁻¹ is at most ``level``.

    Parameters
    ----------
    interconnection : P11 (w, n, n), p12 (w, n), p21 (w, n)
    scales : (w, n) positive diagonals of D

    Notes
    -----
    Turned by unitary matrices with first columns D p12 and D⁻¹ p̄21, r appears in one entry only, [[r', b], [c, A]].
    Parrott's theorem (Davis, Kahan and Weinberger, SIAM J. Numer. Anal. 1982) then gives the disc with the centre
    −b (t² − A*A)⁻¹ A* c and the radius t √(1 − b (t² − A*A)⁻¹ b*) √(1 − c* (t² − A A*)⁻¹ c), for t above both
    ‖[c A]‖ and ‖[b; A]‖.
    """
    p11, p12, p21 = interconnection
    scaled = scales[:, :, None] * p11 / scales[:, None, :]
    column, row = scales * p12, p21 / scales
    left, right = _completed_basis(column), _completed_basis(np.conj(row))
    turned = np.conj(np.swapaxes(left, 1, 2)) @ scaled @ right
    gain = np.linalg.norm(column, axis=1) * np.linalg.norm(row, axis=1)
    floor = np.zeros(gain.shape)
    if turned.shape[1] > 1:
        rest = (turned[:, 1:, :], turned[:, :, 1:])
        floor = np.maximum(*(np.linalg.norm(part, 2, axis=(1, 2)) for part in rest))
    b, c, inner = turned[:, :1, 1:], turned[:, 1:, :1], turned[:, 1:, 1:]
    adjoint = np.conj(np.swapaxes(inner, 1, 2))
    # Where the level is below the floor the formulas are evaluated at a legal level and the radius is made negative.
    t = np.maximum(level, 1.0001 * floor + 1e-300)[:, None, None]
    identity = np.eye(inner.shape[1])
    right_gap, left_gap = t**2 * identity - adjoint @ inner, t**2 * identity - inner @ adjoint
    centre = -(b @ np.linalg.solve(right_gap, adjoint @ c))[:, 0, 0]
    b_size = (b @ np.linalg.solve(right_gap, np.conj(np.swapaxes(b, 1, 2))))[:, 0, 0].real
    c_size = (np.conj(np.swapaxes(c, 1, 2)) @ np.linalg.solve(left_gap, c))[:, 0, 0].real
    radius = t[:, 0, 0] * np.sqrt(np.maximum(1.0 - b_size, 0.0) * np.maximum(1.0 - c_size, 0.0))
    radius = np.where(level > floor, radius, -radius - 1e-300)
    return LevelDiscs((centre - turned[:, 0, 0]) / gain, radius / gain, floor)


def held_scales(matrices: Complexes, level: float) -> NDArray[np.float64]:
    """D-scales to hold during a step: those of mu, but at the ends of the grid their neighbour's where these serve.

    At ω = 0 and ∞ a bound vanishes, mu is reached by no finite D, and the scales that come near it would freeze K S at
    its present value. The frequencies are ascending, the ends first and last.
    """
    scales = mu_upper_bound(matrices)[1]
    for end, neighbour in ((0, 1), (-1, -2)):
        borrowed = scales[neighbour]
        reached = np.linalg.norm(borrowed[:, None] * matrices[end] / borrowed[None, :], 2)
        if reached < level:
            scales[end] = borrowed
    return scales


def _completed_basis(vectors: Complexes) -> Complexes:
    """Unitary (w, n, n) whose first columns are the directions of the vectors, by Householder reflections."""
    count = vectors.shape[1]
    unit = vectors / np.linalg.norm(vectors, axis=1)[:, None]
    phase = np.where(unit[:, 0] == 0, 1.0, unit[:, 0] / np.maximum(np.abs(unit[:, 0]), 1e-300))
    mirror = unit.copy()
    mirror[:, 0] += phase
    size = np.sum(np.abs(mirror) ** 2, axis=1)[:, None, None]
    reflection = np.eye(count) - 2.0 * mirror[:, :, None] * np.conj(mirror[:, None, :]) / size
    # The reflection sends the unit vector to −phase·e1, so its first column is the vector up to a phase.
    turns = np.concatenate([-phase[:, None], np.ones((len(phase), count - 1))], axis=1)
    return np.asarray(reflection * turns[:, None, :])

"""The D-step: the D-scales of mu on a grid, and rational functions that follow them where it matters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from magbear_cli.kernels.block_scaling import block_upper_bound
from magbear_cli.kernels.block_structure import BlockStructure
from magbear_cli.lti.balancing import with_balanced_states
from magbear_cli.lti.connection import append, series
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.synthesis.block_scale import UNIT, BlockScale, NumberScale
from magbear_cli.synthesis.gamma_search import Ports
from magbear_cli.synthesis.matrix_scale_fit import fit_matrix_scale
from magbear_cli.synthesis.peak import refined_peak
from magbear_cli.synthesis.scale_fit import fit_scale

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Pair = tuple[Complexes, Complexes]  # D on the outputs and D⁻¹ on the inputs of a block, over frequency

# An error of log D where mu is far below its peak costs nothing today, but the next controller may be stopped by it:
# weights are the sensitivity of the bound times mu/peak to each of these powers, and every fit is worth a try.
_FLATTENINGS = (0.0, 0.5, 2.0)
_NUDGE = 0.3  # of log d, in the central difference for the sensitivity


@dataclass(frozen=True, eq=False)
class RationalScales:
    """One rational D-scale a block, and the largest σ(D M D⁻¹) they give on the grid.

    ``found`` holds for each block log |det D|, over its outputs, of the scales that are best at each frequency, (w,).
    """

    structure: BlockStructure
    blocks: tuple[BlockScale, ...]
    level: float
    omega_rad_s: Floats
    found: tuple[Floats, ...]

    def fitted(self, place: int) -> Floats:
        """The same of a block's rational scale."""
        left, _ = self.blocks[place].response(self.omega_rad_s)
        return np.asarray(np.linalg.slogdet(left)[1] / left.shape[1], dtype=float)

    def around(self, plant: StateSpace, ports: Ports) -> StateSpace:
        """D P D⁻¹: the plant for the next controller; its last inputs and outputs are controls and measurements."""
        left = reduce(append, [*(block.left() for block in self.blocks), _wires(ports.measurements)])
        right = reduce(append, [*(block.right_inverse() for block in self.blocks), _wires(ports.controls)])
        return with_balanced_states(series(series(right, plant), left))

    def norm(self, loop: StateSpace, omega_rad_s: Floats) -> float:
        """The largest σ(D M D⁻¹) of a closed loop M on a dense grid, ∞ when the loop is not stable.

        The states of D and D⁻¹, which cancel in part, are kept out of the loop: this costs less and loses nothing.
        """
        if loop.poles().real.max() >= 0.0:
            return float("inf")
        inner = omega_rad_s[np.isfinite(omega_rad_s)]
        pairs = [block.response(inner) for block in self.blocks]
        return float(_bound(frequency_response(loop, inner), self.structure, pairs).max())


def peak_mu(loop: StateSpace, structure: BlockStructure, omega_rad_s: Floats) -> tuple[float, float]:
    """The peak of the upper bound of mu of a closed loop, refined between the points, and where.

    It says nothing about the loop's stability.
    """

    def level(omega: Floats) -> Floats:
        return block_upper_bound(frequency_response(loop, omega), structure).upper

    return refined_peak(level, omega_rad_s)


def fit_scales(
    loop: StateSpace, structure: BlockStructure, omega_rad_s: Floats, order: int, *, every_scale: bool
) -> list[RationalScales]:
    """Rational D-scales for a closed loop, one set for each weighting, the best on the grid first.

    Where a block is repeated there are sets with a number in place of its matrix too: the best matrices change with
    frequency in ways that a low order may not follow, and the best numbers may be followed better.

    Parameters
    ----------
    omega_rad_s : (w,) positive ascending grid
    order : states of each scale; of each channel where a repeated block has a matrix
    every_scale : fit all scales, in the normalisation of product one; otherwise the last full block's scale is one
    """
    matrices = frequency_response(loop, omega_rad_s)
    sets = []
    for coarse in (structure, structure.with_numbers) if structure.has_matrix else (structure,):
        grid = _Grid.of(matrices, coarse, omega_rad_s, every_scale=every_scale)
        sensitivity = np.sqrt(grid.sensitivity())
        for power in _FLATTENINGS:
            weights = sensitivity * ((grid.mu / grid.mu.max()) ** power)[:, None]
            blocks = tuple(grid.fitted(place, weights[:, place], order) for place in range(len(coarse.blocks)))
            level = float(_bound(matrices, structure, [block.response(omega_rad_s) for block in blocks]).max())
            sets.append(RationalScales(structure, blocks, level, omega_rad_s, grid.found()))
    return sorted(sets, key=lambda scales: scales.level)


@dataclass(frozen=True, eq=False)
class _Grid:
    """The matrices of a loop on a grid, and the D-scales that are best at every point."""

    omega_rad_s: Floats
    matrices: Complexes
    structure: BlockStructure
    mu: Floats
    exact: list[Pair]
    reference: int | None  # the block whose scale is one

    @classmethod
    def of(cls, matrices: Complexes, structure: BlockStructure, omega: Floats, *, every_scale: bool) -> _Grid:
        bound = block_upper_bound(matrices, structure)
        numbers = [place for place, block in enumerate(structure.blocks) if not structure.is_matrix(block)]
        reference = numbers[-1] if numbers and not every_scale else None
        unit = 1.0 if reference is None else _first_entry(bound.left, structure.rows[reference])
        exact = []
        for row, column in zip(structure.rows, structure.columns, strict=True):
            right = bound.right[:, column, column] / unit
            exact.append((bound.left[:, row, row] / unit, np.asarray(np.linalg.inv(right))))
        return cls(omega, matrices, structure, bound.upper, exact, reference)

    def found(self) -> tuple[Floats, ...]:
        """Log |det D| over its outputs, of each block's best scale, (w,) each."""
        return tuple(np.asarray(np.linalg.slogdet(left)[1] / left.shape[1], dtype=float) for left, _ in self.exact)

    def sensitivity(self) -> Floats:
        """The curvature of log σ(D M D⁻¹) in each block's log d at the least value, (w, n): its slope there is zero."""
        least = _bound(self.matrices, self.structure, self.exact)
        curvature = np.zeros((least.size, len(self.exact)))
        for place, (left, right) in enumerate(self.exact):
            up, down = (self._bound_with(place, (left * np.exp(x), right * np.exp(-x))) for x in (_NUDGE, -_NUDGE))
            curvature[:, place] = np.maximum((up + down) / least - 2.0, 1e-12) / _NUDGE**2
        return curvature

    def fitted(self, place: int, weights: Floats, order: int) -> BlockScale:
        """The fit of a block's scale with which, all others exact, the bound rises least at its peak."""
        block = self.structure.blocks[place]
        if place == self.reference:
            return NumberScale(UNIT, block.outputs, block.inputs)
        left = self.exact[place][0]
        fits = fit_scale(self.omega_rad_s, self.found()[place], weights, order)
        candidates: list[BlockScale] = [NumberScale(fit, block.outputs, block.inputs) for fit in fits]
        if self.structure.is_matrix(block):
            spectra = np.asarray(left.conj().swapaxes(1, 2) @ left)
            candidates += fit_matrix_scale(self.omega_rad_s, spectra, weights, order)
        return min(candidates, key=lambda one: float(self._bound_with(place, one.response(self.omega_rad_s)).max()))

    def _bound_with(self, place: int, pair: Pair) -> Floats:
        pairs = [pair if other == place else exact for other, exact in enumerate(self.exact)]
        return _bound(self.matrices, self.structure, pairs)


def _first_entry(scaling: Complexes, row: slice) -> Floats:
    """The number that scales a block, (w, 1, 1)."""
    return np.asarray(scaling[:, row.start, row.start].real[:, None, None])


def _bound(matrices: Complexes, structure: BlockStructure, pairs: Sequence[Pair]) -> Floats:
    """σ(D M D⁻¹) at each frequency, (w,)."""
    left = np.zeros((matrices.shape[0], structure.outputs, structure.outputs), dtype=complex)
    right = np.zeros((matrices.shape[0], structure.inputs, structure.inputs), dtype=complex)
    for row, column, (of_outputs, of_inputs) in zip(structure.rows, structure.columns, pairs, strict=True):
        left[:, row, row], right[:, column, column] = of_outputs, of_inputs
    return np.asarray(np.linalg.norm(left @ matrices @ right, 2, axis=(1, 2)))


def _wires(count: int) -> StateSpace:
    return StateSpace.gain(np.eye(count))

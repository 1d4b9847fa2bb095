"""Constant D-scales: the units of disturbance and error channels, found before anything else is fitted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.block_structure import BlockStructure
from magbear_cli.lti.balancing import with_balanced_states
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.generalized_plant import GeneralizedPlant, uncertainty_unit
from magbear_cli.model.problem import ControlProblem
from magbear_cli.synthesis.gamma_search import Ports, search_gamma, with_unit_penalty

Floats = NDArray[np.float64]

_FACTOR = 3.0  # between neighbouring scales: gamma is flat near its least value
_TOLERANCE = 0.05  # of gamma while scales are compared
_MOST_MOVES = 40


def thesis_scales(problem: ControlProblem, plant: GeneralizedPlant) -> Floats:
    """The thesis's unit of the uncertainty channel: forces count in k_z·1 m and Δ stands at the output (n,)."""
    unit = abs(uncertainty_unit(problem)) / problem.nominal.negative_stiffness_n_per_m
    return np.array([unit if name == "force" else 1.0 for name in plant.outputs[: -plant.measurements]])


def with_channel_scales(plant: StateSpace, structure: BlockStructure, scales: Floats) -> StateSpace:
    """D P D⁻¹ on the error outputs and disturbance inputs, one scale a block; measurements and controls as they are."""
    left, right = np.ones(plant.outputs), np.ones(plant.inputs)
    for scale, row, column in zip(scales, structure.rows, structure.columns, strict=True):
        left[row], right[column] = scale, scale
    return StateSpace(plant.a, plant.b / right, left[:, None] * plant.c, left[:, None] * plant.d / right)


def constant_scales(plant: StateSpace, structure: BlockStructure, ports: Ports) -> Floats:
    """The scales of the blocks (n,), powers of three with the last one 1, of the least H-infinity norm within reach.

    Each move goes to the best neighbour in one scale, until none is better.

    Raises
    ------
    NumericsError
        when no scales within the moves give a stabilising controller.
    """
    found: dict[tuple[int, ...], float] = {}

    def norm(powers: tuple[int, ...]) -> float:
        if powers not in found:
            scaled = with_channel_scales(plant, structure, _scales(powers))
            per_control = with_unit_penalty(scaled, ports)[0]
            search = search_gamma(with_balanced_states(per_control), _TOLERANCE, ports=ports)
            found[powers] = np.inf if search.best is None else search.best.norm
        return found[powers]

    present = (0,) * (len(structure.blocks) - 1)
    for _ in range(_MOST_MOVES):
        steps = [
            tuple(power + move * (place == channel) for place, power in enumerate(present))
            for channel in range(len(present))
            for move in (-1, 1)
        ]
        best = min([present, *steps], key=norm)
        if best == present:
            break
        present = best
    if not np.isfinite(norm(present)):
        raise NumericsError("no constant D-scales were found for which a stabilising controller exists")
    return _scales(present)


def _scales(powers: tuple[int, ...]) -> Floats:
    return np.asarray(_FACTOR ** np.append(np.array(powers, dtype=float), 0.0))

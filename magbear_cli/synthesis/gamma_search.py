"""The least H-infinity norm a controller can reach, by bisection on gamma with every candidate's loop closed anew."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.hinf import HinfAnswer, hinf_controller, require_hinf_plant
from magbear_cli.lti.balancing import with_balanced_states, with_time_unit
from magbear_cli.lti.connection import lower_lft
from magbear_cli.lti.norm import hinf_norm
from magbear_cli.lti.state_space import StateSpace

DOUBLINGS = 40  # from 1 up to 1e12: a level beyond it means that nothing useful exists
BISECTIONS = 60  # enough for a bracket of 1e12 down to a relative 1e-6
AGREEMENT = 1.01  # a controller whose recomputed norm exceeds gamma by more is not believed

Floats = NDArray[np.float64]
Measure = Callable[[StateSpace], float]


@dataclass(frozen=True)
class Ports:
    """How many of a plant's last outputs go to the controller, and how many of its last inputs come from it."""

    measurements: int = 1
    controls: int = 1


SINGLE = Ports()


@dataclass(frozen=True, eq=False)
class Candidate:
    """A controller whose loop was closed and measured, in the units of the plant that was searched."""

    controller: StateSpace
    norm: float
    gamma: float
    rcond: float


@dataclass
class GammaSearch:
    """Where the bisection stands: the best controller, the highest level that failed, and why."""

    best: Candidate | None = None
    failed_gamma: float = 0.0
    sentence: str = ""
    solves: int = 0


def search_gamma(  # noqa: PLR0913 - a search has a plant, a bracket and a judge; most callers name only two
    plant: StateSpace,
    tolerance: float,
    *,
    ports: Ports = SINGLE,
    start: float = 1.0,
    doublings: int = DOUBLINGS,
    measure: Measure | None = None,
    looked_at: bool = False,
) -> GammaSearch:
    """Double gamma until a candidate holds, then halve the bracket, keeping the best candidate seen.

    Parameters
    ----------
    plant : measurements are its last outputs and controls its last inputs; time and channels scaled by the caller
    tolerance : relative width of the last bracket
    ports : how many of them
    start : the first gamma
    doublings : how often to double it in search of a first candidate
    measure : the norm of the loop of a controller, ∞ when it is not stable; by default that of the plant's own loop
    looked_at : the caller knows that the method can work on the plant

    Notes
    -----
    A candidate counts only when its loop is stable and its recomputed norm is at most 1.01 gamma.

    Raises
    ------
    NumericsError
        when the plant lies outside the method.
    """
    if not looked_at:
        matrices = (plant.a, plant.b, plant.c, plant.d)
        require_hinf_plant(*matrices, measurements=ports.measurements, controls=ports.controls)
    measure = measure or (lambda controller: hinf_norm(lower_lft(plant, controller))[0])
    search, gamma = GammaSearch(), start
    for _ in range(doublings):
        _try(plant, ports, gamma, search, measure)
        if search.best is not None:
            break
        gamma *= 2.0
    for _ in range(BISECTIONS):
        if search.best is None:
            break
        upper = min(search.best.norm, search.best.gamma)
        if upper - search.failed_gamma <= tolerance * upper:
            break
        _try(plant, ports, 0.5 * (search.failed_gamma + upper), search, measure)
    return search


def with_unit_penalty(system: StateSpace, ports: Ports = SINGLE) -> tuple[StateSpace, Floats]:
    """The plant with each control counted in the unit that makes its column of D12 one long, and those units."""
    d12 = system.d[: -ports.measurements, -ports.controls :]
    penalties = np.array([np.linalg.norm(column) for column in d12.T])
    units = np.where(penalties > 0, 1.0 / np.where(penalties > 0, penalties, 1.0), 1.0)
    scale = np.ones(system.inputs)
    scale[-ports.controls :] = units
    return StateSpace(system.a, system.b * scale, system.c, system.d * scale), units


def controller_in_si(controller: StateSpace, unit_rad_s: float, unit_a: Floats) -> StateSpace:
    """The controller found in scaled time and controls, in rad/s and the controls' own units (A of a bearing)."""
    units = unit_a[:, None]
    current = StateSpace(controller.a, controller.b, units * controller.c, units * controller.d)
    return with_balanced_states(with_time_unit(current, 1.0 / unit_rad_s))


def _try(plant: StateSpace, ports: Ports, gamma: float, search: GammaSearch, measure: Measure) -> None:
    """One solve at this gamma, closed, measured, and kept when it holds and is the best."""
    search.solves += 1
    matrices, measurements, controls = (plant.a, plant.b, plant.c, plant.d), ports.measurements, ports.controls
    answer = hinf_controller(*matrices, measurements=measurements, controls=controls, gamma=gamma, looked_at=True)
    candidate, sentence = _measured(answer, gamma, measure)
    if candidate is None:
        search.failed_gamma, search.sentence = max(gamma, search.failed_gamma), sentence
    elif search.best is None or candidate.norm <= search.best.norm:
        search.best = candidate


def _measured(answer: HinfAnswer, gamma: float, measure: Measure) -> tuple[Candidate | None, str]:
    """The candidate with the norm its loop really has, or the reason to refuse it."""
    if not answer.is_solved:
        return None, answer.sentence
    controller = StateSpace(answer.a, answer.b, answer.c, answer.d)
    try:
        norm = measure(controller)
    except NumericsError as error:
        return None, str(error)
    if not norm <= AGREEMENT * gamma:
        word = "is unstable" if np.isinf(norm) else f"has norm {norm:.4g}"
        return None, f"the loop of the controller for gamma = {gamma:.4g} {word}"
    return Candidate(controller, norm, gamma, float(answer.rcond.min())), ""

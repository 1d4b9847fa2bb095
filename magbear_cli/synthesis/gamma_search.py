"""The least H-infinity norm a controller can reach, by bisection on gamma with every candidate's loop closed anew."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.hinf import HinfAnswer, hinf_controller
from magbear_cli.lti.balancing import with_balanced_states, with_time_unit
from magbear_cli.lti.connection import lower_lft
from magbear_cli.lti.norm import hinf_norm
from magbear_cli.lti.state_space import StateSpace

DOUBLINGS = 40  # from 1 up to 1e12: a level beyond it means that nothing useful exists
BISECTIONS = 60  # enough for a bracket of 1e12 down to a relative 1e-6
AGREEMENT = 1.01  # a controller whose recomputed norm exceeds gamma by more is not believed


Measure = Callable[[StateSpace], float]


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


def search_gamma(
    plant: StateSpace,
    tolerance: float,
    *,
    start: float = 1.0,
    doublings: int = DOUBLINGS,
    measure: Measure | None = None,
) -> GammaSearch:
    """Double gamma until a candidate holds, then halve the bracket, keeping the best candidate seen.

    Parameters
    ----------
    plant : one measurement and one control, its last output and input; time and channels scaled by the caller
    tolerance : relative width of the last bracket
    start : the first gamma
    doublings : how often to double it in search of a first candidate
    measure : the norm of the loop of a controller, ∞ when it is not stable; by default that of the plant's own loop

    Notes
    -----
    A candidate counts only when its loop is stable and its recomputed norm is at most 1.01 gamma.

    Raises
    ------
    NumericsError
        when the plant lies outside the method.
    """
    measure = measure or (lambda controller: hinf_norm(lower_lft(plant, controller))[0])
    search, gamma = GammaSearch(), start
    for _ in range(doublings):
        _try(plant, gamma, search, measure)
        if search.best is not None:
            break
        gamma *= 2.0
    for _ in range(BISECTIONS):
        if search.best is None:
            break
        upper = min(search.best.norm, search.best.gamma)
        if upper - search.failed_gamma <= tolerance * upper:
            break
        _try(plant, 0.5 * (search.failed_gamma + upper), search, measure)
    return search


def with_unit_penalty(system: StateSpace) -> tuple[StateSpace, float]:
    """The plant with the current counted in the unit that makes D12 one, and that unit in A."""
    penalty = float(np.linalg.norm(system.d[:-1, -1]))
    unit_a = 1.0 / penalty if penalty > 0 else 1.0
    scale = np.ones(system.inputs)
    scale[-1] = unit_a
    return StateSpace(system.a, system.b * scale, system.c, system.d * scale), unit_a


def controller_in_si(controller: StateSpace, unit_rad_s: float, unit_a: float) -> StateSpace:
    """The controller found in scaled time and current, in rad/s and A."""
    current = StateSpace(controller.a, controller.b, unit_a * controller.c, unit_a * controller.d)
    return with_balanced_states(with_time_unit(current, 1.0 / unit_rad_s))


def _try(plant: StateSpace, gamma: float, search: GammaSearch, measure: Measure) -> None:
    """One solve at this gamma, closed, measured, and kept when it holds and is the best."""
    search.solves += 1
    answer = hinf_controller(plant.a, plant.b, plant.c, plant.d, measurements=1, controls=1, gamma=gamma)
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

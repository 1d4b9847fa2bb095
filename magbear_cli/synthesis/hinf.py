"""H-infinity mixed sensitivity: the least maximum over frequency of (|W1 S|² + |W3 T|²)^½ at the nominal mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from magbear_cli.errors import NumericsError, Status
from magbear_cli.kernels.hinf import HinfAnswer, hinf_controller, require_hinf_plant
from magbear_cli.lti.balancing import with_balanced_states, with_time_unit
from magbear_cli.lti.connection import lower_lft
from magbear_cli.lti.norm import hinf_norm
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.generalized_plant import Form, build_mixed_sensitivity_plant
from magbear_cli.model.problem import ControlProblem
from magbear_cli.synthesis.design import Design

DOUBLINGS = 40  # from 1 up to 1e12: a level beyond it means that nothing useful exists
BISECTIONS = 60  # enough for a bracket of 1e12 down to a relative 1e-6
AGREEMENT = 1.01  # a controller whose recomputed norm exceeds gamma by more is not believed


@dataclass(frozen=True)
class HinfOptions:
    """How close to the least level to stop, and which form of the third output to use.

    ``gamma_tolerance`` is the relative width of the last bracket. ``as_printed`` has the slip of the thesis's
    program A.2, which makes its example look harder than it is.
    """

    gamma_tolerance: float = 1e-3
    form: Form = "mended"

    def __post_init__(self) -> None:
        """Refuse a tolerance that bisection cannot reach."""
        if not 1e-6 <= self.gamma_tolerance < 1:
            raise NumericsError(f"gamma_tolerance must lie between 1e-6 and 1, not {self.gamma_tolerance}")


@dataclass(frozen=True, eq=False)
class _Candidate:
    """A controller whose loop was closed and measured, all in scaled units."""

    controller: StateSpace
    norm: float
    gamma: float
    rcond: float


@dataclass
class _Search:
    """The state of the bisection: the best controller, the highest level that failed, and why."""

    best: _Candidate | None = None
    failed_gamma: float = 0.0
    sentence: str = ""
    solves: int = 0


def design_hinf(problem: ControlProblem, options: HinfOptions | None = None) -> Design:
    """The controller with the least H-infinity norm of [W1 S; W3 T] for the rotor of nominal mass.

    ``level`` is the norm of the closed loop of the very matrices returned, recomputed from them; ``statistics`` holds
    the gamma they were computed with, the highest gamma that failed, the frequency of the norm, the norm of the mended
    form, the worst reciprocal condition number and the number of solves. Status ``ok`` means a level of at most one;
    ``not_achieved`` a level above one, with the controller all the same, or no stabilising candidate: neither is a
    proof of impossibility; ``failed`` that the problem lies outside the method, in the sentence's words.

    Notes
    -----
    Bisection on gamma at fixed levels (the thesis, section 3.2), each candidate accepted only when its loop is
    stable and its recomputed norm is at most 1.01 gamma. The plant is solved in units of time and current that bring
    its entries near one; order = 2 + the order of W1.
    """
    options = options or HinfOptions()
    try:
        plant = build_mixed_sensitivity_plant(problem, options.form)
        per_current, unit_a = _with_unit_penalty(plant.system)
        require_hinf_plant(per_current.a, per_current.b, per_current.c, per_current.d, measurements=1, controls=1)
        # The rotor's speed and the bandwidth limit span the frequencies that matter.
        unit_rad_s = float(np.sqrt(problem.natural_rad_s * (problem.omega_c_rad_s or problem.natural_rad_s)))
        search = _bisect(with_balanced_states(with_time_unit(per_current, unit_rad_s)), options.gamma_tolerance)
        if search.best is None:
            reason = f"no stabilising controller was found up to gamma = {2.0**DOUBLINGS:.0e}: {search.sentence}"
            return Design(None, Status.NOT_ACHIEVED, reason, statistics={"solves": search.solves})
        controller = _in_si(search.best.controller, unit_rad_s, unit_a)
        level, omega = hinf_norm(plant.closed_by(controller))
        mended, _ = hinf_norm(build_mixed_sensitivity_plant(problem).closed_by(controller))
    except NumericsError as error:
        return Design(None, Status.FAILED, str(error))
    statistics = {
        "gamma": search.best.gamma,
        "gamma_failed": search.failed_gamma,
        "norm_omega_rad_s": omega,
        "mixed_sensitivity_norm": mended,
        "rcond": search.best.rcond,
        "solves": search.solves,
    }
    status, sentence = _verdict(level, search.best.gamma)
    return Design(controller, status, sentence, level, statistics)


def _verdict(level: float, gamma: float) -> tuple[Status, str]:
    if not level <= AGREEMENT * gamma:
        return (
            Status.UNVERIFIED,
            f"gamma = {gamma:.4g}, but the loop of the controller in SI units has norm {level:.4g}",
        )
    if level > 1.0:
        return Status.NOT_ACHIEVED, f"the least gamma found is {level:.4g}: W1 and W3 are not met together (no proof)"
    return Status.OK, ""


def _with_unit_penalty(system: StateSpace) -> tuple[StateSpace, float]:
    """The plant with the current counted in the unit that makes D12 one, and that unit in A."""
    penalty = float(np.linalg.norm(system.d[:-1, -1]))
    unit_a = 1.0 / penalty if penalty > 0 else 1.0
    scale = np.ones(system.inputs)
    scale[-1] = unit_a
    return StateSpace(system.a, system.b * scale, system.c, system.d * scale), unit_a


def _in_si(controller: StateSpace, unit_rad_s: float, unit_a: float) -> StateSpace:
    current = StateSpace(controller.a, controller.b, unit_a * controller.c, unit_a * controller.d)
    return with_balanced_states(with_time_unit(current, 1.0 / unit_rad_s))


def _bisect(plant: StateSpace, tolerance: float) -> _Search:
    """Double gamma from one until a candidate holds, then halve the bracket, keeping the best candidate seen."""
    search, gamma = _Search(), 1.0
    for _ in range(DOUBLINGS):
        _try(plant, gamma, search)
        if search.best is not None:
            break
        gamma *= 2.0
    for _ in range(BISECTIONS):
        if search.best is None:
            break
        upper = min(search.best.norm, search.best.gamma)
        if upper - search.failed_gamma <= tolerance * upper:
            break
        _try(plant, 0.5 * (search.failed_gamma + upper), search)
    return search


def _try(plant: StateSpace, gamma: float, search: _Search) -> None:
    """One solve at this gamma, closed, measured, and kept when it holds and is the best."""
    search.solves += 1
    answer = hinf_controller(plant.a, plant.b, plant.c, plant.d, measurements=1, controls=1, gamma=gamma)
    candidate, sentence = _measured(plant, answer, gamma)
    if candidate is None:
        search.failed_gamma, search.sentence = max(gamma, search.failed_gamma), sentence
    elif search.best is None or candidate.norm <= search.best.norm:
        search.best = candidate


def _measured(plant: StateSpace, answer: HinfAnswer, gamma: float) -> tuple[_Candidate | None, str]:
    """The candidate with the norm its loop really has, or the reason to refuse it."""
    if not answer.is_solved:
        return None, answer.sentence
    controller = StateSpace(answer.a, answer.b, answer.c, answer.d)
    try:
        norm, _ = hinf_norm(lower_lft(plant, controller))
    except NumericsError as error:
        return None, str(error)
    if not norm <= AGREEMENT * gamma:
        word = "is unstable" if np.isinf(norm) else f"has norm {norm:.4g}"
        return None, f"the loop of the controller for gamma = {gamma:.4g} {word}"
    return _Candidate(controller, norm, gamma, float(answer.rcond.min())), ""

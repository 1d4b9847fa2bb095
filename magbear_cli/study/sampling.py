"""A controller of a case, sampled for a processor: judged anew with the plant held, and how slow it may be sampled."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from magbear_cli.analysis.gridless import LevelProof
from magbear_cli.analysis.margins import Margins
from magbear_cli.analysis.sampled_loop import (
    SampledLoop,
    is_stable_on_samples,
    sampled_margins,
    sampled_poles,
    sampled_worst_case,
)
from magbear_cli.analysis.sampled_proof import prove_sampled_level
from magbear_cli.analysis.worst_case import WorstCase
from magbear_cli.errors import NumericsError
from magbear_cli.lti.sampled_system import SampledSystem, bilinear
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.held_plant import Sampling
from magbear_cli.model.problem import ControlProblem
from magbear_cli.study.building import build_problem
from magbear_cli.study.outcome import CaseOutcome
from magbear_cli.study.proving import SPECIFIED
from magbear_cli.study.summary import plain_number

ROOM = 1.1  # times its own worst case may a loop lose that leaves no room below the specification
_TIGHT = (5e-4, 5e-3)  # above the worst case found: where a proof is sought, before the limit itself
_SEARCH_MASSES = 9
_HALVINGS = 24
_BISECTIONS = 12


@dataclass(frozen=True)
class SamplingOptions:
    """How to sample: Tustin's rule, prewarped at a frequency (0: nowhere).

    The delay runs from taking a sample to applying the current computed from it; None is one sample time. The limit is
    the largest worst case that is accepted; None is the specification, or a tenth above what the loop had.
    """

    sample_time_s: float
    delay_s: float | None = None
    prewarp_rad_s: float = 0.0
    limit: float | None = None

    @property
    def sampling(self) -> Sampling:
        """The times."""
        return Sampling(self.sample_time_s, self.sample_time_s if self.delay_s is None else self.delay_s)


@dataclass(frozen=True)
class SampledDesign:
    """A sampled controller and what is true of its loop at the sampling instants."""

    controller: SampledSystem
    sampling: Sampling
    prewarp_rad_s: float
    limit: float
    is_stable: bool  # on sample masses
    worst: WorstCase | None  # on sample members; None for a loop that is not stable
    worst_mass_kg: float | None  # of that member
    margins: Margins | None
    proof: LevelProof | None
    max_pole_modulus: float

    @property
    def is_accepted(self) -> bool:
        """Whether the limit is met: proven, for every mass and every frequency up to half the sampling frequency."""
        return self.proof is not None and self.proof.proved and self.proof.level <= self.limit

    @property
    def sentence(self) -> str:
        """What the check found."""
        if self.worst is None:
            return "the sampled loop is not stable for every mass"
        if self.worst.level > self.limit:
            return f"its sampled worst case is {self.worst.level:.4g}, above {self.limit:.4g}"
        return "no proof was sought" if self.proof is None else self.proof.sentence

    def document(self) -> dict[str, Any]:
        """The same as plain JSON."""
        margins, worst = self.margins, self.worst
        return {
            "sample_time_s": self.sampling.sample_time_s,
            "delay_s": self.sampling.delay_s,
            "prewarp_rad_s": self.prewarp_rad_s,
            "worst_case": None if worst is None else plain_number(worst.level),
            "worst_mass_kg": None if self.worst_mass_kg is None else plain_number(self.worst_mass_kg),
            "worst_omega_rad_s": None if worst is None else plain_number(worst.omega_rad_s),
            "worst_case_proven": self.proof.level if self.proof is not None and self.proof.proved else None,
            "gain_margin_low": None if margins is None else plain_number(margins.gain_low),
            "gain_margin_high": None if margins is None else plain_number(margins.gain_high),
            "phase_margin_deg": None if margins is None else plain_number(margins.phase_deg),
            "disk_margin": None if margins is None else plain_number(margins.disk),
            "delay_margin_s": None if margins is None else plain_number(margins.delay_s),
            "max_pole_modulus": plain_number(self.max_pole_modulus),
            "sentence": self.sentence,
        }


def problem_of(outcome: CaseOutcome) -> ControlProblem:
    """The problem that a case's controller answers; of a limit, that with the bandwidth limit it meets."""
    problem = build_problem(outcome.inputs)
    met = outcome.summary.omega_c_feasible_rad_s
    return problem if met is None else replace(problem, omega_c_rad_s=met)


def sample_design(outcome: CaseOutcome, options: SamplingOptions) -> SampledDesign:
    """The controller of a case, sampled, and its loop judged anew.

    Raises
    ------
    NumericsError
        when the case has no controller, or the controller cannot be sampled so.
    """
    problem, controller, limit = _asked(outcome, options)
    return _with_proof(problem, _judged(problem, controller, options, limit))


def slowest_sample_time(outcome: CaseOutcome, options: SamplingOptions) -> float | None:
    """The slowest sampling found below the given one that is accepted, in s and rounded down; None if none was found.

    A search on sample masses from fast to slow, whose answer is then proven. What lies between slower times that fail
    and this one was not looked at point by point.
    """
    problem, controller, limit = _asked(outcome, options)

    def does(sample_time_s: float) -> bool:
        try:
            own = replace(options, sample_time_s=sample_time_s)
            loop = SampledLoop(problem, bilinear(controller, sample_time_s, own.prewarp_rad_s), own.sampling)
        except NumericsError:
            return False
        return is_stable_on_samples(loop, _SEARCH_MASSES) and sampled_worst_case(loop, _SEARCH_MASSES).level < limit

    fails = options.sample_time_s
    for _ in range(_HALVINGS):
        works = 0.5 * fails
        if does(works):
            break
        fails = works
    else:
        return None
    for _ in range(_BISECTIONS):
        middle = float(np.sqrt(works * fails))
        works, fails = (middle, fails) if does(middle) else (works, middle)
    for digits in (3, 2, 1):
        rounded = _rounded_down(works, digits)
        if sample_design(outcome, replace(options, sample_time_s=rounded)).is_accepted:
            return rounded
    return None


def _asked(outcome: CaseOutcome, options: SamplingOptions) -> tuple[ControlProblem, StateSpace, float]:
    if outcome.controller is None:
        raise NumericsError(f"case {outcome.case_id} has no linear controller to sample")
    own = outcome.summary.worst_case
    had = SPECIFIED if own is None or not np.isfinite(own) else own
    limit = options.limit
    if limit is None:
        limit = max(SPECIFIED, had * ROOM)
    return problem_of(outcome), outcome.controller, limit


def _judged(problem: ControlProblem, controller: StateSpace, options: SamplingOptions, limit: float) -> SampledDesign:
    sampled = bilinear(controller, options.sample_time_s, options.prewarp_rad_s)
    loop = SampledLoop(problem, sampled, options.sampling)
    largest = max(float(np.abs(sampled_poles(loop, float(share))).max()) for share in problem.family.shares(33))
    stable = is_stable_on_samples(loop)
    worst = sampled_worst_case(loop) if stable else None
    return SampledDesign(
        sampled,
        options.sampling,
        options.prewarp_rad_s,
        limit,
        stable,
        worst,
        None if worst is None else problem.family.member(worst.share).mass_kg,
        sampled_margins(loop) if stable else None,
        None,
        largest,
    )


def _with_proof(problem: ControlProblem, design: SampledDesign) -> SampledDesign:
    """The design with the tightest proof that is found."""
    if design.worst is None or not design.worst.level < design.limit:
        return design
    loop = SampledLoop(problem, design.controller, design.sampling)
    levels = [min(design.worst.level * (1.0 + part), design.limit) for part in _TIGHT]
    proof = None
    for level in dict.fromkeys([*levels, design.limit]):
        proof = prove_sampled_level(loop, level)
        if proof.proved:
            break
    return replace(design, proof=proof)


def _rounded_down(value: float, digits: int) -> float:
    """The number with so many digits, not above it."""
    step = 10.0 ** (int(np.floor(np.log10(value))) - digits + 1)
    rounded = float(f"{np.floor(value / step) * step:.{digits - 1}e}")
    return rounded if rounded <= value else float(f"{(np.floor(value / step) - 1.0) * step:.{digits - 1}e}")

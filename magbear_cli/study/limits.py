"""Where linear control ends: the smallest bandwidth limit ω_c that is met, bracketed by two proofs.

Above the bracket a stored controller is proven to meet the specification for every mass and frequency; below it a
checked certificate proves that no linear controller does. Feasibility is monotone in ω_c, as W3 = s²/ω_c² only weakens.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from magbear_cli.analysis.gridless import LevelProof, prove_level
from magbear_cli.errors import NumericsError, Status
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem
from magbear_cli.study.outcome import ImpossibilityProof
from magbear_cli.study.proving import prove_bandwidth_impossible
from magbear_cli.synthesis.design import Design
from magbear_cli.synthesis.exact_mass import ExactMassContinuation, ExactMassOptions

_SHARE, _LEAST_ROOM, _MOST_ROOM = 0.08, 2e-4, 8e-4  # how far designs stay below the level: a share of the tolerance
_COARSE, _ORDER, _FINE_ORDER = 0.008, 14, 20  # above this tolerance 14 states lose too little to matter
_SLOPE = 0.68  # −d log level/d log ω_c near the limit of a typical bearing, to start the secant
_FARTHEST = 1e4  # times the start: a limit beyond it is reported as not there
_CLOSEST = 0.0018  # of ω_c: no certificate is sought closer to the met side, where each side's own loss is larger
_WIDTH_SHARE = 0.9  # of the tolerance: where the first certificate is sought


@dataclass(frozen=True)
class LimitOptions:
    """``tolerance``: relative width of the bracket that is good enough; ``level``: what is to be met.

    ``max_order``: states of the controllers at the frontier, None for as many as the tolerance asks for;
    ``most_designs``: designs at most.
    """

    tolerance: float = 0.01
    level: float = 1.0
    max_order: int | None = None
    most_designs: int = 12

    @property
    def order(self) -> int:
        """The states of the controllers."""
        if self.max_order is not None:
            return self.max_order
        return _ORDER if self.tolerance >= _COARSE else _FINE_ORDER

    @property
    def aim(self) -> float:
        """The level that designs aim at: below the one to be met by what the proof needs between its boxes."""
        return self.level * (1.0 - self._room)

    @property
    def close(self) -> float:
        """A level that is near enough to the one to be met."""
        return self.level * (1.0 - 2.0 * self._room)

    @property
    def _room(self) -> float:
        return min(max(_SHARE * self.tolerance, _LEAST_ROOM), _MOST_ROOM)


@dataclass(frozen=True)
class LimitBracket:
    """Both sides of the limit for one problem; a side that was not found is None, and the sentence says why.

    ``problem`` is the one asked about, its own ω_c aside. ``sentence`` is why the bracket is not as narrow as asked
    for; empty when it is.
    """

    problem: ControlProblem
    level: float
    sentence: str
    omega_c_feasible_rad_s: float | None = None
    controller: StateSpace | None = None
    worst_case: float = float("nan")
    proof: LevelProof | None = None
    omega_c_infeasible_rad_s: float | None = None
    impossibility: ImpossibilityProof | None = None
    designs: int = 0
    gaps_tried: int = 0

    @property
    def width(self) -> float:
        """The width of the bracket over its upper end; infinite where a side is missing."""
        if self.omega_c_feasible_rad_s is None or self.omega_c_infeasible_rad_s is None:
            return float("inf")
        return 1.0 - self.omega_c_infeasible_rad_s / self.omega_c_feasible_rad_s

    @property
    def met_problem(self) -> ControlProblem:
        """The problem at the met side, or as it was asked where there is none."""
        if self.omega_c_feasible_rad_s is None:
            return self.problem
        return replace(self.problem, omega_c_rad_s=self.omega_c_feasible_rad_s)

    def met_design(self) -> Design:
        """The controller of the met side as the answer of a method."""
        statistics = {"designs": float(self.designs), "gaps_tried": float(self.gaps_tried)}
        status = Status.NOT_ACHIEVED if self.controller is None else Status.OK
        return Design(self.controller, status, self.sentence, self.worst_case, statistics)


def bracket_limit(problem: ControlProblem, options: LimitOptions | None = None) -> LimitBracket:
    """The bracket [ω_c proven impossible, ω_c proven met] of a problem, whatever ω_c it comes with.

    The met side is found by a secant on the exact worst case over log ω_c, the other by certificates ever farther
    below.
    """
    options = options or LimitOptions()
    bracket = _feasible_side(problem, options)
    if bracket.omega_c_feasible_rad_s is None:
        return bracket
    return _infeasible_side(bracket, options)


@dataclass
class _Secant:
    """log ω_c against log level, from the designs so far."""

    points: list[tuple[float, float]] = field(default_factory=list)  # (log ω_c, log(level/aim)), by ascending ω_c

    def add(self, omega_c: float, excess: float) -> None:
        self.points = sorted([*self.points, (float(np.log(omega_c)), float(np.log(excess)))])

    def next(self) -> float:
        """The ω_c at which the level is expected to be met."""
        above = [point for point in self.points if point[1] > 0]
        below = [point for point in self.points if point[1] <= 0]
        if above and below:
            (x0, y0), (x1, y1) = above[-1], below[0]
            share = np.clip(y0 / (y0 - y1), 0.002, 0.998) if y0 > y1 else 0.5
            return float(np.exp(x0 + share * (x1 - x0)))
        x, y = (above or below)[-1 if above else 0]
        return float(np.exp(x + np.clip(1.02 * y / _SLOPE, -1.5, 1.5)))


def _feasible_side(problem: ControlProblem, options: LimitOptions) -> LimitBracket:
    start = _first_guess(problem)
    omega_c, secant, designs = start, _Secant(), 0
    continuation = ExactMassContinuation(ExactMassOptions(max_order=options.order, loss=0.0))
    best: tuple[float, Design] | None = None
    while designs < options.most_designs and start / _FARTHEST < omega_c < start * _FARTHEST:
        designs += 1
        try:
            near = bool(secant.points)
            design = continuation.design(
                replace(problem, omega_c_rad_s=omega_c), expected=options.aim if near else None, rough=not near
            )
        except NumericsError:
            omega_c *= 1.03
            continue
        secant.add(omega_c, design.level / options.aim)
        if design.level <= options.aim + 0.2 * (options.level - options.aim) and (best is None or omega_c < best[0]):
            best = omega_c, design
            if design.level >= options.close:
                break
        omega_c = secant.next()
    if best is None:
        sentence = f"no controller was found for any bandwidth limit up to {omega_c:.4g} rad/s"
        return LimitBracket(problem, options.level, sentence, designs=designs)
    omega_c, design = best
    if design.controller is None:
        raise NumericsError("an exact real-mass design came without a controller")
    proof = prove_level(replace(problem, omega_c_rad_s=omega_c), design.controller, options.level)
    if not proof.proved:
        return LimitBracket(problem, options.level, f"not verified: {proof.sentence}", designs=designs)
    return LimitBracket(
        problem,
        options.level,
        "no certificate was sought yet",
        omega_c_feasible_rad_s=omega_c,
        controller=design.controller,
        worst_case=design.level,
        proof=proof,
        designs=designs,
    )


def _first_guess(problem: ControlProblem) -> float:
    """Some tens of times the unstable pole, and faster than the frequency up to which W1 asks for |S| below one."""
    omega = np.geomspace(1e-3, 1e5, 400) * problem.natural_rad_s
    demanding = omega[problem.performance_bound(omega) > 1.0]
    return 4.0 * max(10.0 * problem.natural_rad_s, float(demanding.max(initial=0.0)))


def _infeasible_side(bracket: LimitBracket, options: LimitOptions) -> LimitBracket:
    """Certificates at the tolerance below the met side, then farther and farther, until one is checked."""
    gap = max(_WIDTH_SHARE * options.tolerance, _CLOSEST)
    nearest = prove_bandwidth_impossible(bracket.met_problem, options.level, gap)
    if nearest.proof is None:
        return replace(bracket, sentence="no certificate of impossibility was found", gaps_tried=nearest.tried)
    omega_c = (bracket.omega_c_feasible_rad_s or np.nan) * (1.0 - nearest.gap)
    answer = replace(
        bracket, omega_c_infeasible_rad_s=omega_c, impossibility=nearest.proof, gaps_tried=nearest.tried, sentence=""
    )
    if answer.width <= options.tolerance:
        return answer
    width = f"the bracket is {100.0 * answer.width:.2g} % wide"
    return replace(answer, sentence=f"{width}: no certificate closer to the met side was found")

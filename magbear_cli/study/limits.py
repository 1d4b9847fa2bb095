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
from magbear_cli.model.impossibility_certificate import fast_end_excess, without_certificate
from magbear_cli.model.problem import ControlProblem
from magbear_cli.study.outcome import ImpossibilityProof
from magbear_cli.study.proving import prove_bandwidth_impossible, prove_by_fast_end
from magbear_cli.synthesis.design import Design
from magbear_cli.synthesis.exact_mass import ExactMassContinuation, ExactMassOptions

_SHARE, _LEAST_ROOM, _MOST_ROOM = 0.08, 2e-4, 8e-4  # how far designs stay below the level: a share of the tolerance
_COARSE, _ORDER, _FINE_ORDER = 0.008, 16, 20  # above this tolerance 16 states lose too little to matter
_SLOPE = 0.68  # −d log level/d log ω_c near the limit of a typical bearing, to start the search
_JUMP = 5.0  # −d log level/d log ω_c that only a failed design shows
_SMALLEST_STEP = 1e-3  # in log ω_c
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
    most_designs: int = 24

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
        status = Status.OK
        if self.controller is None:
            status = Status.NOT_ACHIEVED if self.impossibility is None else Status.INFEASIBLE
        return Design(self.controller, status, self.sentence, self.worst_case, statistics)


def bracket_limit(problem: ControlProblem, options: LimitOptions | None = None) -> LimitBracket:
    """The bracket [ω_c proven impossible, ω_c proven met] of a problem, whatever ω_c it comes with.

    The met side is found by a bracketing search on the exact worst case over log ω_c, the other by certificates ever
    farther below.
    """
    options = options or LimitOptions()
    nowhere = prove_by_fast_end(problem, options.level)
    if nowhere is not None:
        return LimitBracket(problem, options.level, nowhere.sentence, impossibility=nowhere)
    if fast_end_excess(problem.performance, options.level) == 0:
        sentence = (
            f"|W1| is {options.level:.6g} at infinite frequency, where S = 1 with every proper controller:"
            " at no bandwidth limit is the specification met with room for a proof"
        )
        return LimitBracket(problem, options.level, sentence)
    bracket = _feasible_side(problem, options)
    if bracket.omega_c_feasible_rad_s is None:
        return bracket
    return _infeasible_side(bracket, options)


@dataclass
class _RootSearch:
    """The root of log(level/aim) over log ω_c: false position that halves a stale end, and bisects where it is slow.

    ``unmet`` and ``met`` are the nearest designs on both sides of the root, as (log ω_c, log(level/aim)). The Illinois
    rule halves the value of an end that two steps in a row have kept; where three steps have not halved the bracket,
    the next one bisects it. A rough design bounds nothing, it only says where to look.
    """

    unmet: tuple[float, float] | None = None
    met: tuple[float, float] | None = None
    hint: tuple[float, float] | None = None
    _weights: list[float] = field(default_factory=lambda: [1.0, 1.0])  # of the unmet and of the met end
    _kept: int = -1  # which end the last step replaced
    _widths: list[float] = field(default_factory=list)

    def add(self, omega_c: float, excess: float, *, rough: bool) -> None:
        """Take in a design: its ω_c and its level over the one aimed at."""
        point = (float(np.log(omega_c)), float(np.log(excess)))
        self.hint = point
        if rough:
            return
        side = int(point[1] <= 0)
        ends = [self.unmet, self.met]
        ends[side] = point
        self._weights[side] = 1.0
        if self._kept == side and ends[1 - side] is not None:
            self._weights[1 - side] *= 0.5
        self._kept = side
        self.unmet, self.met = ends
        if self.unmet and self.met:
            self._widths.append(self.met[0] - self.unmet[0])

    @property
    def width(self) -> float:
        """The log of the met ω_c over the unmet one; infinite where a side is missing."""
        return self.met[0] - self.unmet[0] if self.unmet and self.met else float("inf")

    @property
    def is_doubtful(self) -> bool:
        """Whether the level jumps across the bracket more than the true level can."""
        if not (self.unmet and self.met):
            return False
        return self.unmet[1] - self.met[1] > _JUMP * (self.width + _SMALLEST_STEP)

    def next(self) -> float:
        """The ω_c at which the level is expected to be met."""
        if self.unmet and self.met:
            (x0, y0), (x1, y1) = self.unmet, self.met
            y0, y1 = y0 * self._weights[0], y1 * self._weights[1]
            share = float(np.clip(y0 / (y0 - y1), 0.01, 0.99))
            if len(self._widths) > 3 and self._widths[-1] > 0.5 * self._widths[-4]:
                share, self._widths = 0.5, self._widths[-1:]
            return float(np.exp(x0 + share * (x1 - x0)))
        x, y = self.unmet or self.met or self.hint or (0.0, 0.0)
        step = np.clip(1.02 * y / _SLOPE, -1.5, 1.5)
        least = _SMALLEST_STEP if y > 0 else -_SMALLEST_STEP
        return float(np.exp(x + (step if abs(step) > abs(least) else least)))


def _feasible_side(problem: ControlProblem, options: LimitOptions) -> LimitBracket:
    found, designs, farthest = _search_met_side(problem, options)
    if found is None:
        sentence = f"no controller was found for any bandwidth limit up to {farthest:.4g} rad/s"
        return LimitBracket(problem, options.level, sentence, designs=designs)
    omega_c, design = found
    if design.controller is None:
        raise NumericsError("an exact real-mass design came without a controller")
    proof = prove_level(replace(problem, omega_c_rad_s=omega_c), design.controller, options.level)
    if not proof.proved:
        return LimitBracket(problem, options.level, f"not verified: {proof.sentence}", designs=designs)
    short = design.level < options.close
    return LimitBracket(
        problem,
        options.level,
        f"the met side stopped at a level of {design.level:.4g} after {designs} designs" if short else "",
        omega_c_feasible_rad_s=omega_c,
        controller=design.controller,
        worst_case=design.level,
        proof=proof,
        designs=designs,
    )


def _search_met_side(problem: ControlProblem, options: LimitOptions) -> tuple[tuple[float, Design] | None, int, float]:
    """The smallest ω_c with a design that meets the level and that design; how many were made; the last ω_c."""
    start = _first_guess(problem)
    omega_c, search, designs = start, _RootSearch(), 0
    fresh = ExactMassOptions(max_order=options.order, loss=0.0)
    continuation, best, again = ExactMassContinuation(fresh), None, None
    while designs < options.most_designs and start / _FARTHEST < omega_c < start * _FARTHEST:
        designs += 1
        rough = search.hint is None
        try:
            expected = None if rough else options.aim
            design = continuation.design(replace(problem, omega_c_rad_s=omega_c), expected=expected, rough=rough)
        except NumericsError:
            omega_c *= 1.03
            continue
        search.add(omega_c, design.level / options.aim, rough=rough)
        if design.level <= options.aim + 0.2 * (options.level - options.aim) and (best is None or omega_c < best[0]):
            best = omega_c, design
            if design.level >= options.close:
                break
        if search.is_doubtful and search.unmet is not None and again != search.unmet[0]:
            again = search.unmet[0]  # made once more, from nothing: it is the design that failed, not the problem
            continuation, omega_c = ExactMassContinuation(fresh), float(np.exp(again))
        elif search.width < _SMALLEST_STEP:
            break
        else:
            omega_c = search.next()
    return best, designs, omega_c


def _first_guess(problem: ControlProblem) -> float:
    """Some tens of times the unstable pole, and faster than the frequency up to which W1 asks for |S| below one."""
    omega = np.geomspace(1e-3, 1e5, 400) * problem.natural_rad_s
    demanding = omega[problem.performance_bound(omega) > 1.0]
    return 4.0 * max(10.0 * problem.natural_rad_s, float(demanding.max(initial=0.0)))


def _infeasible_side(bracket: LimitBracket, options: LimitOptions) -> LimitBracket:
    """Certificates at the tolerance below the met side, then farther and farther, until one is checked."""
    reason = without_certificate(bracket.met_problem)
    if reason:
        return replace(bracket, sentence="; ".join([*([bracket.sentence] if bracket.sentence else []), reason]))
    gap = max(_WIDTH_SHARE * options.tolerance, _CLOSEST)
    nearest = prove_bandwidth_impossible(bracket.met_problem, options.level, gap)
    said = [bracket.sentence] if bracket.sentence else []
    if nearest.proof is None:
        sentence = "; ".join([*said, "no certificate of impossibility was found"])
        return replace(bracket, sentence=sentence, gaps_tried=nearest.tried)
    omega_c = (bracket.omega_c_feasible_rad_s or np.nan) * (1.0 - nearest.gap)
    answer = replace(
        bracket, omega_c_infeasible_rad_s=omega_c, impossibility=nearest.proof, gaps_tried=nearest.tried, sentence=""
    )
    if answer.width <= options.tolerance:
        return answer
    said = said or ["no certificate closer to the met side was found"]
    return replace(answer, sentence=f"the bracket is {100.0 * answer.width:.2g} % wide: {'; '.join(said)}")

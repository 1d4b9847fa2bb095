"""The least worst case over a real mass range, over controllers of any order: one convex problem, solved by cones.

The level is brought down by Dinkelbach's iteration: at the level reached, find the (X, Y) with the widest margin in
units of the present right-hand sides; its own level, recomputed on a dense grid, is the next.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError, Status
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import worst_level
from magbear_cli.model.scaling import scale_problem
from magbear_cli.synthesis.design import Design
from magbear_cli.synthesis.exact_level import DENSE, exact_level
from magbear_cli.synthesis.fixed_order import best_lead
from magbear_cli.synthesis.frequency_span import UNLIMITED_BANDWIDTH, FrequencySpan, frequency_span, with_bandwidth
from magbear_cli.synthesis.half_plane_program import HalfPlaneProgram, Ratio
from magbear_cli.synthesis.lag_chain import ChainRatio
from magbear_cli.synthesis.lag_ratio import LagRatio
from magbear_cli.synthesis.near_integrator import raise_slow_poles
from magbear_cli.synthesis.peak import local_maxima
from magbear_cli.synthesis.stabilisation import stabilises

Floats = NDArray[np.float64]

_FASTEST_LAG = (
    5.0  # times the fastest of ω_c and the corners: faster lags gain nothing, slower ones cost 1 % of the level
)
_BETWEEN = 0.004  # of the level: how far a peak between the points of the dense grid may rise
_STEP = 2e-4  # of the level: an iteration that gains less is the last
_ROUGH_STEP = 5e-3  # the same for a level that only tells where to go next
_EXCHANGE = 3e-4  # of the level: a peak between grid points that is higher than this joins the grid
_FREE, _HELD = 7, 8  # most iterations with θ = 1, then with the present directions
_GRID = 90
_MET = 0.9996  # the level that meets the specification, less what a proof needs


@dataclass(frozen=True)
class ExactMassOptions:
    """``max_order``: most states of the controller, at least 2; ``loss``: part of the level that fewer may cost.

    With no loss allowed the controller has ``max_order`` states.
    """

    max_order: int = 12
    loss: float = 0.004

    def __post_init__(self) -> None:
        """Refuse an order that cannot hold a lead with roll-off."""
        if self.max_order < 2:
            raise NumericsError(f"max_order must be at least 2, not {self.max_order}")
        if not 0 <= self.loss < 1:
            raise NumericsError(f"loss must be a part of one, not {self.loss}")


def design_exact_mass(problem: ControlProblem, options: ExactMassOptions) -> Design:
    """The controller with the least max over masses and frequencies of |W1 S| + |W3 T|, of the order it needs.

    The level of the answer is recomputed from the controller's matrices. Without a bandwidth limit more gain always
    helps and no least level exists: the design is then that of a limit far above the fastest corner, and its sentence
    says so.

    Raises
    ------
    NumericsError
        when W1 is unbounded on the imaginary axis, or no cone program was solved.
    """
    return ExactMassContinuation(options).design(problem)


@dataclass(eq=False)
class ExactMassContinuation:
    """Designs for one bearing and range at one ω_c after another: each starts from the functions of the one before.

    The problems must agree but for ω_c. Near the answer three or four cone programs do what a start from a lead needs
    eight for; a start that leads nowhere is made again from the lead.
    """

    options: ExactMassOptions
    _lead: LagRatio | None = None
    _last: tuple[float, ChainRatio] | None = None  # the fast end of its span, and the controller there

    def design(self, problem: ControlProblem, *, expected: float | None = None, rough: bool = False) -> Design:
        """As ``design_exact_mass``.

        A good guess of the level that is expected saves cone programs; a rough design is left where one more program
        gains less than a part in two hundred.
        """
        weight = problem.performance
        if (weight.poles_rad_s.real >= 0).any() or len(weight.num) > len(weight.den):
            raise NumericsError("the performance weight must be stable and proper")
        limited = with_bandwidth(problem)
        raised = raise_slow_poles(limited)
        scaled, scaling = scale_problem(raised.problem)
        found, chosen = self._found(scaled, expected, rough=rough)
        controller = raised.lowered(scaling.controller(chosen.ratio.controller()))
        level = exact_level(problem, controller)
        statistics = {
            "cone_programs": float(sum(descent.solves for descent in found)),
            "level_before_reduction": min(descent.level for descent in found),
            "frequencies": float(chosen.omega.size),
        }
        sentences = []
        if limited is not problem:
            sentences.append(
                "without a bandwidth limit more gain always helps: designed for omega_c = "
                f"{limited.omega_c_rad_s:.4g} rad/s, {UNLIMITED_BANDWIDTH:g} times the fastest of the plant's pole and "
                "the weight's corners"
            )
        if level > 1.0:
            sentences.append(f"the least worst case found over controllers of any order is {level:.4g}, above 1")
        status = Status.NOT_ACHIEVED if level > 1.0 else Status.OK
        return Design(controller, status, "; ".join(sentences), level, statistics, claims_optimum=True)

    def _found(self, scaled: ControlProblem, expected: float | None, *, rough: bool) -> tuple[list[_Descent], _Descent]:
        """All descents and the one that is chosen, from the controller before or, where that fails, from the lead."""
        if self._lead is None:
            self._lead = best_lead(scaled)
        fast = frequency_span(scaled).fast
        for near in (*self._near(scaled, fast), None):
            start = _Start(self._lead, near, None if near is None else expected, rough=rough)
            try:
                found = list(_descents(scaled, self.options, start))
                chosen = _simplest(scaled, found, self.options.loss)
            except NumericsError:
                if near is None:
                    raise
                continue
            break
        self._last = fast, found[0].ratio
        return found, chosen

    def _near(self, scaled: ControlProblem, fast: float) -> list[ChainRatio]:
        """The controller before, moved to the new span if it still holds the rotor there, or else as it was.

        From one that does not hold the rotor the directions would lead to others that do not.
        """
        if self._last is None:
            return []
        before, ratio = self._last
        candidates = (_moved(ratio, fast / before), ratio)
        return [near for near in candidates if stabilises(scaled, near.controller())][:1]


def _moved(ratio: ChainRatio, factor: float) -> ChainRatio:
    """The controller with its crossover so many times as fast: up there the rotor is a double integrator."""
    return ChainRatio(ratio.poles * factor, ratio.x * factor**2, ratio.y)


def _simplest(scaled: ControlProblem, found: Sequence[_Descent], loss: float) -> _Descent:
    """The descent of the fewest states near the best, among those whose matrices do what their functions promised."""
    kept = [
        descent
        for descent, controller in ((descent, descent.ratio.controller()) for descent in found)
        if stabilises(scaled, controller) and exact_level(scaled, controller) <= descent.level * (1.0 + _BETWEEN)
    ]
    if not kept:
        raise NumericsError("the exact real-mass problem gave no controller whose own matrices reach its level")
    best = min(descent.level for descent in kept)
    enough = best * (1.0 + loss)
    if best <= _MET < enough:  # a specification that is met is not lost for the sake of a few states
        enough = _MET
    return min((d for d in kept if d.level <= enough), key=lambda d: d.ratio.poles.size)


@dataclass(frozen=True, eq=False)
class _Descent:
    """Where the iteration over one set of lags ended."""

    ratio: ChainRatio
    level: float
    omega: Floats
    solves: int


@dataclass(frozen=True, eq=False)
class _Start:
    """From where a descent starts: from the lead, or from a controller near the answer and the level expected there."""

    lead: LagRatio
    near: ChainRatio | None
    expected: float | None
    rough: bool

    @property
    def present(self) -> Ratio:
        """The controller to start from."""
        return self.lead if self.near is None else self.near

    def level(self, scaled: ControlProblem, omega: Floats) -> float:
        """The level to start with: what is expected, or what the controller reaches."""
        if self.expected is not None:
            return self.expected
        return float(worst_level(scaled, self.present.response(omega), omega)[0].max())


def _descents(scaled: ControlProblem, options: ExactMassOptions, start: _Start) -> Iterator[_Descent]:
    """The optimum over the most lags; then over fewer and fewer, from its directions, until the level suffers."""
    span = frequency_span(scaled)
    level = start.level(scaled, span.grid(DENSE, margin=1e4))
    program = HalfPlaneProgram(scaled, _lags(span, options.max_order), float(np.sqrt(span.fast)), start.lead)
    free_steps = _FREE if start.near is None else 0
    optimum = _descend(program, start.present, level, span.grid(_GRID), free_steps=free_steps, rough=start.rough)
    yield optimum
    last = optimum
    for order in range(options.max_order - 2, 1, -2) if options.loss else ():
        program = replace(program, poles=_lags(span, order))
        try:
            last = _descend(program, last.ratio, last.level, last.omega, free_steps=0, rough=start.rough)
        except NumericsError:
            return
        yield last
        if last.level > optimum.level * (1.0 + options.loss):
            return


def _lags(span: FrequencySpan, count: int) -> Floats:
    return np.geomspace(span.slow, _FASTEST_LAG * span.fast, count)


def _descend(
    program: HalfPlaneProgram, present: Ratio, level: float, omega: Floats, *, free_steps: int, rough: bool
) -> _Descent:
    """Bring the level down from that of the present controller until one more cone program gains next to nothing.

    Raises
    ------
    NumericsError
        when no step gave a controller that stabilises every mass.
    """
    dense = frequency_span(program.scaled).grid(DENSE, margin=1e4)
    best: ChainRatio | None = None
    target, solves = level, 0
    for turn in range(free_steps + _HELD):
        directions = program.free_directions if turn < free_steps else program.directions_of(present)
        try:
            candidate = program.widest_margin(present, directions(omega), omega, target)
        except NumericsError:
            break
        solves += 1
        reached = program.level(candidate, directions(dense), dense)
        peak, on_grid = float(reached.max()), float(program.level(candidate, directions(omega), omega).max())
        fresh = dense[local_maxima(reached, on_grid * (1.0 + _EXCHANGE))]
        fresh = fresh[~np.isin(fresh, omega)]
        omega = np.union1d(omega, fresh)
        if best is None and not np.isfinite(peak) and turn < free_steps:
            target *= 1.5
        elif (best is None and np.isfinite(peak)) or peak < target:
            small = best is not None and peak > target * (1.0 - (_ROUGH_STEP if rough else _STEP))
            best, present, target = candidate, candidate, peak
            if small and (rough or (turn >= free_steps and fresh.size == 0)):
                break
        elif fresh.size == 0 and turn >= free_steps:
            break
    if best is None:
        raise NumericsError("no controller over these lags was found that stabilises every mass")
    return _Descent(best, target, omega, solves)

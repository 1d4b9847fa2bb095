"""The least current that meets the specification: the optimum over very many poles, then a few that nearly have it.

The search works with the poles of the loop. First they are many and spread evenly; then few, fitted to the answer or
grown from fewer, and moved. What is handed on is recomputed from the controller's own matrices.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.structured_singular_value import mu_upper_bound
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.family import NOMINAL
from magbear_cli.model.filters import Prefilter
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import control_sensitivity, interconnection
from magbear_cli.synthesis.all_pass_sections import Sections
from magbear_cli.synthesis.control_set import Uncertainty
from magbear_cli.synthesis.current_bound import least_peak_bound
from magbear_cli.synthesis.current_search import MET, Candidate, CurrentSearch
from magbear_cli.synthesis.current_wish import CurrentWish
from magbear_cli.synthesis.descent import Responds
from magbear_cli.synthesis.exact_level import exact_level
from magbear_cli.synthesis.frequency_span import FrequencySpan, frequency_span, with_bandwidth
from magbear_cli.synthesis.peak import refined_peak
from magbear_cli.synthesis.pole_fit import fit_poles
from magbear_cli.synthesis.stabilisation import stabilises
from magbear_cli.synthesis.step_current import Instants, peak_step_current

Floats = NDArray[np.float64]

LOSS = 0.01  # of the current: the price of a simpler controller
_HIDDEN = 0.02  # of the current: what may hide between the points of the search; the matrices' own figure is reported
_PROVABLE = 0.9998  # of the level: what the matrices must keep to be proven without a grid
_CONSTRAINED, _DENSE = 100, 1200  # frequencies at first, and those that judge
_PER_DECADE = (20, 150)  # as many more of each a decade around the crossover
_FIRST_PAIRS, _PAIRS_PER_DECADE, _MOST_PAIRS = 16, 12.0, 34
_ROUGHLY = 3  # cone programs where the answer is only a start
_ORDERS = (2, 3, 4, 6, 8, 12)  # states to try in turn for the peak of |K S|, then in steps of four
_ENOUGH = 12  # states: beyond, the search goes on only while each attempt gains half of the loss
_STEP_ORDERS = (4, 8, 12)  # for a step, which needs more and has more local optima
_NEW_LAGS = (0.05, 0.5)  # of the crossover: where a grown controller gets its new poles


@dataclass(frozen=True)
class LeastCurrent:
    """A controller of the scaled problem and the current it takes, recomputed from its matrices.

    ``current`` is the peak of |K S|, or that of the current after a unit step; ``before_reduction`` the same for the
    optimum over ``order_before_reduction`` states. ``meets``: whether the specification is met with room for a proof.
    ``lower_bound``: no controller of any order that meets the specification takes less; not a number where there is
    none, for a step's current and where the search for one failed.
    """

    controller: StateSpace
    current: float
    level: float
    meets: bool
    before_reduction: float
    order_before_reduction: int
    solves: int
    lower_bound: float = float("nan")


@dataclass(frozen=True, eq=False)
class KnownController:
    """A controller known by its matrices, where a search asks for its response."""

    system: StateSpace

    def response(self, omega_rad_s: Floats) -> NDArray[np.complex128]:
        """K(jω), (w,)."""
        return frequency_response(self.system, omega_rad_s)[:, 0, 0]

    def controller(self) -> StateSpace:
        """The controller itself."""
        return self.system


def wished_current(scaled: ControlProblem, *, steps: bool, prefilter: Prefilter | None) -> CurrentWish:
    """The peak of |K S|, or with ``steps`` that of the current after a step through the (scaled) prefilter."""
    if not steps:
        return CurrentWish()
    span = frequency_span(with_bandwidth(scaled))
    fastest = span.fast if prefilter is None else 2.0 * prefilter.omega_rad_s
    return CurrentWish(Instants.between(max(fastest, span.fast), 0.3 * span.slow), prefilter, fastest)


def find_least_current(
    scaled: ControlProblem, uncertainty: Uncertainty, wish: CurrentWish, start: Responds, max_order: int
) -> LeastCurrent:
    """The controller of at most ``max_order`` states whose current is the least, or a hundredth above with fewer.

    ``start`` meets the specification with no more states, and is the answer where no better is found. Without a
    bandwidth limit none is imposed: bounded |K S| is one by itself, and a step's current counts a little of it.

    Raises
    ------
    NumericsError
        when no cone program was solved.
    """
    span = frequency_span(with_bandwidth(scaled))
    search = CurrentSearch(scaled, uncertainty, wish, span.grid(_DENSE, margin=1e4), span.grid(_CONSTRAINED))
    full, crossover = _over_many_poles(search, start, span)
    found: list[tuple[Candidate, LeastCurrent]] = []
    for candidate in _over_few_poles(search, full, crossover, max_order):
        answer = _recomputed(search, candidate, full)
        if answer is None:
            continue
        small = bool(found) and candidate.cost > found[-1][0].cost * (1.0 - LOSS / 2.0)
        found.append((candidate, answer))
        if answer.meets and full.level <= MET and candidate.cost <= full.cost * (1.0 + LOSS):
            break
        if small and answer.controller.order > _ENOUGH:
            break
    chosen = _chosen(found) or _as_it_is(search, start.controller(), full)
    if wish.kind == "step_current":
        return chosen
    bound = least_peak_bound(scaled, uncertainty, (0.7 * span.slow, 2.5 * crossover), chosen.current)
    return replace(chosen, solves=search.solves, lower_bound=bound or float("nan"))


def _chosen(found: Sequence[tuple[Candidate, LeastCurrent]]) -> LeastCurrent | None:
    """The answer of the fewest states near the least current, among those that meet the specification."""
    meeting = [answer for _, answer in found if answer.meets]
    least = min((answer.current for answer in meeting), default=np.inf)
    return next((answer for answer in meeting if answer.current <= least * (1.0 + LOSS)), None)


def _as_it_is(search: CurrentSearch, controller: StateSpace, full: Candidate) -> LeastCurrent:
    """The controller that the search began with."""
    current, level = peak_current(search.scaled, controller, search.wish), _level(search, controller)
    return _answer(search, (controller, current, level), full)


def _over_many_poles(search: CurrentSearch, start: Responds, span: FrequencySpan) -> tuple[Candidate, float]:
    """The optimum, and the highest frequency at which |T| is near one: first found roughly, then around it finely."""
    rough = search.settle(start, _even_pairs(0.3 * span.slow, span.fast, _FIRST_PAIRS), most=_ROUGHLY)
    crossover = _crossover(search, rough)
    low, high = 0.3 * span.slow, max(3.0 * crossover, search.wish.fastest)
    decades = float(np.log10(high / low))
    around = (0.1 * low, 2.0 * high)
    constrained, dense = (int(per_decade * (decades + 1.3)) for per_decade in _PER_DECADE)
    search.omega = np.union1d(search.omega, np.geomspace(*around, constrained))
    search.dense = np.union1d(search.dense, np.geomspace(*around, dense))
    pairs = int(np.clip(_PAIRS_PER_DECADE * decades, _FIRST_PAIRS, _MOST_PAIRS))
    return search.settle(rough.form, _even_pairs(low, high, pairs)), crossover


def _even_pairs(low: float, high: float, pairs: int) -> Sections:
    """Pairs of real poles, one twice the other, log-spaced."""
    speed = np.geomspace(low, high, pairs)
    return Sections(np.stack([3.0 * speed, 2.0 * speed**2], axis=1))


def _crossover(search: CurrentSearch, candidate: Candidate) -> float:
    omega = search.dense[np.isfinite(search.dense)]
    plant = search.scaled.plant(omega, NOMINAL)
    strong = omega[np.abs(plant * candidate.form.control_sensitivity(omega)) > 0.7]
    return float(strong.max(initial=1.0))


def _over_few_poles(search: CurrentSearch, full: Candidate, crossover: float, max_order: int) -> Iterator[Candidate]:
    """The best found with few states, then more and more, each at least as good as the one before.

    From the best of the fitted loops, and from the best that grew out of the one before; for the peak of |K S| the
    better of both is enough, and for a step the second is taken where it begins below, or at the last.
    """
    best: Candidate | None = None
    for order in _orders(search.wish, max_order):
        fitted = [(full, sections, _ROUGHLY) for sections in _fitted(search, full, crossover, order)]
        grown = []
        if best is not None:
            more = order + 2 - best.form.sections.order
            grown = [(best, _grown(best.form.sections, ratio * crossover, more), 1) for ratio in _NEW_LAGS]
        groups = [fitted + grown] if search.wish.kind == "ks_peak" else [fitted, grown]
        reached: list[Candidate] = []
        for group in groups:
            start = _best_start(search, group)
            if start is not None and (order == max_order or all(start.cost < other.cost for other in reached)):
                reached.append(search.polish(start))
        if reached:
            best = min(reached, key=lambda candidate: candidate.cost)
            yield best


def _orders(wish: CurrentWish, max_order: int) -> list[int]:
    few = _ORDERS if wish.kind == "ks_peak" else _STEP_ORDERS
    return [*(order for order in (*few, *range(16, max_order, 4)) if order < max_order), max_order]


def _best_start(search: CurrentSearch, starts: Sequence[tuple[Candidate, Sections, int]]) -> Candidate | None:
    """The best after a few cone programs and one large move, from these controllers over these poles."""
    tried = []
    for present, sections, most in starts:
        try:
            tried.append(search.nudge(search.settle(present.form, sections, most)))
        except NumericsError:
            continue
    return min(tried, key=lambda candidate: candidate.cost, default=None)


def _fitted(search: CurrentSearch, full: Candidate, crossover: float, order: int) -> Iterator[Sections]:
    """The poles of loops with a controller of this order that have nearly the K S of the optimum.

    An error of K S matters where it changes S by as much as W1 lets it, or is large beside the peak of |K S|, or, for a
    step, goes into the current.
    """
    low = float(np.sqrt(full.form.sections.quadratics[:, 1]).min())
    omega = np.geomspace(0.1 * low, 100.0 * crossover, 300)
    plant = np.abs(search.scaled.plant(omega, NOMINAL))
    values = full.form.control_sensitivity(omega)
    performance = 0.5 * plant * (1.0 + search.scaled.performance_bound(omega))
    start = Sections.of_poles(np.asarray(-np.geomspace(low, 10.0 * crossover, order + 2), dtype=np.complex128))
    yield fit_poles(values, performance + 1.0 / full.peak_ks, omega, start)
    if full.peak_step:
        yield fit_poles(values, performance + search.wish.weight(omega) / full.peak_step, omega, start)


def _grown(sections: Sections, pole: float, more: int) -> Sections:
    """The chain with some poles more."""
    for index in range(more):
        new = pole * 2.0**index
        if sections.lag is None:
            sections = Sections(sections.quadratics, new)
        else:
            pair = [[new + sections.lag, new * sections.lag]]
            sections = Sections(np.vstack([sections.quadratics, pair]))
    return sections


def _recomputed(search: CurrentSearch, candidate: Candidate, full: Candidate) -> LeastCurrent | None:
    """What the controller's matrices do; None where that is not what its functions promised."""
    controller = candidate.form.controller()
    if not stabilises(search.scaled, controller):
        return None
    level, current = _level(search, controller), peak_current(search.scaled, controller, search.wish)
    promised = candidate.peak_step if search.wish.kind == "step_current" else candidate.peak_ks
    if level > max(1.001 * candidate.level, _PROVABLE) or current > (1.0 + _HIDDEN) * promised:
        return None
    return _answer(search, (controller, current, level), full)


def _answer(search: CurrentSearch, reached: tuple[StateSpace, float, float], full: Candidate) -> LeastCurrent:
    steps = search.wish.kind == "step_current"
    return LeastCurrent(
        *reached,
        meets=reached[2] <= _PROVABLE,
        before_reduction=full.peak_step if steps else full.peak_ks,
        order_before_reduction=full.form.sections.order - 2,
        solves=search.solves,
    )


def peak_current(scaled: ControlProblem, controller: StateSpace, wish: CurrentWish) -> float:
    """The peak of |K S|, or of the current after a unit step, from the controller's matrices."""
    if wish.kind == "step_current":
        return peak_step_current(controller, wish.prefilter)
    omega = frequency_span(with_bandwidth(scaled)).grid(_DENSE, margin=1e4)

    def gain(points: Floats) -> Floats:
        return np.abs(control_sensitivity(scaled, frequency_response(controller, points)[:, 0, 0], points))

    return refined_peak(gain, omega)[0]


def _level(search: CurrentSearch, controller: StateSpace) -> float:
    if search.uncertainty == "real":
        return exact_level(search.scaled, controller)

    def mu(points: Floats) -> Floats:
        response = frequency_response(controller, points)[:, 0, 0]
        return np.asarray(mu_upper_bound(interconnection(search.scaled, response, points))[0])

    return refined_peak(mu, search.dense)[0]

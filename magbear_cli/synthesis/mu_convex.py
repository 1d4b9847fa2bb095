"""The best controller of any order by convex optimisation: exact for a real mass, or mu with complex blocks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError, Status
from magbear_cli.kernels.structured_singular_value import mu_upper_bound
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.reduction import balanced_residualization, balanced_truncation
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.filters import Prefilter
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import interconnection
from magbear_cli.model.scaling import Scaling, scale_problem
from magbear_cli.synthesis.current_design import KnownController, find_least_current, peak_current, wished_current
from magbear_cli.synthesis.current_search import AIM
from magbear_cli.synthesis.current_wish import CurrentWish
from magbear_cli.synthesis.descent import Responds
from magbear_cli.synthesis.design import Design
from magbear_cli.synthesis.dq_iteration import iterate_dq
from magbear_cli.synthesis.exact_mass import ExactMassOptions, design_exact_mass
from magbear_cli.synthesis.fixed_order import FixedOrderOptions, search_order
from magbear_cli.synthesis.frequency_span import frequency_span, with_bandwidth
from magbear_cli.synthesis.near_integrator import raise_slow_poles
from magbear_cli.synthesis.stabilisation import loop_resonances, stabilises

REDUCTION_LOSS = 0.003  # of the level: the price of a simpler controller that nobody will notice


@dataclass(frozen=True)
class MuConvexOptions:
    """What is sought.

    ``uncertainty``: the mass as the real number it is, or a complex block; ``max_order``: states at most;
    ``minimise``: the worst case (or mu) itself, or with it at one the peak of |K S|, or that of the linear nominal
    current after a step of the command through ``step_prefilter`` (None: unfiltered).
    """

    uncertainty: Literal["real", "complex"] = "real"
    max_order: int = 12
    minimise: Literal["worst_case", "ks_peak", "step_current"] = "worst_case"
    step_prefilter: Prefilter | None = None


def design_mu_convex(problem: ControlProblem, options: MuConvexOptions) -> Design:
    """The controller of any order with the least worst case (real mass), peak mu (complex blocks), or least current.

    The level of the answer is what was minimised: for the peak of |K S| in A/m, for a step's current in A per m of it.
    """
    if options.minimise == "worst_case":
        return _least_level(problem, options)
    if problem.family.is_fixed:  # mu of a known plant is its worst case
        options = replace(options, uncertainty="real")
    raised = raise_slow_poles(problem)
    scaled, scaling = scale_problem(raised.problem)
    prefilter = options.step_prefilter
    if prefilter is not None:
        prefilter = replace(prefilter, omega_rad_s=prefilter.omega_rad_s / scaling.omega_rad_s)
    wish = wished_current(scaled, steps=options.minimise == "step_current", prefilter=prefilter)
    lead = search_order(with_bandwidth(scaled), FixedOrderOptions(order=1, uncertainty=options.uncertainty))
    start: Responds = lead.controller
    if lead.level > AIM:
        best = _least_level(scaled, options)
        if best.controller is None or best.level > AIM:
            found = _without_room(best, wish, scaled, scaling)
            lowered = None if found.controller is None else raised.lowered(found.controller)
            return replace(found, controller=lowered)
        start = KnownController(best.controller)
    least = find_least_current(scaled, options.uncertainty, wish, start, options.max_order)
    statistics = {
        "cone_programs": float(lead.solves + least.solves),
        "level_before_reduction": least.before_reduction * scaling.gain_a_per_m,
        "order_before_reduction": float(least.order_before_reduction),
        "specification_level": least.level,
    }
    if np.isfinite(least.lower_bound):
        statistics["current_lower_bound"] = least.lower_bound * scaling.gain_a_per_m
    status, sentence = Status.OK, ""
    if not least.meets:
        status = Status.NOT_ACHIEVED
        sentence = f"no controller of at most {options.max_order} states was found that meets the specification"
    current = least.current * scaling.gain_a_per_m
    return Design(raised.lowered(scaling.controller(least.controller)), status, sentence, current, statistics)


def _without_room(best: Design, wish: CurrentWish, scaled: ControlProblem, scaling: Scaling) -> Design:
    """The scaled design of least worst case where the specification leaves no room for less current, or is not met."""
    if best.controller is None:
        return best
    controller = scaling.controller(best.controller)
    if best.status is not Status.OK:
        return replace(best, controller=controller)
    sentence = f"the specification is met at {best.level:.4g} at best: no room is left to take less current"
    current = peak_current(scaled, best.controller, wish) * scaling.gain_a_per_m
    return replace(best, controller=controller, sentence=sentence, level=current, claims_optimum=False)


def _least_level(problem: ControlProblem, options: MuConvexOptions) -> Design:
    """The least worst case over the real mass range, or the least peak mu with complex blocks."""
    if options.uncertainty == "real":
        return design_exact_mass(problem, ExactMassOptions(max_order=options.max_order))
    raised = raise_slow_poles(with_bandwidth(problem))
    scaled, scaling = scale_problem(raised.problem)
    start = search_order(scaled, FixedOrderOptions(order=1, uncertainty="complex"))
    optimum = iterate_dq(scaled, start.controller)
    full = optimum.controller.controller()
    controller, level = _simplest(scaled, full, optimum.level, options.max_order)
    statistics = {
        "cone_programs": float(start.solves + optimum.solves),
        "level_before_reduction": optimum.level,
        "order_before_reduction": float(full.order),
    }
    status, sentence = Status.OK, ""
    if level > 1.0:
        status = Status.NOT_ACHIEVED
        sentence = f"the least peak mu found over controllers of any order is {optimum.level:.4g}, above 1"
    return Design(raised.lowered(scaling.controller(controller)), status, sentence, level, statistics)


def _simplest(scaled: ControlProblem, full: StateSpace, level: float, max_order: int) -> tuple[StateSpace, float]:
    """The reduction of least order that keeps the level, or else the best of at most max_order; judged by mu anew."""
    omega = frequency_span(scaled).grid(600, margin=1e4)
    tried = [(level, full)] if full.order <= max_order else []
    for order in range(1, min(max_order, full.order - 1) + 1):
        for reduce in (balanced_residualization, balanced_truncation):
            try:
                candidate = reduce(full, order)
            except NumericsError:  # as many poles of the full controller are not stable
                continue
            reached = _peak_mu(scaled, candidate, omega)
            if reached <= level * (1.0 + REDUCTION_LOSS):
                return candidate, reached
            tried.append((reached, candidate))
    if not tried:
        raise NumericsError(f"the optimal controller has no reduction of order {max_order} or less")
    reached, candidate = min(tried, key=lambda pair: pair[0])
    return candidate, reached


def _peak_mu(scaled: ControlProblem, controller: StateSpace, omega: NDArray[np.float64]) -> float:
    """Peak mu, infinite where the reduced controller does not stabilise the loop."""
    if not stabilises(scaled, controller):
        return float("inf")
    omega = np.union1d(omega, loop_resonances(scaled, controller))
    response = frequency_response(controller, omega)[:, 0, 0]
    return float(mu_upper_bound(interconnection(scaled, response, omega))[0].max())

"""The simplest controller that meets the specification: orders 1, 2, 3, … until one does.

At each order there are two candidates: the direct search, which goes on from the best of the order before, and the
residualised reduction of the best controller of any order. The recomputed worst case decides between them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice

from magbear_cli.errors import NumericsError, Status
from magbear_cli.lti.reduction import balanced_residualization
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.scaling import scale_problem
from magbear_cli.synthesis.design import Design
from magbear_cli.synthesis.exact_level import exact_level
from magbear_cli.synthesis.exact_mass import ExactMassOptions, design_exact_mass
from magbear_cli.synthesis.fixed_order import FixedOrderOptions, design_fixed_order, search_orders
from magbear_cli.synthesis.frequency_span import with_bandwidth
from magbear_cli.synthesis.near_integrator import raise_slow_poles
from magbear_cli.synthesis.stabilisation import stabilises

MET = 0.9996  # the level that meets the specification, less what a proof between the frequencies needs


@dataclass(frozen=True)
class _Candidate:
    """A controller of the scaled problem, and its recomputed level."""

    controller: StateSpace
    level: float


def design_lowest_order(problem: ControlProblem, options: FixedOrderOptions, max_order: int) -> Design:
    """The controller of the fewest states that meets the specification, as ``options`` say but for its order.

    Its statistics hold the level found at every order tried, direct and reduced. An order that was passed over was not
    found to meet the specification, which does not prove that it cannot.
    """
    if problem.family.is_fixed:  # mu of a known plant is its worst case
        options = replace(options, uncertainty="real")
    raised = raise_slow_poles(with_bandwidth(problem))
    scaled, scaling = scale_problem(raised.problem)
    reductions = _Reductions(scaled)
    best: _Candidate | None = None
    statistics: dict[str, float] = {}
    for order, direct in enumerate(islice(search_orders(scaled, options), max_order), 1):
        found = [_Candidate(direct.controller.controller(), direct.level)]
        statistics |= {f"order_{order}_level": direct.level, "cone_programs": float(direct.solves)}
        if direct.level > MET and options.uncertainty == "real":
            reduced = reductions.of(order)
            if reduced is not None:
                statistics[f"order_{order}_reduced_level"] = reduced.level
                found.append(reduced)
        best = min([*found, *([best] if best is not None else [])], key=lambda candidate: candidate.level)
        if best.level > MET:
            continue
        if options.minimise == "ks_peak" and direct.level <= MET:
            least = design_fixed_order(problem, replace(options, order=order))
            return replace(least, statistics={**least.statistics, **statistics})
        return Design(raised.lowered(scaling.controller(best.controller)), Status.OK, "", best.level, statistics)
    if best is None:
        raise NumericsError("no order was asked for")
    sentence = f"no controller of order 1 to {max_order} was found that meets the specification"
    return Design(
        raised.lowered(scaling.controller(best.controller)),
        Status.NOT_ACHIEVED,
        f"{sentence}; the best, of order {best.controller.order}, reaches {best.level:.4g}",
        best.level,
        statistics,
    )


@dataclass(frozen=True)
class _Reductions:
    """The best controller of any order, designed once when it is first asked for, and its reductions."""

    scaled: ControlProblem

    @cached_property
    def optimum(self) -> StateSpace | None:
        try:
            return design_exact_mass(self.scaled, ExactMassOptions()).controller
        except NumericsError:
            return None

    def of(self, order: int) -> _Candidate | None:
        """The reduction to an order where there is one that stabilises every mass."""
        if self.optimum is None or self.optimum.order < order:
            return None
        try:
            reduced = balanced_residualization(self.optimum, order)
        except NumericsError:
            return None
        if reduced.order != order or not stabilises(self.scaled, reduced):
            return None
        return _Candidate(reduced, exact_level(self.scaled, reduced))

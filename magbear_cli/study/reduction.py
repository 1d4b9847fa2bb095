"""Order reduction of a finished design, the order chosen by what the loop reaches with the reduced controller."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from magbear_cli.analysis.frequency_grid import closed_frequency_grid
from magbear_cli.analysis.pole_family import pole_family
from magbear_cli.analysis.uncertain_loop import mu_study
from magbear_cli.analysis.worst_case import worst_case
from magbear_cli.errors import NumericsError, Status
from magbear_cli.lti.reduction import balanced_residualization, balanced_truncation, hankel_singular_values, least_order
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.table import Column, Table
from magbear_cli.synthesis.design import Design

REDUCE: Mapping[str, Callable[[StateSpace, int], StateSpace]] = {
    "truncation": balanced_truncation,
    "residualisation": balanced_residualization,
}
AS_GOOD = 1.01  # times the full controller's level: a reduced one that reaches this has lost nothing, where 1 is missed
POLE_MEMBERS = 17
POINTS_PER_DECADE = 30


@dataclass(frozen=True)
class _Reduced:
    """A reduced controller and what its loop reaches; infinite where it is not stable over the masses."""

    controller: StateSpace
    peak_mu: float
    worst_case: float


def reduce_design(problem: ControlProblem, design: Design, reduction: Mapping[str, Any]) -> Design:
    """The design with fewer states: so many, or with ``auto`` the fewest whose peak mu stays at most 1.

    Where the full controller itself is above 1, ``auto`` keeps within 1 % of its level. Tables: the Hankel singular
    values of the full controller, and what each order that was tried reaches.

    Raises
    ------
    NumericsError
        when the controller cannot be balanced.
    """
    if design.controller is None:
        return design
    full = design.controller
    values = hankel_singular_values(full)
    unstable = least_order(full)
    reached: dict[int, _Reduced] = {}
    if reduction["order"] == "auto":
        kept = _fewest(problem, full, REDUCE[reduction["method"]], reached, unstable)
    else:
        order = int(reduction["order"])
        if order < unstable:
            raise NumericsError(f"the controller has {unstable} poles that are not stable, which reduction keeps")
        kept = _tried(problem, full, REDUCE[reduction["method"]], min(order, full.order), reached)
    tables = {"hankel": _hankel(values), "reduction": _levels(reached)}
    return replace(
        design,
        controller=kept.controller,
        status=Status.OK,
        sentence="",
        level=kept.peak_mu,
        claims_optimum=False,
        statistics={**design.statistics, "order_before_reduction": float(full.order)},
        tables={**design.tables, **tables},
    )


def _fewest(
    problem: ControlProblem,
    full: StateSpace,
    reduce: Callable[[StateSpace, int], StateSpace],
    reached: dict[int, _Reduced],
    unstable: int,
) -> _Reduced:
    """Downwards from the full order until the level is missed twice: the smallest order that kept it.

    Hankel values tell nothing of the loop, so that an order may fail and the next smaller one succeed.
    """
    whole = _judged(problem, full)
    reached[full.order] = whole
    allowed = max(1.0, AS_GOOD * whole.peak_mu)
    best, misses = whole, 0
    for order in range(full.order - 1, unstable - 1, -1):
        found = _tried(problem, full, reduce, order, reached)
        if found.peak_mu <= allowed:
            best, misses = found, 0
        else:
            misses += 1
        if misses == 2:
            break
    return best


def _tried(
    problem: ControlProblem,
    full: StateSpace,
    reduce: Callable[[StateSpace, int], StateSpace],
    order: int,
    reached: dict[int, _Reduced],
) -> _Reduced:
    found = _judged(problem, full if order == full.order else reduce(full, order))
    reached[found.controller.order] = found
    return found


def _judged(problem: ControlProblem, controller: StateSpace) -> _Reduced:
    family = pole_family(problem, controller, problem.family.shares(POLE_MEMBERS))
    if family.certainly_unstable or not family.max_real_rad_s < 0.0:
        return _Reduced(controller, np.inf, np.inf)
    omega = closed_frequency_grid(problem, controller, POINTS_PER_DECADE)
    peak = mu_study(problem, controller, omega).peak_upper
    return _Reduced(controller, peak, worst_case(problem, controller, omega).level)


def _hankel(values: np.ndarray[Any, np.dtype[np.float64]]) -> Table:
    return Table(
        (
            Column("state", np.arange(1.0, values.size + 1.0), "1", "balanced state"),
            Column("hankel_singular_value_a_per_m", values, "A/m", "Hankel singular value"),
        ),
        "Hankel singular values of the full controller",
    )


def _levels(reached: Mapping[int, _Reduced]) -> Table:
    orders = sorted(reached)
    return Table(
        (
            Column("order", np.array(orders, dtype=float), "1", "states kept"),
            Column("peak_mu", np.array([reached[order].peak_mu for order in orders]), "1", "peak mu, complex blocks"),
            Column("worst_case", np.array([reached[order].worst_case for order in orders]), "1", "worst real mass"),
        ),
        "What the reduced controllers reach",
    )

"""How our cost grows: with cases, with frequencies, with the size of the basis, with the controller's order.

Each side is a point of a curve; its name is the curve's and the point's number. There is no peer in this row.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from magbear_cli.kernels.structured_singular_value import mu_upper_bound
from magbear_cli.lti.conversion import from_zeros_poles_gain
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.simulation.integration import integrate_fleet
from magbear_cli.simulation.loop import close_loop
from magbear_cli.synthesis.exact_mass import ExactMassOptions, design_exact_mass
from magbear_cli.synthesis.fixed_order import FixedOrderOptions, design_fixed_order
from tests.benchmarks.measuring import Prepared, Row, Side
from tests.benchmarks.problem import bearing, control_problem
from tests.benchmarks.rows.scalings import loop_matrices
from tests.benchmarks.rows.step import DURATION_S, MASSES_KG, SCENARIO, closed

SEPARATOR = ": "
CASES, FREQUENCIES, BASIS, ORDERS = (
    (1, 2, 4, 8, 16, 32, 64),
    (100, 300, 1000, 3000, 10000),
    (4, 6, 8, 10, 12, 14),
    (2, 5, 9, 17, 33),
)
CURVES = {
    "a simulated step, over cases at once": "falls as 1/cases while numpy's calls cost most, then levels at the flops",
    "mu and scalings, over frequencies": "linear: each frequency is by itself, in batches of numpy",
    "response of 33 states, over frequencies": "flat at first, the eigenvectors, then linear in the terms",
    "exact optimum, over the size of the basis": "a cone program costs size² × frequencies; how many are solved varies",
    "response at 2 000 points, over states": "linear in the terms, and the cube of the states for the eigenvectors",
    "a simulated step, over states": "nearly flat: numpy's calls cost most, then the exponentials with their cube",
}


def _prepare(tiny: bool) -> Prepared:  # noqa: FBT001 - the row's switch
    cases, frequencies, basis, orders = (
        (points[:2] if tiny else points) for points in (CASES, FREQUENCIES, BASIS, ORDERS)
    )
    matrices = loop_matrices(max(frequencies))
    problem, loops = control_problem(), [closed(mass) for mass in MASSES_KG]
    controllers = {order: _controller(order) for order in orders}
    names = iter(CURVES)
    sides = [
        *_curve(next(names), cases, lambda n: integrate_fleet(loops[:n], DURATION_S), per_case=True),
        *_curve(next(names), frequencies, lambda n: mu_upper_bound(matrices[:n])),
        *_curve(next(names), frequencies, lambda n: frequency_response(loops_controller(), np.geomspace(1.0, 1e6, n))),
        *_curve(next(names), basis, lambda n: design_exact_mass(problem, ExactMassOptions(max_order=n, loss=0.0))),
        *_curve(next(names), orders, lambda n: frequency_response(controllers[n], np.geomspace(1.0, 1e6, 2000))),
        *_curve(
            next(names),
            orders,
            lambda n: integrate_fleet([close_loop(bearing(), controllers[n], SCENARIO)], DURATION_S),
        ),
    ]
    return Prepared(
        sides, lambda _answers: {}, lambda _seconds: "; ".join(f"{name}: {why}" for name, why in CURVES.items())
    )


def loops_controller() -> StateSpace:
    """The controller of 33 states, read once."""
    from tests.benchmarks.problem import controller_of_33_states

    return controller_of_33_states()


def _curve(name: str, points: tuple[int, ...], run: Any, *, per_case: bool = False) -> list[Side]:  # noqa: ANN401
    return [Side(f"{name}{SEPARATOR}{n}", lambda n=n: run(n), amount=float(n) if per_case else 1.0) for n in points]  # type: ignore[misc]


def _controller(order: int) -> StateSpace:
    """A lead of one state that stabilises, followed by near cancellations up to 3e5 rad/s."""
    lead = design_fixed_order(control_problem(), FixedOrderOptions(order=1)).controller
    if lead is None:
        raise ValueError("there is no lead to begin with")
    more = order - 1
    poles = -np.geomspace(30.0, 3e5, more)
    from magbear_cli.lti.connection import series

    return series(lead, from_zeros_poles_gain(poles * 1.02, poles, 1.0)) if more else lead


ROW = Row("growth", "how cost grows", [], _prepare)

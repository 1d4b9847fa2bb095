"""The level of a controller's own matrices, narrow peaks included."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from magbear_cli.errors import Status
from magbear_cli.lti.connection import series
from magbear_cli.lti.conversion import from_transfer_function, from_zeros_poles_gain
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.model.robust_performance import worst_level
from magbear_cli.synthesis.exact_level import exact_level
from magbear_cli.synthesis.exact_mass import ExactMassOptions, design_exact_mass
from magbear_cli.synthesis.fixed_order import FixedOrderOptions, design_fixed_order

Peaked = Callable[[float, float], ControlProblem]
SHARP = [(300.0, 1e-3), (300.0, 1e-5), (3000.0, 1e-4)]


def _near(problem: ControlProblem, controller: StateSpace, place: float, damping: float) -> float:
    """The largest level on a fine grid around one resonance."""
    omega = place * (1.0 + damping * np.linspace(-30.0, 30.0, 60_001))
    return float(worst_level(problem, frequency_response(controller, omega)[:, 0, 0], omega)[0].max())


@pytest.fixture
def lead() -> StateSpace:
    """K = -7 764 165 (s + 72)/(s + 17 995)."""
    return from_transfer_function([-7_764_165.0, -7_764_165.0 * 72.0], [1.0, 17_995.0])


@pytest.mark.parametrize(("place", "damping"), [(300.0, 1e-2), *SHARP])
def test_peaks_of_the_weight_count(peaked_problem: Peaked, lead: StateSpace, place: float, damping: float) -> None:
    """The level of a controller that ignores the peak is that of a grid laid around it by hand."""
    peak = peaked_problem(place, damping).performance
    num, den = np.polydiv(np.polymul(peak.num, [2000.0]), [0.5, 50.0])[0], np.polydiv(peak.den, [1.0, 0.05])[0]
    weight = RationalWeight(tuple(num), tuple(np.polymul(den, [1.0, 200.0])))
    problem = replace(peaked_problem(place, damping), performance=weight)
    by_hand = _near(problem, lead, place, damping)
    assert by_hand > 0.6
    assert exact_level(problem, lead) == pytest.approx(by_hand, rel=1e-4)


@pytest.mark.parametrize("damping", [1e-3, 1e-5])
def test_peaks_of_the_controller_count(peaked_problem: Peaked, lead: StateSpace, damping: float) -> None:
    """A light zero with a pole beside it, where the controller holds back, is seen at its own frequency."""
    problem, place = replace(peaked_problem(3000.0, 1e-2), performance=RationalWeight.low_pass(10.0, 200.0)), 1000.0
    zero = place * (-damping + 1j)
    pole = place * (1.0 + 0.3 * damping) * (-20.0 * damping + 1j)
    pair = from_zeros_poles_gain([zero, zero.conjugate()], [pole, pole.conjugate()], 1.0)
    controller = series(pair, lead)
    by_hand = _near(problem, controller, place, damping)
    assert by_hand > 0.6
    assert exact_level(problem, controller) == pytest.approx(by_hand, rel=1e-4)


@pytest.mark.parametrize(("place", "damping"), SHARP)
@pytest.mark.parametrize("order", [None, 4])
def test_designs_meet_the_weight_at_its_peak(
    peaked_problem: Peaked, place: float, damping: float, order: int | None
) -> None:
    """With sharp peaks both designs reach 0.53, where a design that overlooks the peak is at 1.7 and more."""
    problem = peaked_problem(place, damping)
    if order is None:
        design = design_exact_mass(problem, ExactMassOptions())
    else:
        design = design_fixed_order(problem, FixedOrderOptions(order))
    assert design.status is Status.OK
    assert design.controller is not None
    assert design.level < 0.53
    assert _near(problem, design.controller, place, damping) <= design.level * (1.0 + 1e-4)


def test_the_level_of_a_fixed_order_holds_between_its_frequencies(peaked_problem: Peaked) -> None:
    """What is told of four states is the supremum over frequency, not the largest value on the grid of the search."""
    problem = peaked_problem(300.0, 1e-2)
    problem = replace(
        problem,
        performance=replace(problem.performance, num=(0.5, 80.0, 48e3, 4.5e6), den=(1.0, 6.05, 90_000.3, 4500.0)),
    )
    design = design_fixed_order(problem, FixedOrderOptions(4))
    assert design.controller is not None
    assert _near(problem, design.controller, 300.0, 1e-2) <= design.level * (1.0 + 1e-5)

"""Weights with a pole that stands for an integrator."""

from __future__ import annotations

import numpy as np
import pytest

from magbear_cli.analysis.gridless import prove_level
from magbear_cli.analysis.worst_case import worst_case
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.synthesis.exact_mass import ExactMassOptions, design_exact_mass
from magbear_cli.synthesis.fixed_order import FixedOrderOptions, design_fixed_order
from magbear_cli.synthesis.impossibility import find_impossibility
from magbear_cli.synthesis.lowest_order import design_lowest_order
from magbear_cli.synthesis.near_integrator import raise_slow_poles, with_slow_poles


def problem(epsilon_rad_s: float) -> ControlProblem:
    """3.0-4.5 kg, W1 = (0.5 s + 50)/(s + ε), ω_c = 20 000 rad/s."""
    weight = RationalWeight((0.5, 50.0), (1.0, epsilon_rad_s))
    return ControlProblem.of_mass(62_500.0, 50.0, (3.0, 4.5), weight, 20_000.0)


@pytest.mark.parametrize("epsilon_rad_s", [3e-5, 1e-6, 1e-8, 1e-12])
def test_the_answer_does_not_depend_on_the_pole(epsilon_rad_s: float) -> None:
    """Two states reach 0.5226, and designs of any order 0.522, for every ε: each is proven with its own weight."""
    own = problem(epsilon_rad_s)
    for design, least in (
        (design_fixed_order(own, FixedOrderOptions(2)), 0.5226),
        (design_exact_mass(own, ExactMassOptions()), 0.522),
    ):
        assert design.controller is not None
        assert design.level <= least
        assert worst_case(own, design.controller).level == pytest.approx(design.level, rel=1e-4)
        assert prove_level(own, design.controller, least).proved


def test_the_least_order_is_found_as_well() -> None:
    """The specification takes two states, whatever stands for the integrator."""
    design = design_lowest_order(problem(1e-9), FixedOrderOptions(), 3)
    assert design.controller is not None
    assert prove_level(problem(1e-9), design.controller, 1.0).proved


def test_no_controller_comes_much_below() -> None:
    """A certificate for the raised pole is one for a slower pole: none comes below 0.515."""
    found = find_impossibility(problem(1e-12), 0.515)
    assert found.certificate is not None


def test_a_weight_of_ordinary_corners_is_left_alone() -> None:
    """Nothing is raised where no pole is far below all else."""
    own = problem(1e-2)
    raised = raise_slow_poles(own)
    assert raised.problem is own
    controller = StateSpace.of([[-1.0]], [[1.0]], [[1.0]], [[0.0]])
    assert raised.lowered(controller) is controller


def test_the_raised_weight_is_nowhere_larger() -> None:
    """At high frequency it is the weight itself, at low frequency it is smaller."""
    own = problem(1e-9)
    raised = raise_slow_poles(own).problem
    omega = np.geomspace(1e-12, 1e6, 100)
    ratio = raised.performance_bound(omega) / own.performance_bound(omega)
    assert (ratio <= 1.0 + 1e-12).all()
    assert ratio[-1] == pytest.approx(1.0, rel=1e-9)


def test_slow_poles_move_and_residues_stay() -> None:
    """In mixed coordinates 1/(s + 1e-3) + 5/(s + 40) becomes 1/(s + 1e-9) + 5/(s + 40)."""
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(2, 2)))[0]
    a = turn @ np.diag([-1e-3, -40.0]) @ turn.T
    system = StateSpace.of(a, turn @ np.array([[1.0], [5.0]]), np.array([[1.0, 1.0]]) @ turn.T, [[0.3]])
    found = with_slow_poles(system, 1.0, 1e-6)
    omega = np.array([1e-10, 1e-3, 1.0, 50.0])
    expected = 1.0 / (1j * omega + 1e-9) + 5.0 / (1j * omega + 40.0) + 0.3
    assert frequency_response(found, omega)[:, 0, 0] == pytest.approx(expected, rel=1e-9)
    assert with_slow_poles(system, 1e-6, 0.5) is system

"""Least current over controllers of any order, and the few states that nearly have it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from magbear_cli.errors import Status
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.filters import Prefilter
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.model.robust_performance import control_sensitivity
from magbear_cli.synthesis.design import Design
from magbear_cli.synthesis.half_plane import complex_mu_level, real_mass_level
from magbear_cli.synthesis.mu_convex import MuConvexOptions, design_mu_convex
from magbear_cli.synthesis.step_current import peak_step_current

Maker = Callable[[float, float, float | None], ControlProblem]
OMEGA = np.geomspace(0.1, 1e7, 4000)
STEP_M = 10e-6


def _peak_ks(problem: ControlProblem, controller: StateSpace) -> float:
    response = frequency_response(controller, OMEGA)[:, 0, 0]
    return float(np.abs(control_sensitivity(problem, response, OMEGA)).max())


def _controller(design: Design) -> StateSpace:
    assert design.controller is not None
    return design.controller


def test_the_real_mass_takes_least_current(thrust_problem: Maker) -> None:
    """3.0-4.5 kg: at most 6.9 A per 10 µm within the specification, by few states, less than 3 % above the bound."""
    problem = thrust_problem(3.0, 4.5, None)
    design = design_mu_convex(problem, MuConvexOptions(minimise="ks_peak"))
    assert design.status is Status.OK
    response = frequency_response(_controller(design), OMEGA)[:, 0, 0]
    assert real_mass_level(problem, response, OMEGA).max() <= 0.9996
    assert design.level == pytest.approx(_peak_ks(problem, _controller(design)), rel=1e-3)
    assert design.level * STEP_M <= 6.9
    assert _controller(design).order <= 6
    assert design.level <= 1.03 * design.statistics["current_lower_bound"]
    assert not design.claims_optimum


def test_complex_blocks_take_less_than_was_known(thrust_problem: Maker) -> None:
    """3.0-3.5 kg: 6.0 A per 10 µm was known, below 5.75 A is reached with mu at one."""
    problem = thrust_problem(3.0, 3.5, None)
    design = design_mu_convex(problem, MuConvexOptions("complex", minimise="ks_peak"))
    response = frequency_response(_controller(design), OMEGA)[:, 0, 0]
    assert complex_mu_level(problem, response, OMEGA).max() <= 0.9997
    assert design.level * STEP_M <= 5.75
    assert 0.0 < design.statistics["current_lower_bound"] <= design.level


def test_holding_the_rotor_and_no_more_has_a_known_price() -> None:
    """With next to no specification the least peak of |K S| is 4 k_z/k_i, by a lead −4 (s + 1)/(s + 3) in own units."""
    problem = ControlProblem.of_mass(62500.0, 50.0, (3.6, 3.6), RationalWeight.low_pass(1e-3, 200.0))
    design = design_mu_convex(problem, MuConvexOptions(minimise="ks_peak"))
    assert design.level == pytest.approx(4.0 * 62500.0 / 50.0, rel=0.015)
    assert _controller(design).order == 2


def test_the_current_of_a_step_is_less_than_its_peak_gain_says(thrust_problem: Maker) -> None:
    """With four states at most, the step's current is that of the matrices, and below the least peak of |K S|."""
    problem = thrust_problem(3.0, 4.5, 2e4)
    options = MuConvexOptions(max_order=4, minimise="step_current", step_prefilter=Prefilter(2e4, 1.0))
    design = design_mu_convex(problem, options)
    assert design.status is Status.OK
    controller = _controller(design)
    assert controller.order <= 4
    response = frequency_response(controller, OMEGA)[:, 0, 0]
    assert real_mass_level(problem, response, OMEGA).max() <= 0.9997
    assert design.level * STEP_M <= 3.0
    natural, gain = problem.natural_rad_s, 62500.0 / 50.0
    scaled = StateSpace.of(controller.a / natural, controller.b / natural, controller.c / gain, controller.d / gain)
    assert design.level == pytest.approx(gain * peak_step_current(scaled, Prefilter(2e4 / natural, 1.0)), rel=1e-3)


@pytest.mark.parametrize("uncertainty", ["real", "complex"])
def test_where_the_specification_is_not_met_there_is_no_least_current(thrust_problem: Maker, uncertainty: str) -> None:
    """Far below the limit the design of least worst case is handed over, and says why."""
    options = MuConvexOptions("real" if uncertainty == "real" else "complex", 4, minimise="ks_peak")
    design = design_mu_convex(thrust_problem(3.0, 4.5, 4000.0), options)
    assert design.status is Status.NOT_ACHIEVED
    assert design.level > 1.0
    assert "above 1" in design.sentence
    assert design.claims_optimum == (uncertainty == "real")


def test_two_states_take_more(thrust_problem: Maker) -> None:
    """With two states at most the specification is still met, at a higher current."""
    problem = thrust_problem(3.0, 4.5, None)
    design = design_mu_convex(problem, MuConvexOptions(max_order=2, minimise="ks_peak"))
    assert _controller(design).order == 2
    assert design.status is Status.OK
    assert 6.9 <= design.level * STEP_M <= 8.2

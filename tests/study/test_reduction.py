"""A reduced design keeps what the loop had, and says what each order reaches."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from magbear_cli.errors import NumericsError, Status
from magbear_cli.lti.connection import parallel
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.study.judging import judge_loop
from magbear_cli.study.reduction import reduce_design
from magbear_cli.synthesis.design import Design
from magbear_cli.synthesis.fixed_order import FixedOrderOptions, design_fixed_order

PROBLEM = ControlProblem.of_mass(62_500.0, 50.0, (3.0, 4.5), RationalWeight.low_pass(10.0, 200.0), 20_000.0)


@pytest.fixture(scope="module")
def padded() -> Design:
    """A controller of one state that meets the specification, and three further states that hardly matter."""
    lead = design_fixed_order(PROBLEM, FixedOrderOptions(1, "complex")).controller
    assert lead is not None
    extra = StateSpace.of(np.diag([-3e3, -5e4, -2e5]), np.ones((3, 1)), [[30.0, 50.0, 80.0]], [[0.0]])
    return Design(parallel(lead, extra), Status.OK, level=0.5)


@pytest.mark.parametrize("method", ["truncation", "residualisation"])
def test_auto_finds_the_fewest_states(method: str, padded: Design) -> None:
    """States that hardly matter go, and the level stays below one."""
    design = reduce_design(PROBLEM, padded, {"order": "auto", "method": method})
    assert design.controller is not None
    assert design.controller.order <= 1
    assert design.level <= 1.0
    assert design.statistics["order_before_reduction"] == 4
    orders, levels = design.tables["reduction"]["order"], design.tables["reduction"]["peak_mu"]
    assert orders[-1] == 4
    assert levels[-1] == pytest.approx(levels[list(orders).index(1.0)], rel=0.05)
    assert (np.diff(design.tables["hankel"]["hankel_singular_value_a_per_m"]) <= 0.0).all()


def test_an_order_that_is_asked_for_is_given(padded: Design) -> None:
    """Whatever it does to the loop."""
    design = reduce_design(PROBLEM, padded, {"order": 0, "method": "truncation"})
    assert design.controller is not None
    assert design.controller.order == 0
    assert design.level == np.inf


def test_unstable_poles_are_not_taken_away() -> None:
    """An order below their number is refused with a sentence."""
    unstable = Design(StateSpace.of([[5.0]], [[1.0]], [[-1e6]], [[-1e4]]), Status.OK)
    with pytest.raises(NumericsError, match="not stable"):
        reduce_design(PROBLEM, unstable, {"order": 0, "method": "truncation"})


def test_no_controller_stays_none() -> None:
    """A design that gave up has nothing to reduce."""
    nothing = Design(None, Status.NOT_ACHIEVED, "none was found")
    assert reduce_design(PROBLEM, nothing, {"order": 1, "method": "truncation"}) is nothing


@pytest.mark.parametrize("name", ["reduce_integrator", "reduce_integrator_exact"])
def test_an_integrator_that_rounding_has_moved_costs_no_other_state(name: str) -> None:
    """A published rig's controller with its integrator at −1.25e-13 rad/s and at 0: peak S is 1.80."""
    current, gap = 1.0, 0.432e-3
    stiffness = 4.0 * 2.600303281978716e-06 * current / gap**2
    problem = ControlProblem.of_mass(
        stiffness * current / gap, stiffness, (1.6, 1.6), RationalWeight((0.1, 0.1), (1.0, 0.01)), None
    )
    matrices = json.loads((Path(__file__).parent / "inputs" / f"{name}.json").read_text(encoding="utf-8"))
    design = Design(StateSpace.of(*(matrices[key] for key in "abcd")), Status.OK)
    reduced = reduce_design(problem, design, {"order": 6, "method": "truncation"}).controller
    assert reduced is not None
    assert reduced.order == 6
    assert judge_loop(problem, reduced)[0].peak_sensitivity == pytest.approx(1.798, abs=1e-3)
    fewest = reduce_design(problem, design, {"order": "auto", "method": "truncation"}).controller
    assert fewest is not None
    assert fewest.order >= 1
    with pytest.raises(NumericsError, match="1 poles that are not stable"):
        reduce_design(problem, design, {"order": 0, "method": "truncation"})

"""The simplest controller: the fewest states that meet the specification, and none fewer that was found."""

from __future__ import annotations

import pytest

from magbear_cli.errors import Status
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.synthesis.exact_level import exact_level
from magbear_cli.synthesis.fixed_order import FixedOrderOptions
from magbear_cli.synthesis.lowest_order import MET, design_lowest_order
from magbear_cli.synthesis.stabilisation import stabilises


def thrust(omega_c_rad_s: float | None, high_kg: float = 4.5) -> ControlProblem:
    """The thesis's thrust bearing with 3.0 kg up to a mass."""
    weight = RationalWeight.low_pass(10.0, 200.0)
    return ControlProblem.of_mass(62_500.0, 50.0, (3.0, high_kg), weight, omega_c_rad_s)


def test_one_state_suffices_ten_per_cent_above_the_limit() -> None:
    """At 5 600 rad/s, where no linear controller meets 5 045, a lead meets the specification."""
    problem = thrust(5600.0)
    design = design_lowest_order(problem, FixedOrderOptions(), 6)
    assert design.status is Status.OK
    assert design.controller is not None
    assert design.controller.order == 1
    assert stabilises(problem, design.controller)
    assert exact_level(problem, design.controller) == pytest.approx(design.level, rel=1e-4)


def test_orders_that_are_passed_over_were_not_enough() -> None:
    """At 5 260 rad/s two states are needed: both candidates of order one stay above the level."""
    problem = thrust(5260.0)
    design = design_lowest_order(problem, FixedOrderOptions(), 6)
    assert design.controller is not None
    assert design.controller.order == 2
    assert design.statistics["order_1_level"] > MET
    assert design.statistics["order_1_reduced_level"] > MET
    assert design.statistics["order_2_level"] == pytest.approx(design.level)
    assert exact_level(problem, design.controller) < 1.0


def test_what_no_order_meets_is_not_achieved() -> None:
    """Below the limit the best found is handed over with its order and level, and nothing is called impossible."""
    design = design_lowest_order(thrust(4800.0), FixedOrderOptions(uncertainty="complex"), 2)
    assert design.status is Status.NOT_ACHIEVED
    assert design.controller is not None
    assert design.level > 1.0
    assert "order 1 to 2" in design.sentence
    assert f"reaches {design.level:.4g}" in design.sentence


def test_the_fewest_states_may_take_the_least_current() -> None:
    """With minimise ks_peak the order is the fewest that is enough, and the level is the peak of |K S|."""
    plain = design_lowest_order(thrust(20_000.0), FixedOrderOptions(), 3)
    least = design_lowest_order(thrust(20_000.0), FixedOrderOptions(minimise="ks_peak"), 3)
    assert plain.controller is not None
    assert least.controller is not None
    assert least.controller.order == plain.controller.order == 1
    assert abs(float(least.controller.d[0, 0])) < abs(float(plain.controller.d[0, 0]))
    assert least.level > 1e3  # A/m


def test_a_known_mass_is_real_whatever_is_asked() -> None:
    """Mu of one mass is its worst case."""
    asked = [design_lowest_order(thrust(9000.0, 3.0), FixedOrderOptions(1, kind), 2) for kind in ("real", "complex")]
    assert asked[0].level == asked[1].level

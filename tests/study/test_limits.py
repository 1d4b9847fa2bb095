"""The limit of linear control, bracketed between two proofs."""

from __future__ import annotations

from dataclasses import replace

import pytest

from magbear_cli.analysis.gridless import prove_level
from magbear_cli.model.problem import ControlProblem, MassRange, RationalWeight
from magbear_cli.study.limits import LimitBracket, LimitOptions, bracket_limit
from magbear_cli.study.proving import is_proof


def thrust(low_kg: float, high_kg: float) -> ControlProblem:
    """The thrust bearing with W1 = 2000/(s + 200), its ω_c left open."""
    return ControlProblem(62_500.0, 50.0, MassRange(low_kg, high_kg), RationalWeight.low_pass(10.0, 200.0))


@pytest.fixture(scope="module")
def bracket() -> LimitBracket:
    """3.0-4.5 kg, whose limit lies near 5075 rad/s."""
    return bracket_limit(thrust(3.0, 4.5), LimitOptions(tolerance=0.012, max_order=10))


def test_both_sides_are_proven_anew(bracket: LimitBracket) -> None:
    """The stored controller is proven at the upper end and the stored certificate at the lower, from their numbers."""
    assert bracket.controller is not None
    assert bracket.impossibility is not None
    met = replace(bracket.problem, omega_c_rad_s=bracket.omega_c_feasible_rad_s)
    assert prove_level(met, bracket.controller, bracket.level).proved
    impossible = replace(bracket.problem, omega_c_rad_s=bracket.omega_c_infeasible_rad_s)
    assert is_proof(impossible, bracket.impossibility)
    assert not is_proof(met, bracket.impossibility)


def test_the_bracket_is_narrow_and_where_prototypes_had_it(bracket: LimitBracket) -> None:
    """Within the tolerance, and the met side within 1 % of 5128 rad/s or below."""
    assert 0 < bracket.width <= 0.012
    assert bracket.omega_c_feasible_rad_s is not None
    assert 5000.0 < bracket.omega_c_feasible_rad_s < 5128.0 * 1.01
    assert bracket.sentence == ""
    assert bracket.worst_case < 1.0


def test_a_finer_tolerance_buys_a_narrower_bracket() -> None:
    """3.0-3.5 kg within 0.4 %, by more states than the usual tolerance takes."""
    answer = bracket_limit(thrust(3.0, 3.5), LimitOptions(tolerance=0.004))
    assert answer.width <= 0.004
    assert answer.sentence == ""
    assert answer.controller is not None
    assert answer.controller.order > LimitOptions().order


def test_a_tolerance_beyond_reach_is_admitted() -> None:
    """Asked for a bracket of 0.01 %, the search gives the one it has and says that nothing closer was found."""
    answer = bracket_limit(thrust(2.0, 2.0), LimitOptions(tolerance=1e-4, max_order=6))
    assert 1e-4 < answer.width < 0.05
    assert "no certificate closer" in answer.sentence


def test_a_specification_that_no_bandwidth_meets_has_no_met_side() -> None:
    """|W1(∞)| above one leaves |S| → 1 too large at high frequencies, whatever ω_c."""
    problem = replace(thrust(3.0, 3.5), performance=RationalWeight((1.5, 200.0), (1.0, 100.0)))
    answer = bracket_limit(problem, LimitOptions(max_order=4, most_designs=4))
    assert answer.omega_c_feasible_rad_s is None
    assert answer.width == float("inf")
    assert "no controller was found" in answer.sentence

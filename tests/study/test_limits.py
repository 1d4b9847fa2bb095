"""The limit of linear control, bracketed between two proofs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from magbear_cli.analysis.gridless import prove_level
from magbear_cli.errors import Status
from magbear_cli.model.bearing import Bearing, CurrentLaw, linearization
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.study.limits import LimitBracket, LimitOptions, _RootSearch, bracket_limit
from magbear_cli.study.proving import is_proof


def thrust(low_kg: float, high_kg: float) -> ControlProblem:
    """The thrust bearing with W1 = 2000/(s + 200), its ω_c left open."""
    return ControlProblem.of_mass(62_500.0, 50.0, (low_kg, high_kg), RationalWeight.low_pass(10.0, 200.0))


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
    assert "S = 1 with every proper controller" in answer.sentence


def reported(**change: object) -> ControlProblem:
    """A bearing with 62.5 kN/m and 50 N/A, 3.0-4.5 kg, with something changed."""
    return replace(thrust(3.0, 4.5), **change)  # type: ignore[arg-type]


def magnets(air_gap_m: float, force_constant: float, bias_a: float, law: CurrentLaw) -> tuple[float, float]:
    """The negative stiffness and the current stiffness at the middle of the gap."""
    linear = linearization(Bearing(air_gap_m, force_constant, bias_a, law))
    return linear.negative_stiffness_n_per_m, linear.current_stiffness_n_per_a


def test_the_search_does_not_stop_above_the_limit() -> None:
    """A problem whose search once stopped at 900.9 rad/s, 4.5 % above what an exact design of 24 states proves."""
    k_z, k_i = magnets(0.0005915954633761386, 2.8014463359757223e-06, 0.8535922775147478, CurrentLaw.HALF_SWITCHED)
    problem = ControlProblem.of_mass(
        k_z,
        k_i,
        (0.6763535324977643, 0.7539543755319933),
        RationalWeight((78939.30515125633,), (1.0, 370.7588298259607, 34048.22298069615)),
    )
    answer = bracket_limit(problem)
    assert answer.omega_c_feasible_rad_s is not None
    assert answer.omega_c_feasible_rad_s < 862.5 * 1.005
    assert answer.width <= 0.01
    assert answer.sentence == ""


def third_order() -> ControlProblem:
    """Two real poles and one more of W1, of three different speeds."""
    k_z, k_i = magnets(0.00028757988047183606, 2.0999664578686004e-05, 0.41679388757773383, CurrentLaw.FULL)
    weight = RationalWeight((91184580.41205037,), (1.0, 551.4569706365703, 36855.321140671265, 4837698.121102206))
    return ControlProblem.of_mass(k_z, k_i, (5.505326426236194, 11.822052539142241), weight)


@pytest.mark.parametrize(
    "problem",
    [
        third_order(),
        reported(performance=RationalWeight((4.0e5,), (1.0, 40.0, 4.0e4))),
        reported(performance=RationalWeight((2000.0, 0.0), (1.0, 200.0, 1.0e4))),
        reported(performance=RationalWeight((0.5, 600.0), (1.0, 60.0))),
    ],
    ids=["third order", "complex poles", "band-pass", "biproper"],
)
def test_every_kind_of_weight_has_a_narrow_bracket(problem: ControlProblem) -> None:
    """Brackets of 1 %, each side proven anew from its numbers."""
    answer = bracket_limit(problem)
    assert answer.width <= 0.01
    assert answer.impossibility is not None
    assert answer.controller is not None
    assert is_proof(replace(problem, omega_c_rad_s=answer.omega_c_infeasible_rad_s), answer.impossibility)
    assert prove_level(answer.met_problem, answer.controller, 1.0).proved


@pytest.mark.parametrize(
    ("weight", "reason"),
    [
        (RationalWeight((2000.0, 0.0, 2.0e7), (1.0, 300.0, 3.0e4, 1.0e6)), "imaginary axis, at 100 rad/s"),
        (RationalWeight((2.0e5, 0.0, 0.0), (1.0, 300.0, 3.0e4, 1.0e6)), "vanishes like s²"),
    ],
)
def test_a_weight_without_certificates_is_told_at_once(weight: RationalWeight, reason: str) -> None:
    """The met side stands, no certificate is sought, and the sentence says why there is none."""
    answer = bracket_limit(reported(performance=weight))
    assert answer.omega_c_feasible_rad_s is not None
    assert answer.omega_c_infeasible_rad_s is None
    assert answer.gaps_tried == 0
    assert reason in answer.sentence


def test_a_weight_above_the_level_at_high_frequency_is_infeasible_at_once() -> None:
    """|W1(∞)| = 1.2: no bandwidth limit helps, and the weight itself is the proof; at 1 there is no room for one."""
    problem = reported(performance=RationalWeight((1.2, 600.0), (1.0, 60.0)))
    answer = bracket_limit(problem)
    assert answer.designs == 0
    assert answer.met_design().status is Status.INFEASIBLE
    assert answer.impossibility is not None
    assert is_proof(problem, answer.impossibility)
    assert not is_proof(replace(problem, performance=RationalWeight((1.0, 600.0), (1.0, 60.0))), answer.impossibility)
    even = bracket_limit(reported(performance=RationalWeight((-1.0, 600.0), (1.0, 60.0))))
    assert (even.designs, even.impossibility, even.met_design().status) == (0, None, Status.NOT_ACHIEVED)
    assert "S = 1 with every proper controller" in even.sentence


def test_a_failed_design_does_not_hold_the_search() -> None:
    """The bracket shrinks to the root although one end's value is far off, and a jump is doubted."""
    search = _RootSearch()
    search.add(100.0, 3.0, rough=True)
    assert search.unmet is None
    search.add(100.0, 50.0, rough=False)
    search.add(200.0, 0.999, rough=False)
    assert search.is_doubtful
    for _ in range(12):
        omega_c = search.next()
        search.add(omega_c, 1.001 if omega_c < 150.0 else 0.999, rough=False)
    assert search.unmet is not None
    assert search.met is not None
    assert search.width < 0.005
    assert search.unmet[0] <= np.log(150.0) <= search.met[0]
    assert not search.is_doubtful

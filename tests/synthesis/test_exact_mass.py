"""The least worst case over a real mass range."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from magbear_cli.analysis.gridless import prove_level
from magbear_cli.errors import NumericsError, Status
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.model.robust_performance import worst_level
from magbear_cli.model.scaling import Scaling, scale_problem
from magbear_cli.synthesis.exact_level import exact_level
from magbear_cli.synthesis.exact_mass import ExactMassOptions, design_exact_mass
from magbear_cli.synthesis.fixed_order import FixedOrderOptions, design_fixed_order
from magbear_cli.synthesis.stabilisation import stabilises

ProblemMaker = Callable[[float, float, float | None], ControlProblem]

# The least worst case, from the cone program over 32 lags; the designs of at most 12 states come within 1 %.
LEAST = [
    (3.0, 4.5, 20_000.0, 0.3988),
    (3.0, 4.5, 10_000.0, 0.6345),
    (3.0, 4.0, 10_000.0, 0.6151),
    (3.0, 3.5, 7000.0, 0.7546),
]


@pytest.mark.parametrize(("low", "high", "omega_c", "least"), LEAST)
def test_the_designs_come_within_one_percent_of_the_optimum(
    thrust_problem: ProblemMaker, low: float, high: float, omega_c: float, least: float
) -> None:
    """At most 12 states are enough for 1 % of the least worst case of any order."""
    design = design_exact_mass(thrust_problem(low, high, omega_c), ExactMassOptions())
    assert design.status is Status.OK
    assert design.controller is not None
    assert design.controller.order <= 12
    assert least * 0.999 < design.level < least * 1.01


def test_the_level_is_that_of_the_stored_matrices(thrust_problem: ProblemMaker) -> None:
    """No frequency of another, denser grid shows a worst case above the level, and the loop is stable."""
    problem = thrust_problem(3.0, 4.5, 5200.0)
    design = design_exact_mass(problem, ExactMassOptions(max_order=8))
    assert design.controller is not None
    omega = np.concatenate([[0.0], np.geomspace(1e-3, 1e9, 40_001), [np.inf]])
    response = frequency_response(design.controller, omega)[:, 0, 0]
    worst = worst_level(problem, response, omega)[0].max()
    assert worst == pytest.approx(design.level, rel=1e-4)
    scaled, scaling = scale_problem(problem)
    back = Scaling(1.0 / scaling.omega_rad_s, 1.0 / scaling.gain_a_per_m)
    assert stabilises(scaled, back.controller(design.controller))


def test_a_level_above_one_is_not_achieved_and_says_so() -> None:
    """A fixed mass that asks too much gives the best controller, and the sentence that it is not enough."""
    weight = RationalWeight.low_pass(10.0, 200.0)
    problem = ControlProblem.of_mass(62_500.0, 50.0, (2.0, 2.0), weight, 4000.0)
    design = design_exact_mass(problem, ExactMassOptions(max_order=6))
    assert design.status is Status.NOT_ACHIEVED
    assert "above 1" in design.sentence
    assert design.controller is not None
    assert 1.07 < design.level < 1.09


def test_without_a_bandwidth_limit_the_sentence_names_the_one_designed_for(thrust_problem: ProblemMaker) -> None:
    """The level is that of the problem as posed, which is below that of the limit designed for."""
    design = design_exact_mass(thrust_problem(3.0, 4.5, None), ExactMassOptions(max_order=6))
    assert "omega_c" in design.sentence
    assert design.level < 0.21


def test_a_resonant_weight_and_another_bearing_are_no_special_case() -> None:
    """A biproper weight with a resonance, a light rotor in a strong field: the level holds on the stored matrices."""
    weight = RationalWeight((0.25, 106.0, 106.0**2), (1.0, 21.2, 106.0**2))
    problem = ControlProblem.of_mass(3.0e5, 120.0, (0.7, 1.1), weight, 1.0e4)
    design = design_exact_mass(problem, ExactMassOptions(max_order=8))
    assert design.controller is not None
    assert design.controller.order <= 8
    assert design.level == pytest.approx(exact_level(problem, design.controller), rel=1e-12)
    assert design.level < 0.5


def test_an_improper_or_unstable_weight_is_refused(thrust_problem: ProblemMaker) -> None:
    """What has no finite bound on the axis cannot be designed for."""
    problem = thrust_problem(3.0, 4.5, 1e4)
    for num, den in (((1.0, 1.0, 1.0), (1.0, 1.0)), ((1.0,), (1.0, 0.0))):
        wrong = replace(problem, performance=RationalWeight(num, den))
        with pytest.raises(NumericsError, match="stable and proper"):
            design_exact_mass(wrong, ExactMassOptions())


@pytest.mark.parametrize("options", [{"max_order": 1}, {"loss": -0.1}, {"loss": 1.0}])
def test_options_without_meaning_are_refused(options: dict[str, float]) -> None:
    """A controller has at least two states, and a loss is a part of the level."""
    with pytest.raises(NumericsError):
        ExactMassOptions(**options)  # type: ignore[arg-type]  # the wrong values are the point


@pytest.mark.parametrize("damping", [1e-3, 1e-5])
def test_a_narrow_peak_of_the_weight_is_designed_for(damping: float) -> None:
    """Unbalance at 300 rad/s: the level that a design believes is true within 1 %, and near that without the peak."""
    omega_0 = 300.0
    num = np.polymul([0.5, 50.0], [1.0, 2 * 20.0 * damping * omega_0, omega_0**2])
    den = np.polymul([1.0, 0.05], [1.0, 2 * damping * omega_0, omega_0**2])
    weight = RationalWeight(tuple(map(float, num)), tuple(map(float, den)))
    problem = ControlProblem.of_mass(62_500.0, 50.0, (3.0, 4.5), weight, 20_000.0)
    for design, least in (
        (design_exact_mass(problem, ExactMassOptions()), 0.53),
        (design_fixed_order(problem, FixedOrderOptions(4)), 0.65),
    ):
        assert design.controller is not None
        assert design.level < least
        omega = omega_0 * (1.0 + damping * np.linspace(-40.0, 40.0, 20_001))
        response = frequency_response(design.controller, omega)[:, 0, 0]
        assert worst_level(problem, response, omega)[0].max() < design.level * 1.01
        assert prove_level(problem, design.controller, design.level * 1.01).proved

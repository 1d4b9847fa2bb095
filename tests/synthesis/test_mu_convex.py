"""The best controllers of any order."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from magbear_cli.errors import Status
from magbear_cli.kernels.structured_singular_value import mu_bounds
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.model.robust_performance import interconnection
from magbear_cli.synthesis.mu_convex import MuConvexOptions, design_mu_convex

Maker = Callable[[float, float, float | None], ControlProblem]

# Optimal mu with complex blocks, found twice before by other means (D-K iteration, semidefinite programs).
OPTIMAL_MU = {(3.0, 4.5, 2e4): 0.512, (3.0, 4.5, 1e4): 0.721, (3.0, 4.0, 1e4): 0.678, (3.0, 3.5, 7e3): 0.783}


@pytest.mark.parametrize(("point", "optimum"), list(OPTIMAL_MU.items()))
def test_peak_mu_is_optimal_and_flat(thrust_problem: Maker, point: tuple[float, float, float], optimum: float) -> None:
    """Peak mu, from both bounds on the delivered matrices, is within 1 % of the optimum and flat within 2 %."""
    problem = thrust_problem(*point)
    design = design_mu_convex(problem, MuConvexOptions("complex"))
    assert design.status is Status.OK
    assert design.controller is not None
    assert design.controller.order <= 12
    omega = np.geomspace(1.0, 1e7, 1500)
    upper, lower = mu_bounds(interconnection(problem, frequency_response(design.controller, omega)[:, 0, 0], omega))
    assert upper.max() == pytest.approx(optimum, rel=0.01)
    assert lower.max() == pytest.approx(upper.max(), rel=1e-6)
    band = (omega >= 10.0) & (omega <= 1e5)
    assert upper[band].min() >= 0.98 * upper[band].max()


def test_fewer_states_are_allowed_to_cost_something(thrust_problem: Maker) -> None:
    """With two states at most the level rises a little and the order is kept."""
    problem = thrust_problem(3.0, 4.5, 2e4)
    design = design_mu_convex(problem, MuConvexOptions("complex", max_order=2))
    assert design.controller is not None
    assert design.controller.order <= 2
    assert 0.512 * 0.999 <= design.level <= 0.56


def test_out_of_reach_is_not_achieved(thrust_problem: Maker) -> None:
    """Where even the optimum is above 1 the best controller comes with the honest status."""
    design = design_mu_convex(thrust_problem(3.0, 4.5, 4000.0), MuConvexOptions("complex"))
    assert design.status is Status.NOT_ACHIEVED
    assert design.level > 1.0


def test_a_known_mass_takes_the_same_current_either_way() -> None:
    """Mu of one mass is its worst case, so that the kind of uncertainty makes no difference."""
    problem = ControlProblem.of_mass(62_500.0, 50.0, (3.0, 3.0), RationalWeight.low_pass(10.0, 200.0))
    designs = [design_mu_convex(problem, MuConvexOptions(kind, minimise="ks_peak")) for kind in ("real", "complex")]
    assert designs[0].level == designs[1].level
    assert 1e5 * 4.0 < designs[0].level < 1e5 * 5.0  # A/m

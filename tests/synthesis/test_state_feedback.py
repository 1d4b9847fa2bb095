"""State feedback: the poles, the vectors and the inequality that theory promises."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from magbear_cli.errors import NumericsError, Status
from magbear_cli.lti.connection import feedback
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.synthesis.lqg import rotor_matrices
from magbear_cli.synthesis.state_feedback import (
    EigenstructureOptions,
    LqrOptions,
    PolePlacementOptions,
    design_eigenstructure,
    design_lqr,
    design_pole_placement,
)


def problem(mass_kg: float = 2.2, current_stiffness: float = 50.0) -> ControlProblem:
    """The thrust bearing with a known rotor."""
    weight = RationalWeight.low_pass(10.0, 200.0)
    return ControlProblem.of_mass(62_500.0, current_stiffness, (mass_kg, mass_kg), weight)


def gains(statistics: dict[str, float]) -> list[float]:
    """k_p and k_d."""
    return [statistics["gain_position_a_per_m"], statistics["gain_speed_a_s_per_m"]]


def test_the_printed_gain_of_the_adaptive_chapter() -> None:
    """Two poles at −600 rad/s take K = [1.71e4, 52.8] for 2.2 kg and 50 N/A (Table 4.2), and twice that for 25."""
    full = design_pole_placement(problem())
    half = design_pole_placement(problem(current_stiffness=25.0))
    assert gains(dict(full.statistics)) == pytest.approx([1.709e4, 52.8], rel=1e-3)
    assert gains(dict(half.statistics)) == pytest.approx([2 * 1.709e4, 2 * 52.8], rel=1e-3)


@settings(deadline=None, max_examples=60)
@given(st.floats(0.1, 50.0), st.floats(10.0, 5000.0), st.floats(0.1, 3.0))
def test_the_poles_are_where_they_were_put(mass: float, omega: float, zeta: float) -> None:
    """The ideal loop has the poles asked for, and the real one has them too but for the differentiator's lag."""
    task = problem(mass)
    design = design_pole_placement(task, PolePlacementOptions(omega, zeta))
    a, b, c = rotor_matrices(task)
    ideal = np.poly(a - b @ np.array([gains(dict(design.statistics))]))
    assert ideal == pytest.approx([1.0, 2 * zeta * omega, omega**2], rel=1e-9)
    assert design.controller is not None
    loop = feedback(StateSpace(a, b, c, np.zeros((1, 1))), design.controller)
    slow = np.sort_complex(loop.poles()[np.argsort(np.abs(loop.poles()))[:2]])
    assert np.poly(slow) == pytest.approx([1.0, 2 * zeta * omega, omega**2], rel=0.02)


def test_eigenvalues_and_eigenvectors_are_assigned() -> None:
    """The loop has the eigenvalues; attainable vectors are attained; others are missed by the angle that is told."""
    values = ((-300.0, 400.0), (-300.0, -400.0))
    wishes = ((1.0, -300.0), (1.0, -300.0))
    task = problem()
    design = design_eigenstructure(task, EigenstructureOptions(values, wishes))
    a, b, _ = rotor_matrices(task)
    found = np.linalg.eigvals(a - b @ np.array([gains(dict(design.statistics))]))
    assert sorted(found.imag) == pytest.approx([-400.0, 400.0])
    assert found.real == pytest.approx([-300.0, -300.0])
    assert design.statistics["eigenvector_1_misfit"] > 0.1
    exact = design_eigenstructure(task, EigenstructureOptions())
    assert exact.statistics["eigenvector_1_misfit"] == pytest.approx(0.0, abs=1e-6)
    same = design_pole_placement(task, PolePlacementOptions(np.sqrt(500.0 * 700.0), 600.0 / np.sqrt(500.0 * 700.0)))
    assert gains(dict(exact.statistics)) == pytest.approx(gains(dict(same.statistics)), rel=1e-9)


@settings(deadline=None, max_examples=60)
@given(st.floats(1e-3, 1e3), st.floats(0.0, 1.0), st.floats(1e-12, 1e-3))
def test_lqr_keeps_away_from_the_critical_point(position: float, speed: float, current: float) -> None:
    """Kalman's inequality: the return difference of the ideal loop is at least one at every frequency."""
    task = problem()
    design = design_lqr(task, LqrOptions((position, speed), current))
    assume(design.status is Status.OK)  # the equation may be beyond double precision
    a, b, _ = rotor_matrices(task)
    k = np.array([gains(dict(design.statistics))])
    for omega in np.geomspace(1.0, 1e6, 60):
        loop = (k @ np.linalg.solve(1j * omega * np.eye(2) - a, b))[0, 0]
        assert abs(1.0 + loop) >= 1.0 - 1e-9


@settings(deadline=None, max_examples=30)
@given(st.floats(1.0, 1e6))
def test_no_differentiator_is_too_slow_to_stabilise(derivative: float) -> None:
    """With any pole of the differentiator the nominal loop is stable, as Routh's criterion has it."""
    design = design_pole_placement(problem(), PolePlacementOptions(600.0, 1.0, derivative))
    assert design.status is Status.OK
    assert design.statistics["slowest_pole_rad_s"] < 0.0


@pytest.mark.parametrize(
    "values", [((-1.0, 2.0), (-1.0, 2.0)), ((-1.0, 0.0), (-1.0, 3.0)), ((1.0, 0.0), (-1.0, 0.0)), ((-5.0, 0.0),) * 2]
)
def test_eigenvalues_of_no_loop_are_refused(values: tuple[tuple[float, float], ...]) -> None:
    """Eigenvalues must be real or a pair, stable and distinct."""
    with pytest.raises(NumericsError):
        EigenstructureOptions(values)

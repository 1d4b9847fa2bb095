"""M is the loop it stands for, and its mu is robust performance."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from magbear_cli.analysis.frequency_grid import closed_frequency_grid
from magbear_cli.analysis.loop_functions import controller_response, loop_functions
from magbear_cli.analysis.uncertain_loop import mu_flatness, mu_study
from magbear_cli.analysis.worst_case import worst_case
from magbear_cli.kernels.structured_singular_value import mu_bounds
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.generalized_plant import uncertainty_unit
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import interconnection, worst_level

ProblemMaker = Callable[[float, float, float | None], ControlProblem]
LeadMaker = Callable[[float, float, float], StateSpace]
OMEGA = np.geomspace(1.0, 1e6, 60)


def _closed_by_hand(problem: ControlProblem, response: complex, omega: float) -> NDArray[np.complex128]:
    """M column by column, by solving s² z = q/m + p, q = k_z z + k_i u, u = K y, y = z + d for z, u and q."""
    s = 1j * omega
    nominal = problem.nominal
    k_z, k_i = nominal.negative_stiffness_n_per_m, nominal.current_stiffness_n_per_a
    equations = np.array([[s**2, 0, -1 / nominal.mass_kg], [-response, 1, 0], [-k_z, -k_i, 1]])
    w1, w3 = problem.performance(s), s**2 / (problem.omega_c_rad_s or np.inf) ** 2
    columns = []
    for p, d in ((1.0, 0.0), (0.0, 1.0), (0.0, 1.0)):
        z, _, q = np.linalg.solve(equations, np.array([p, response * d, 0]))
        columns.append([uncertainty_unit(problem) * q, w1 * (z + d), w3 * z])
    return np.array(columns, dtype=complex).T


def at_infinity(problem: ControlProblem, controller: StateSpace) -> NDArray[np.complex128]:
    """M at ω = ∞."""
    return interconnection(problem, controller.d[0].astype(complex), np.array([np.inf]))


def test_the_matrix_is_the_loop_solved_by_hand(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """All nine entries, up to the scale of the mass channel, with the way from p to e3."""
    response = controller_response(good_lead, OMEGA)
    matrices = interconnection(quickstart, response, OMEGA)
    for matrix, k, omega in zip(matrices, response, OMEGA, strict=True):
        expected = _closed_by_hand(quickstart, k, omega)
        scale = 62_500.0 / 3.6
        expected[0, 1:] /= scale
        expected[1:, 0] *= scale
        np.testing.assert_allclose(matrix, expected, rtol=1e-7, atol=1e-12 * np.abs(expected).max())


def test_a_loop_with_another_mass_is_the_matrix_closed_with_its_delta(
    quickstart: ControlProblem, good_lead: StateSpace
) -> None:
    """M closed by δ gives W1 S and W3 T of the member with δ."""
    response = controller_response(good_lead, OMEGA)
    matrix = interconnection(quickstart, response, OMEGA)
    for share, delta in ((0.0, 1.0), (0.5, 0.0), (1.0, -1.0)):
        inner = delta / (1.0 - matrix[:, 0, 0] * delta)
        closed = matrix[:, 1:, 1] + matrix[:, 1:, 0] * (inner * matrix[:, 0, 1])[:, None]
        loop = loop_functions(quickstart, good_lead, OMEGA, share)
        np.testing.assert_allclose(closed[:, 0], quickstart.performance(1j * OMEGA) * loop.sensitivity[0], rtol=1e-8)
        weighted = quickstart.bandwidth_bound(OMEGA) * np.abs(loop.complementary_sensitivity[0])
        np.testing.assert_allclose(np.abs(closed[:, 1]), weighted, rtol=1e-8)


def test_for_a_known_mass_mu_is_the_weighted_sum(thrust_problem: ProblemMaker, good_lead: StateSpace) -> None:
    """The matrix of two blocks has rank one and mu = |W1 S| + |W3 T|; one block alone is |W1 S|."""
    for omega_c in (20_000.0, None):
        problem = thrust_problem(2.0, 2.0, omega_c)
        response = controller_response(good_lead, OMEGA)
        upper, lower = mu_bounds(interconnection(problem, response, OMEGA))
        expected, _ = worst_level(problem, response, OMEGA)
        np.testing.assert_allclose(upper, expected, rtol=1e-9)
        np.testing.assert_allclose(lower, expected, rtol=1e-9)


def test_mu_without_a_bandwidth_limit_has_two_blocks(thrust_problem: ProblemMaker, good_lead: StateSpace) -> None:
    """Mass and W1 remain."""
    problem = thrust_problem(3.0, 4.5, None)
    assert interconnection(problem, controller_response(good_lead, OMEGA), OMEGA).shape == (OMEGA.size, 2, 2)
    assert at_infinity(problem, good_lead).shape == (1, 2, 2)


def test_the_limit_at_infinity_is_approached(thrust_problem: ProblemMaker, good_lead: StateSpace) -> None:
    """The mu at 1e9 rad/s is that of the limit, though W3 and the way to the position go to their ends there."""
    for problem in (thrust_problem(3.0, 4.5, 20_000.0), thrust_problem(2.0, 2.0, 3_000.0)):
        far = np.array([1e9])
        upper, _ = mu_bounds(interconnection(problem, controller_response(good_lead, far), far))
        limit, _ = mu_bounds(at_infinity(problem, good_lead))
        assert limit[0] == pytest.approx(upper[0], rel=1e-4)


def test_mu_bounds_the_worst_case_of_the_real_mass(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """Below one, complex mu is above the exact worst case; both bounds of mu meet at the peak."""
    grid = closed_frequency_grid(quickstart, good_lead)
    study = mu_study(quickstart, good_lead, grid)
    exact, _ = worst_level(quickstart, controller_response(good_lead, grid), grid)
    assert np.all(study.upper >= exact * (1 - 1e-9))
    np.testing.assert_allclose(study.lower, study.upper, rtol=1e-6)
    assert study.peak_upper >= study.upper.max()
    assert study.peak_lower == pytest.approx(study.peak_upper, rel=1e-6)
    assert worst_case(quickstart, good_lead).level < study.peak_upper < 0.55


def test_a_first_order_lead_is_near_the_optimal_mu(quickstart: ControlProblem, lead: LeadMaker) -> None:
    """A lead is within 2.2 % of 0.512, the optimum over all orders, at 3.0-4.5 kg and 20 000 rad/s."""
    study = mu_study(quickstart, lead(8.98e6, 87.54, 19_800.0), np.geomspace(1e-1, 1e7, 400))
    assert study.peak_upper < 0.523
    assert study.peak_upper > 0.512


def test_flatness_is_one_minus_the_ratio(thrust_problem: ProblemMaker, good_lead: StateSpace) -> None:
    """Between 0 (flat) and 1, and the same by hand."""
    problem = thrust_problem(3.0, 4.5, 20_000.0)
    band = np.geomspace(10.0, 1e5, 241)
    upper, _ = mu_bounds(interconnection(problem, controller_response(good_lead, band), band))
    assert mu_flatness(problem, good_lead) == pytest.approx(1.0 - upper.min() / upper.max(), rel=1e-9)


def test_a_wider_mass_range_has_a_larger_mu(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """At the same nominal mass, mu rises with the deviation."""
    peaks = []
    for deviation in (0.01, 0.05, 0.09):
        mass = (1.0 / (1 / 3.6 + deviation), 1.0 / (1 / 3.6 - deviation))
        problem = ControlProblem.of_mass(62_500.0, 50.0, mass, quickstart.performance, 20_000.0)
        peaks.append(mu_study(problem, good_lead, np.geomspace(1.0, 1e6, 200)).peak_upper)
    assert peaks == sorted(peaks)

"""The worst case over the mass is exact, and its supremum misses no frequency."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from magbear_cli.analysis.frequency_grid import closed_frequency_grid
from magbear_cli.analysis.loop_functions import controller_response, loop_functions
from magbear_cli.analysis.verification import verify
from magbear_cli.analysis.worst_case import (
    peak_sensitivity,
    worst_case,
)
from magbear_cli.lti.conversion import from_transfer_function
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.model.robust_performance import worst_level, worst_sensitivity

ProblemMaker = Callable[[float, float, float | None], ControlProblem]


@settings(deadline=None, max_examples=60)
@given(
    seed=st.integers(0, 2**32 - 1),
    low=st.floats(0.1, 50.0),
    ratio=st.floats(1.0, 10.0),
    log_stiffness=st.floats(2.0, 8.0),
)
def test_no_mass_is_worse_than_the_closed_form(seed: int, low: float, ratio: float, log_stiffness: float) -> None:
    """Against brute force over 4001 masses, for any K(jω): never below, and equal at the mass it names."""
    problem = ControlProblem.of_mass(
        10**log_stiffness, 37.0, (low, low * ratio), RationalWeight.low_pass(10.0, 200.0), 5e3
    )
    generator = np.random.default_rng(seed)
    omega = 10 ** generator.uniform(-1, 5, size=12)
    response = 10 ** generator.uniform(2, 7, size=12) * np.exp(2j * np.pi * generator.uniform(size=12))
    level, share = worst_level(problem, response, omega)

    def direct(shares: NDArray[np.float64]) -> NDArray[np.float64]:
        gain = response * problem.plant(omega, shares)
        sensitivity = 1.0 / (1.0 - gain)
        first = problem.performance_bound(omega) * np.abs(sensitivity)
        return np.asarray(first + problem.bandwidth_bound(omega) * np.abs(gain * sensitivity))

    sampled = direct(problem.family.shares(4001)[:, None])
    assert np.all(level >= sampled.max(axis=0) * (1.0 - 1e-9))
    np.testing.assert_allclose(direct(share[None, :])[0], level, rtol=1e-7)
    assert np.all((share >= 0.0) & (share <= 1.0))


def test_the_worst_sensitivity_is_that_of_the_worst_mass(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """|S| at its worst over the range bounds |S| of 501 masses and equals the largest of them nearly."""
    omega = np.geomspace(10.0, 1e5, 50)
    loop = loop_functions(quickstart, good_lead, omega, quickstart.family.shares(501))
    worst, _ = worst_sensitivity(quickstart, loop.controller_a_per_m, omega)
    sampled = np.abs(loop.sensitivity).max(axis=0)
    assert np.all(worst >= sampled * (1 - 1e-12))
    np.testing.assert_allclose(worst, sampled, rtol=1e-4)


def test_the_lead_of_the_quickstart_has_its_published_level(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """Direct search gives 0.419 for first-order controllers of 3.0-4.5 kg at 20 000 rad/s."""
    worst = worst_case(quickstart, good_lead)
    assert worst.level == pytest.approx(0.4193, abs=2e-4)
    assert worst.share == 0.0


def test_the_supremum_is_that_of_a_very_dense_grid(quickstart: ControlProblem) -> None:
    """A narrow resonance in the controller is not missed."""
    for damping in (1e-2, 1e-4):
        num = np.polymul([-7.7e6, -7.7e6 * 72.0], [1.0, 4.0 * damping * 3000.0, 3000.0**2])
        den = np.polymul([1.0, 18_000.0], [1.0, 2.0 * damping * 3000.0, 3000.0**2])
        controller = from_transfer_function(num, den)
        dense = np.concatenate([np.geomspace(1.0, 1e6, 20_001), 3000.0 * (1 + damping * np.linspace(-30, 30, 20_001))])
        response = np.polyval(num, 1j * dense) / np.polyval(den, 1j * dense)
        sampled = worst_level(quickstart, response, dense)[0].max()
        level = worst_case(quickstart, controller).level
        assert sampled * (1 - 1e-6) <= level <= sampled * (1 + 1e-4)


def test_the_end_at_infinity_is_a_limit(thrust_problem: ProblemMaker, good_lead: StateSpace) -> None:
    """With a slow bandwidth limit the worst case of a lead is at ω → ∞, and is k_i |D|/(m_low ω_c²)."""
    problem = thrust_problem(3.0, 4.5, 2_000.0)
    worst = worst_case(problem, good_lead)
    assert worst.level >= 50.0 * 7_764_165.0 / (3.0 * 2_000.0**2) * (1 - 1e-12)
    far = worst_level(problem, np.array([-7_764_165.0 + 0j]), np.array([1e9]))[0][0]
    assert far == pytest.approx(50.0 * 7_764_165.0 / (3.0 * 2_000.0**2), rel=1e-6)


def test_a_known_mass_without_a_bandwidth_limit_has_only_w1_s(
    thrust_problem: ProblemMaker, good_lead: StateSpace
) -> None:
    """For a fixed mass and no W3 the worst case is the peak of |W1 S|, here at ω = 0: 10 k_z/|k_z + k_i K(0)|."""
    problem = thrust_problem(2.0, 2.0, None)
    dc = float(good_lead(0.0)[0, 0].real)
    worst = worst_case(problem, good_lead)
    assert worst.level == pytest.approx(10.0 * 62_500.0 / abs(62_500.0 + 50.0 * dc), rel=1e-9)
    assert (worst.share, worst.omega_rad_s) == (0.0, 0.0)


def test_an_integrator_has_a_worst_case(quickstart: ControlProblem) -> None:
    """A pole of the controller at zero makes no NaN: |W1 S| vanishes there."""
    controller = from_transfer_function([-7.7e6, -7.7e6 * 72.0, -7.7e6 * 72.0 * 5.0], [1.0, 18_000.0, 0.0])
    assert 0.3 < worst_case(quickstart, controller).level < 0.6


def test_the_peak_of_s_is_at_least_one(quickstart: ControlProblem) -> None:
    """S tends to one, so no controller has a smaller peak; without any the unstable plant has exactly one."""
    assert peak_sensitivity(quickstart, StateSpace.gain([[0.0]]), np.geomspace(1.0, 1e6, 50)).level == 1.0


@pytest.mark.parametrize(
    ("num", "den", "limit"),
    [((1.0,), (1.0, 1.0), 0.0), ((0.5, 1.0), (2.0, 1.0), 0.25), ((1.0, 0.0, 0.0), (1.0, 1.0), np.inf)],
)
def test_the_performance_bound_has_its_limit(
    quickstart: ControlProblem, num: tuple[float, ...], den: tuple[float, ...], limit: float
) -> None:
    """|W1(∞)| is zero, the ratio of leading coefficients, or infinite."""
    problem = replace(quickstart, performance=RationalWeight(num, den))
    assert problem.performance_at_infinity() == limit


@pytest.mark.parametrize("damping", [1e-3, 1e-4, 1e-5])
def test_a_narrow_peak_of_the_weight_is_not_stepped_over(damping: float) -> None:
    """Unbalance at 300 rad/s: the worst case is that of a grid about the peak as dense as the peak is narrow."""
    omega_0 = 300.0
    num = np.polymul([0.5, 50.0], [1.0, 2 * omega_0, omega_0**2])
    den = np.polymul([1.0, 0.05], [1.0, 2 * damping * omega_0, omega_0**2])
    weight = RationalWeight(tuple(map(float, num)), tuple(map(float, den)))
    problem = ControlProblem.of_mass(62_500.0, 50.0, (3.0, 4.5), weight, 20_000.0)
    lead = from_transfer_function([-6.0e6, -1.0e9], [1.0, 17_000.0])
    found = worst_case(problem, lead)
    omega = omega_0 * (1.0 + damping * np.linspace(-40.0, 40.0, 400_001))
    response = -(6.0e6j * omega + 1.0e9) / (1j * omega + 17_000.0)
    dense = worst_level(problem, response.astype(complex), omega)[0]
    assert found.level == pytest.approx(float(dense.max()), rel=1e-6)
    assert abs(found.omega_rad_s / omega_0 - 1.0) < damping


def test_a_narrow_peak_of_the_weight_is_seen(narrow_peak: ControlProblem, blind_to_the_peak: StateSpace) -> None:
    """The supremum is at the peak's own frequency and 4 % above what an even grid tells; figures show it too."""
    worst = worst_case(narrow_peak, blind_to_the_peak)
    assert worst.level == pytest.approx(0.60098, abs=2e-5)
    assert worst.omega_rad_s == pytest.approx(300.04, abs=0.02)
    assert worst.share == 1.0
    # the grid of figures: within a tenth of a half-width of the top a peak is within half a per cent of its height
    drawn = closed_frequency_grid(narrow_peak, blind_to_the_peak, 40)
    response = controller_response(blind_to_the_peak, drawn)
    assert worst_level(narrow_peak, response, drawn)[0].max() == pytest.approx(worst.level, rel=5e-3)


@pytest.mark.parametrize("damping", [1e-2, 1e-3, 1e-4, 1e-5])
@pytest.mark.parametrize("place", [300.0, 3000.0])
def test_a_peak_of_any_width_is_seen(
    quickstart: ControlProblem, blind_to_the_peak: StateSpace, damping: float, place: float
) -> None:
    """At every damping the worst case is that of a grid laid around the peak by hand."""
    num = np.polymul([0.5, 50.0], [1.0, 40.0 * damping * place, place**2])
    den = np.polymul([1.0, 0.05], [1.0, 2.0 * damping * place, place**2])
    problem = replace(quickstart, performance=RationalWeight(tuple(num), tuple(den)))
    omega = place * (1.0 + damping * np.linspace(-30.0, 30.0, 60_001))
    by_hand = worst_level(problem, controller_response(blind_to_the_peak, omega), omega)[0].max()
    assert by_hand > 0.6
    assert worst_case(problem, blind_to_the_peak).level == pytest.approx(by_hand, rel=1e-5)
    assert verify(problem, blind_to_the_peak, 2.0 * by_hand).worst_level == pytest.approx(by_hand, rel=1e-5)

"""The closed-loop poles are roots of the closed-loop polynomial, and the masses of every crossing are found."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.analysis.frequency_grid import frequency_grid
from magbear_cli.analysis.pole_family import axis_crossings, pole_family, real_response_frequencies
from magbear_cli.lti.conversion import from_transfer_function
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, RationalWeight

ProblemMaker = Callable[[float, float, float | None], ControlProblem]
GRID = np.geomspace(1e-2, 1e7, 600)


def test_the_poles_are_the_roots_of_the_polynomial(quickstart: ControlProblem) -> None:
    """They solve m s² a(s) − k_z a(s) − k_i n(s) = 0 for K = n/a, for each mass."""
    num, den = [-8e6, -6e8], [1.0, 2e4]
    family = pole_family(quickstart, from_transfer_function(num, den), [0.0, 1.0])
    for mass, poles in zip((3.0, 4.5), family.poles_rad_s, strict=True):
        inertia = np.polymul([mass, 0.0, -62_500.0], den)
        roots = np.roots(np.polysub(inertia, 50.0 * np.array([0.0, 0.0, *num])))
        np.testing.assert_allclose(poles, np.sort_complex(roots), rtol=1e-9)


def test_without_control_the_plant_falls(quickstart: ControlProblem) -> None:
    """The poles of the bare bearing are ±sqrt(k_z/m)."""
    family = pole_family(quickstart, StateSpace.gain([[0.0]]), [0.5])
    speed = np.sqrt(62_500.0 / 3.6)
    np.testing.assert_allclose(family.poles_rad_s[0], [-speed, speed], rtol=1e-12)
    assert family.certainly_unstable
    assert not family.certainly_stable


def test_a_stable_loop_is_certainly_stable(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """Its rounding errors are far smaller than its real parts."""
    family = pole_family(quickstart, good_lead, quickstart.family.shares(9))
    assert family.certainly_stable
    assert family.max_real_rad_s < 0
    assert np.all(family.uncertainty_rad_s < 1e-3)


def test_rounding_is_told_from_instability() -> None:
    """A double pole moves by the root of the rounding error; it is neither certainly stable nor unstable."""
    problem = ControlProblem.of_mass(1.0, 1.0, (1.0, 1.0), RationalWeight((1.0,), (1.0, 1.0)))
    family = pole_family(problem, StateSpace.gain([[-1.0]]), [0.0])
    assert not family.certainly_stable
    assert not family.certainly_unstable


def test_the_crossings_of_a_notch_bound_its_unstable_masses(thrust_problem: ProblemMaker, notch: StateSpace) -> None:
    """Stable at 2 and 8 kg, unstable between two masses: those are the crossings, and the poles there are imaginary."""
    problem = thrust_problem(2.0, 8.0, 20_000.0)
    crossings = axis_crossings(problem, notch, frequency_grid(problem, notch)).within(0.0, 1.0)
    assert crossings.shares.size == 2
    for share, omega in zip(crossings.shares, crossings.omega_rad_s, strict=True):
        poles = pole_family(problem, notch, [share]).poles_rad_s[0]
        assert np.abs(poles - 1j * omega).min() < 1e-6 * omega
    low, high = crossings.shares
    real = [pole_family(problem, notch, [share]).max_real_rad_s for share in (0.99 * low, 1.01 * low, 0.99 * high, 1.0)]
    assert [part > 0 for part in real] == [False, True, True, False]


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 2**32 - 1))
def test_stability_changes_with_the_mass_only_at_a_crossing(seed: int) -> None:
    """Over random controllers of order 4: the sign of the largest real part is the same between crossings."""
    generator = np.random.default_rng(seed)
    den = np.poly(-np.abs(generator.normal(size=4)) * 1000.0)
    num = -(10 ** generator.uniform(3, 7)) * np.real(np.poly(generator.normal(size=4) * 300.0 - 200.0)) / 10.0
    controller = from_transfer_function(num, den)
    problem = ControlProblem.of_mass(62_500.0, 50.0, (0.5, 20.0), RationalWeight.low_pass(10.0, 200.0))
    crossings = axis_crossings(problem, controller, GRID).within(0.0, 1.0).shares
    edges = np.concatenate([[0.0], crossings, [1.0]])
    for low, high in pairwise(edges):
        if high - low < 1e-4:
            continue
        shares = np.linspace(low + 1e-4 * (high - low), high - 1e-4 * (high - low), 7)
        unstable = [pole_family(problem, controller, [share]).max_real_rad_s > 0 for share in shares]
        assert len(set(unstable)) == 1


def test_a_lead_is_real_nowhere_between_zero_and_infinity(good_lead: StateSpace) -> None:
    """Im K of a lead has no zero; that of a lag with a lead has one."""
    assert real_response_frequencies(good_lead, GRID).size == 0
    lag_lead = from_transfer_function(np.poly([-10.0, -100.0]), np.poly([-1.0, -2000.0]))
    assert real_response_frequencies(lag_lead, GRID).size == 1


def test_two_crossings_between_grid_points_are_found(thrust_problem: ProblemMaker, notch: StateSpace) -> None:
    """On a grid that sees no sign change, the zeros of K(s) − K(−s) give both frequencies."""
    coarse = np.array([1.0, 300.0, 360.0, 1e5])
    fine = real_response_frequencies(notch, frequency_grid(thrust_problem(2.0, 8.0, None), notch))
    near = fine[(fine > 300.0) & (fine < 360.0)]
    assert near.size == 2
    np.testing.assert_allclose(real_response_frequencies(notch, coarse)[:2], near, rtol=1e-8)


def test_one_share_is_a_family(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """A single number is taken for the share."""
    assert pole_family(quickstart, good_lead, 0.5).poles_rad_s.shape == (1, 3)
    assert pole_family(quickstart, good_lead, 0.5).shares[0] == 0.5

"""What is verified holds; what does not hold is refused, with the reason."""

from __future__ import annotations

from collections.abc import Callable

import mpmath
import numpy as np
import pytest

from magbear_cli.analysis.pole_family import closed_loop_matrix
from magbear_cli.analysis.verification import response_disagreement, verify
from magbear_cli.analysis.worst_case import worst_case
from magbear_cli.lti.balancing import with_balanced_states
from magbear_cli.lti.connection import series
from magbear_cli.lti.conversion import from_transfer_function, from_zeros_poles_gain
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, RationalWeight

ProblemMaker = Callable[[float, float, float | None], ControlProblem]


def _with_mode(controller: StateSpace, speed: float) -> StateSpace:
    return StateSpace(
        np.block([[controller.a, np.zeros((1, 1))], [np.zeros((1, 1)), np.full((1, 1), speed)]]),
        np.vstack([controller.b, [[0.0]]]),
        np.hstack([controller.c, [[1.0]]]),
        controller.d,
    )


def test_a_good_controller_is_verified(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """The lead of 0.4193 meets 0.42 and does not meet 0.41; the level found is that of the closed form."""
    verdict = verify(quickstart, good_lead, 0.42)
    assert verdict.verified
    assert verdict.worst_level == pytest.approx(worst_case(quickstart, good_lead).level, rel=1e-8)
    refused = verify(quickstart, good_lead, 0.41)
    assert not refused.verified
    assert "exceeds" in refused.sentence


def test_the_tolerance_is_what_it_says(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """A claim one part in a thousand too low passes with that tolerance and not with a smaller one."""
    level = worst_case(quickstart, good_lead).level
    assert verify(quickstart, good_lead, level / 1.0005, tolerance=1e-3).verified
    assert not verify(quickstart, good_lead, level / 1.0005, tolerance=1e-4).verified


@pytest.mark.parametrize("gain", [0.0, 1e4, -1e3])
def test_an_unstable_loop_is_refused(quickstart: ControlProblem, gain: float) -> None:
    """Without enough control the rotor falls, and both counts say so."""
    verdict = verify(quickstart, StateSpace.gain([[gain]]), 100.0)
    assert not verdict.verified
    assert "pole" in verdict.sentence
    assert verdict.worst_level == np.inf


def test_a_spring_without_damping_is_refused(quickstart: ControlProblem) -> None:
    """Poles on the axis are not stable."""
    assert not verify(quickstart, StateSpace.gain([[-1e4]]), 1e9).verified


@pytest.mark.parametrize("speed", [5.0, 0.0])
def test_a_hidden_mode_that_does_not_decay_is_refused(
    quickstart: ControlProblem, good_lead: StateSpace, speed: float
) -> None:
    """The transfer function is the same; the controller as stored is not stable inside."""
    assert not verify(quickstart, _with_mode(good_lead, speed), 0.42).verified
    assert verify(quickstart, _with_mode(good_lead, -5.0), 0.42).verified


def test_an_unstable_mass_inside_the_range_is_refused(thrust_problem: ProblemMaker, notch: StateSpace) -> None:
    """Both ends of the range are stable and a mass between is not; either end alone passes."""
    assert not verify(thrust_problem(2.0, 8.0, None), notch, 1e9).verified
    light, heavy = (verify(thrust_problem(mass, mass, None), notch, 1e9) for mass in (2.0, 8.0))
    assert light.verified
    assert heavy.verified
    assert light.statistics["stable_below_kg"] == pytest.approx(2.42936, rel=1e-4)
    assert heavy.statistics["stable_above_kg"] == pytest.approx(5.49507, rel=1e-4)
    assert "stable_above_kg" not in light.statistics


def test_a_crossing_alone_refuses(thrust_problem: ProblemMaker, notch: StateSpace) -> None:
    """A range that ends just inside the unstable masses, by less than any sample sees, is refused by the crossing."""
    edge = 2.4293608
    assert verify(thrust_problem(2.0, edge * (1 - 1e-6), None), notch, 1e9).verified
    assert not verify(thrust_problem(2.0, edge * (1 + 1e-6), None), notch, 1e9).verified


def test_a_peak_between_the_samples_is_found(quickstart: ControlProblem) -> None:
    """A resonance of 0.01 % damping in the controller raises the level, and a claim without it is refused."""
    damping = 1e-4
    num = np.polymul([-7.7e6, -7.7e6 * 72.0], [1.0, 4.0 * damping * 3000.0, 3000.0**2])
    den = np.polymul([1.0, 18_000.0], [1.0, 2.0 * damping * 3000.0, 3000.0**2])
    controller = from_transfer_function(num, den)
    level = worst_case(quickstart, controller).level
    assert verify(quickstart, controller, level).verified
    assert not verify(quickstart, controller, 0.99 * level).verified


def test_a_known_mass_without_a_bandwidth_limit(thrust_problem: ProblemMaker, good_lead: StateSpace) -> None:
    """Only |W1 S| is judged."""
    problem = thrust_problem(2.0, 2.0, None)
    verdict = verify(problem, good_lead, 0.42)
    assert verdict.verified
    assert verdict.worst_level == pytest.approx(worst_case(problem, good_lead).level, rel=1e-9)


def test_an_integrator_is_judged(quickstart: ControlProblem) -> None:
    """A controller pole at zero that the loop moves is no obstacle."""
    controller = from_transfer_function([-7.7e6, -7.7e6 * 72.0, -7.7e6 * 72.0 * 5.0], [1.0, 18_000.0, 0.0])
    verdict = verify(quickstart, controller, 0.6)
    assert verdict.verified
    assert verdict.worst_level == pytest.approx(worst_case(quickstart, controller).level, rel=1e-6)


def test_the_level_at_infinity_counts(thrust_problem: ProblemMaker, good_lead: StateSpace) -> None:
    """With a slow bandwidth limit a lead's level is its limit at ω → ∞."""
    problem = thrust_problem(3.0, 4.5, 2_000.0)
    verdict = verify(problem, good_lead, 100.0)
    assert verdict.verified
    assert verdict.worst_level >= 50.0 * 7_764_165.0 / (3.0 * 2_000.0**2) * (1 - 1e-9)


def test_a_controller_of_high_order_is_judged_the_same(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """Thirty-two pole-zero pairs that nearly cancel, in a rotated basis, change nothing of the verdict."""
    generator = np.random.default_rng(4)
    poles = -(10 ** generator.uniform(1, 6, size=32))
    padded = series(from_zeros_poles_gain(poles * (1 + 1e-4), poles, 1.0), good_lead)
    padded = with_balanced_states(padded)
    basis = np.linalg.qr(generator.normal(size=(padded.order, padded.order)))[0]
    rotated = StateSpace.of(basis.T @ padded.a @ basis, basis.T @ padded.b, padded.c @ basis, padded.d)
    verdict = verify(quickstart, rotated, 0.43)
    assert verdict.verified, verdict.sentence
    assert verdict.worst_level == pytest.approx(0.4193, abs=2e-3)


def test_matrices_that_rounding_has_ruined_are_refused(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """Where two ways to evaluate K disagree, nothing is verified."""
    generator = np.random.default_rng(4)
    poles = -(10 ** generator.uniform(0, 7, size=24))
    padded = series(from_zeros_poles_gain(poles * 1.01, poles, 1.0), good_lead)
    basis = np.linalg.qr(generator.normal(size=(25, 25)))[0] * 10 ** generator.uniform(-6, 6, size=25)
    ruined = StateSpace.of(
        np.linalg.solve(basis, padded.a @ basis), np.linalg.solve(basis, padded.b), padded.c @ basis, padded.d
    )
    rounded = StateSpace(ruined.a.astype(np.float32).astype(float), ruined.b, ruined.c, ruined.d)
    assert response_disagreement(quickstart, good_lead, np.geomspace(1.0, 1e6, 50)) < 1e-9
    assert not verify(quickstart, rounded, 0.42).verified


@pytest.mark.parametrize("level", [np.nan, np.inf, 0.0, -1.0])
def test_a_claim_that_is_no_level_is_refused(quickstart: ControlProblem, good_lead: StateSpace, level: float) -> None:
    """Only a positive number can be verified."""
    assert not verify(quickstart, good_lead, level).verified


def test_a_controller_of_another_size_is_refused(quickstart: ControlProblem) -> None:
    """Two inputs make no loop."""
    assert "one measurement" in verify(quickstart, StateSpace.gain([[1.0, 2.0]]), 1.0).sentence


@pytest.mark.parametrize("mass", [0.1, 2.0, 50.0])
@pytest.mark.parametrize("air_gap_m", [2e-4, 1e-3])
def test_other_bearings_are_judged_as_well(mass: float, air_gap_m: float) -> None:
    """Over gaps and masses of real machines, verification and the closed form find the same worst case."""
    stiffness, force = 4 * 4e-6 * 0.25 / air_gap_m**3, 4 * 4e-6 * 0.5 / air_gap_m**2
    problem = ControlProblem.of_mass(stiffness, force, (mass, 1.4 * mass), RationalWeight.low_pass(10.0, 50.0))
    crossover = 20.0 * problem.natural_rad_s
    gain = problem.nominal.mass_kg * crossover * 8.0 * crossover / force
    controller = from_transfer_function([-gain, -gain * crossover / 5.0], [1.0, 8.0 * crossover])
    verdict = verify(problem, controller, 100.0)
    assert verdict.verified
    assert verdict.worst_level == pytest.approx(worst_case(problem, controller).level, rel=1e-7)


def _largest_real_part(problem: ControlProblem, controller: StateSpace, share: float) -> float:
    with mpmath.workdps(40):
        matrix = mpmath.matrix(closed_loop_matrix(problem, controller, share, 1.0).tolist())
        return max(float(mpmath.re(pole)) for pole in mpmath.eig(matrix, left=False, right=False))


@pytest.mark.parametrize("seed", range(16))
def test_forty_digits_agree_with_the_verdict(seed: int) -> None:
    """Over random loops with light, slow, hidden and unstable modes in bad units, no unstable one is verified."""
    generator = np.random.default_rng(seed)
    speed, mass, force = 10 ** generator.uniform(1, 3), 10 ** generator.uniform(-1, 1.7), 10 ** generator.uniform(0, 3)
    low_pass = RationalWeight.low_pass(10.0, 200.0)
    problem = ControlProblem.of_mass(mass * speed**2, force, (mass, 1.5 * mass), low_pass, 50.0 * speed)
    crossover = speed * 10 ** generator.uniform(0.3, 1.5)
    zero, pole = crossover * 10 ** generator.uniform(-1.5, 0.2), crossover * 10 ** generator.uniform(-0.1, 1.5)
    controller = from_zeros_poles_gain([-zero], [-pole], -mass * crossover * pole / force)
    place, damping = crossover * 10 ** generator.uniform(-2, 2), 10 ** generator.uniform(-4, -0.5)
    light = place * np.array([-damping + 1j, -damping - 1j])
    extra = [
        from_zeros_poles_gain(light * (1 + generator.normal() * 0.1), light, 1.0),
        from_zeros_poles_gain([place * (1 + 1e-6)], [place], 1.0),
        from_zeros_poles_gain([-speed / 10.0], [0.0], 1.0),
        StateSpace.gain([[1.0]]),
    ][seed % 4]
    controller = series(extra, controller)
    units = 10 ** generator.uniform(-3, 3, controller.order)
    stored = StateSpace(
        controller.a * units / units[:, None], controller.b / units[:, None], controller.c * units, controller.d
    )
    truth = max(_largest_real_part(problem, stored, float(share)) for share in problem.family.shares(3))
    verdict = verify(problem, stored, 1e9)
    assert verdict.verified == (truth < 0), (truth, verdict.sentence)


def test_an_integrator_in_another_basis_is_judged(quickstart: ControlProblem) -> None:
    """A rotation leaves a pole of 1e-10 rad/s where the integrator was; it is taken for what it is."""
    controller = with_balanced_states(
        from_transfer_function([-7.7e6, -7.7e6 * 72.0, -7.7e6 * 72.0 * 5.0], [1.0, 18_000.0, 0.0])
    )
    basis = np.linalg.qr(np.random.default_rng(2).normal(size=(2, 2)))[0]
    rotated = StateSpace.of(basis.T @ controller.a @ basis, basis.T @ controller.b, controller.c @ basis, controller.d)
    verdict = verify(quickstart, rotated, 0.6)
    assert verdict.verified, verdict.sentence
    assert verdict.worst_level == pytest.approx(worst_case(quickstart, controller).level, rel=1e-4)

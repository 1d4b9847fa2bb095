"""The bearing between a held current and a sampled position: closed forms against matrix exponentials."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from magbear_cli.errors import NumericsError
from magbear_cli.model.held_plant import (
    Sampling,
    held_plant,
    hold_filter,
    hold_mass,
    hold_shares,
    stiffness_residue_n_per_m,
)
from magbear_cli.model.problem import ControlProblem, MassRange, RationalWeight, UncertainParameter

ANGLES = np.array([0.05, 0.7, 1.9, 3.0])


def _problem(uncertain: UncertainParameter = UncertainParameter.MASS) -> ControlProblem:
    weight = RationalWeight.low_pass(10.0, 200.0)
    return ControlProblem(62_500.0, 50.0, MassRange(3.0, 4.5), weight, 20_000.0, uncertain)


def _by_exponentials(problem: ControlProblem, sampling: Sampling, mass_kg: float) -> list[complex]:
    """The response from the matrix exponential of plant and input together, with the delay split by hand."""
    k_z, inertia = problem.stiffness_n_per_m(mass_kg), problem.inertia_kg(mass_kg)
    matrix = np.array([[0.0, 1.0, 0.0], [k_z / inertia, 0.0, problem.current_stiffness_n_per_a / inertia], [0, 0, 0]])
    time, part = sampling.sample_time_s, sampling.part_s
    whole, early, late = (expm(matrix * duration) for duration in (time, time - part, part))
    fresh, old = early[:2, 2], early[:2, :2] @ late[:2, 2]
    answers = []
    for angle in ANGLES:
        z = np.exp(1j * angle)
        pushed = np.linalg.solve(z * np.eye(2) - whole[:2, :2], fresh + old / z)
        answers.append(complex(pushed[0]) / z**sampling.whole_samples)
    return answers


@pytest.mark.parametrize("late", [0.0, 0.3, 1.0, 1.7, 2.0])
@pytest.mark.parametrize("uncertain", list(UncertainParameter))
@pytest.mark.parametrize("time", [2e-5, 5e-3])
def test_closed_form_matrices_and_exponentials_agree(late: float, uncertain: UncertainParameter, time: float) -> None:
    """Three ways to the held plant give one response, for whole and broken delays and slow sampling."""
    problem, sampling, mass = _problem(uncertain), Sampling(time, late * time), 3.3
    expected = _by_exponentials(problem, sampling, mass)
    plant = held_plant(problem, sampling, mass)
    np.testing.assert_allclose([plant(np.exp(1j * angle) - 1.0)[0, 0] for angle in ANGLES], expected, rtol=1e-8)
    stiffness = hold_mass(problem, sampling, mass) * np.sin(ANGLES / 2.0) ** 2
    stiffness = stiffness + problem.stiffness_n_per_m(mass) * np.cos(ANGLES / 2.0) ** 2
    shares = hold_shares(problem, sampling, mass)
    closed = -problem.current_stiffness_n_per_a * hold_filter(sampling, shares, ANGLES) / stiffness
    np.testing.assert_allclose(closed, expected, rtol=1e-8)


def test_the_family_rises_with_the_mass() -> None:
    """Mass and shares of the hold rise with the mass, so that the ends of a range enclose what is between."""
    sampling, masses = Sampling(5e-3, 2e-3), np.linspace(3.0, 4.5, 40)
    assert (np.diff(hold_mass(_problem(), sampling, masses)) > 0.0).all()
    for share in hold_shares(_problem(), sampling, masses):
        assert (np.diff(share) > 0.0).all()
        assert ((share > 0.0) & (share < 1.0)).all()


def test_the_residue_of_an_uncertain_stiffness_is_enclosed() -> None:
    """Over the whole range the mass of the hold lies within its affine part and the residue."""
    problem, sampling = _problem(UncertainParameter.NEGATIVE_STIFFNESS), Sampling(5e-3)
    low, high = stiffness_residue_n_per_m(problem, sampling)
    for mass in problem.mass.samples_kg(25):
        straight = 4.0 * problem.inertia_kg(float(mass)) / 5e-3**2 + 2.0 * problem.stiffness_n_per_m(float(mass)) / 3.0
        rest = float(hold_mass(problem, sampling, mass)) - straight
        assert low <= rest <= high


@pytest.mark.parametrize(("time", "delay"), [(0.0, 0.0), (-1e-5, 0.0), (1e-5, -1e-6), (float("nan"), 0.0)])
def test_times_that_are_none_are_refused(time: float, delay: float) -> None:
    """A sample time is positive and a delay is not negative."""
    with pytest.raises(NumericsError):
        Sampling(time, delay)

"""The bearing between a held current and a sampled position: closed forms against matrix exponentials."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from magbear_cli.errors import NumericsError
from magbear_cli.model.family import Plant
from magbear_cli.model.held_plant import (
    Sampling,
    held_plant,
    hold_filter,
    hold_shares,
    hold_shares_at,
    hold_stiffness,
)

ANGLES = np.array([0.05, 0.7, 1.9, 3.0])


PLANTS = [Plant(3.3, 62_500.0, 50.0), Plant(0.4, 9_000.0, 120.0)]


def _by_exponentials(plant: Plant, sampling: Sampling) -> list[complex]:
    """The response from the matrix exponential of plant and input together, with the delay split by hand."""
    matrix = np.array([[0.0, 1.0, 0.0], [plant.pole_squared, 0.0, plant.acceleration_per_current], [0, 0, 0]])
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
@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("time", [2e-5, 5e-3])
def test_closed_form_matrices_and_exponentials_agree(late: float, plant: Plant, time: float) -> None:
    """Three ways to the held plant give one response, for whole and broken delays and slow sampling."""
    sampling = Sampling(time, late * time)
    expected = _by_exponentials(plant, sampling)
    held = held_plant(plant, sampling)
    np.testing.assert_allclose([held(np.exp(1j * angle) - 1.0)[0, 0] for angle in ANGLES], expected, rtol=1e-8)
    stiffness = hold_stiffness(plant, sampling) * np.sin(ANGLES / 2.0) ** 2
    stiffness = stiffness + plant.negative_stiffness_n_per_m * np.cos(ANGLES / 2.0) ** 2
    shares = hold_shares(plant, sampling)
    closed = -plant.current_stiffness_n_per_a * hold_filter(sampling, shares, ANGLES) / stiffness
    np.testing.assert_allclose(closed, expected, rtol=1e-8)


def test_shares_fall_with_the_speed_of_the_pole() -> None:
    """So the shares of all plants of a box lie between those of its slowest and its fastest pole."""
    sampling = Sampling(5e-3, 2e-3)
    shares = np.array([hold_shares_at(float(pole), sampling) for pole in np.linspace(50.0, 400.0, 40)])
    assert (np.diff(shares, axis=0) < 0.0).all()
    assert ((shares > 0.0) & (shares < 1.0)).all()


@pytest.mark.parametrize("tangent", [0.01, 0.3, 1.0, 40.0])
def test_the_held_box_lies_between_its_corners(tangent: float) -> None:
    """(µ v² + k_z)/k_i of plants of the box, a common factor of both stiffnesses among them, lies between the ends."""
    sampling, random = Sampling(5e-3), np.random.default_rng(4)

    def quotient(plant: Plant) -> float:
        held = hold_stiffness(plant, sampling) * tangent**2 + plant.negative_stiffness_n_per_m
        return held / plant.current_stiffness_n_per_a

    low = quotient(Plant(3.0, 1.2 * 0.8 * 62_500.0, 1.2 * 1.1 * 50.0))
    high = quotient(Plant(4.5, 0.9 * 1.3 * 62_500.0, 0.9 * 0.7 * 50.0))
    for mass, f, k_z, k_i in random.uniform((3.0, 0.9, 0.8, 0.7), (4.5, 1.2, 1.3, 1.1), size=(200, 4)):
        assert low <= quotient(Plant(mass, f * k_z * 62_500.0, f * k_i * 50.0)) <= high


@pytest.mark.parametrize(("time", "delay"), [(0.0, 0.0), (-1e-5, 0.0), (1e-5, -1e-6), (float("nan"), 0.0)])
def test_times_that_are_none_are_refused(time: float, delay: float) -> None:
    """A sample time is positive and a delay is not negative."""
    with pytest.raises(NumericsError):
        Sampling(time, delay)

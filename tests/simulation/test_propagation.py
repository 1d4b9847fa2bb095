"""The flow of the linear part is its matrix exponential, at every width."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from magbear_cli.simulation.collocation import STAGES, interpolation, probes, radau_points
from magbear_cli.simulation.propagation import Propagation

Floats = NDArray[np.float64]
POINTS = np.append(radau_points(), probes())


def _system(seed: int = 0) -> Propagation:
    """An integrator, a slow and a fast pole and an oscillation, coupled upwards."""
    a = np.triu(np.random.default_rng(seed).normal(size=(5, 5)), 1) * 10.0
    a += np.diag([0.0, -20.0, -3e5, -500.0, -500.0])
    a[4, 3] = -4e3
    return Propagation(a, np.arange(1.0, 6.0), np.eye(5)[:4], POINTS, STAGES)


@pytest.mark.parametrize("width_s", [1e-9, 1e-6, 2e-5, 1e-3])
def test_the_free_motion_is_the_exponential(width_s: float) -> None:
    """State and outputs without a force are those of exp(A h), small steps, squared ones and all."""
    system = _system()
    propagator, start = system.over(width_s), np.array([1.0, -2.0, 0.5, 3.0, 1.0])
    expected = expm(POINTS[:, None, None] * width_s * system.a) @ start
    np.testing.assert_allclose((start @ propagator.free).reshape(-1, 4), expected[:, :4], rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(start @ propagator.end_free, expected[STAGES - 1], rtol=1e-11, atol=1e-11)


def test_slow_states_keep_their_digits_through_the_squarings() -> None:
    """Over a step of 2^12 of the fast pole's time, the slow pole decays by the right factor to 1e-13."""
    system = Propagation(np.diag([-1e-3, -3e5]), np.ones(2), np.eye(2), POINTS, STAGES)
    slow = system.over(1e-2).end_free[0, 0] - 1.0
    assert slow == pytest.approx(float(mpmath.expm1(mpmath.mpf("-1e-5"))), rel=1e-11)


@pytest.mark.parametrize("width_s", [1e-7, 1e-4, 1e-3])
def test_the_forced_motion_is_the_convolution(width_s: float) -> None:
    """A force that is a polynomial through its values at the points moves the outputs as its integral says."""
    system = _system(1)
    forces = np.cos(3.0 * radau_points())
    nodes, weights = np.polynomial.legendre.leggauss(40)
    expected = np.zeros((POINTS.size, 5))
    for at, point in enumerate(POINTS):
        for part in range(150):  # many short spans: the fast pole's exponential is narrow
            fractions = point * (part + (nodes + 1.0) / 2.0) / 150
            values = interpolation(radau_points(), fractions) @ forces
            flows = _flows(system, width_s * (point - fractions))
            expected[at] += width_s * point / 300 * (weights * values) @ flows
    moved = system.over(width_s).forced @ forces
    np.testing.assert_allclose(moved, expected[:, :4], rtol=1e-8, atol=1e-9 * np.abs(expected).max())


def _flows(system: Propagation, times_s: Floats) -> Floats:
    """exp(A t) b at the times, by the eigenvectors."""
    values, vectors = np.linalg.eig(system.a)
    modes = np.linalg.solve(vectors, system.b.astype(complex))
    return np.asarray((vectors @ (np.exp(values[:, None] * times_s) * modes[:, None])).real.T)

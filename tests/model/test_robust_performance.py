"""The closed forms by which a controller is judged during synthesis."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.model.robust_performance import (
    control_sensitivity,
    interconnection,
    open_interconnection,
    worst_level,
)

OMEGA = np.concatenate([[0.0], np.geomspace(0.1, 1e6, 60), [np.inf]])


def _problem(omega_c: float | None = 2e4, high: float = 4.5) -> ControlProblem:
    return ControlProblem.of_mass(62500.0, 50.0, (3.0, high), RationalWeight.low_pass(10.0, 200.0), omega_c)


def _response(gain: float, zero: float, pole: float) -> NDArray[np.complex128]:
    finite = np.isfinite(OMEGA)
    s = 1j * np.where(finite, OMEGA, 0.0)
    return np.where(finite, -gain * (1 + s / zero) / (1 + s / pole), -gain * pole / zero)


@given(gain=st.floats(100.0, 1e6), zero=st.floats(10.0, 1e4), pole=st.floats(1e2, 1e6), limited=st.booleans())
@settings(deadline=None, max_examples=60)
def test_the_worst_mass_is_the_worst_of_many(*, gain: float, zero: float, pole: float, limited: bool) -> None:
    """No mass of a dense sample is worse than the closed form, and the sample comes near it."""
    problem = _problem(2e4 if limited else None)
    response = _response(gain, zero, pole)
    level, share = worst_level(problem, response, OMEGA)
    inner = slice(0, -1)
    shares = problem.family.shares(1500)
    plant = problem.plant(OMEGA[inner, None], shares)
    sensitivity = 1.0 / (1.0 - response[inner, None] * plant)
    dense = problem.performance_bound(OMEGA[inner])[:, None] * np.abs(sensitivity)
    dense = dense + problem.bandwidth_bound(OMEGA[inner])[:, None] * np.abs(response[inner, None] * plant * sensitivity)
    assert (dense.max(axis=1) <= level[inner] * (1 + 1e-9)).all()
    near = level[inner] < 50.0  # beyond, a resonance is sharper than the sample
    np.testing.assert_allclose(dense.max(axis=1)[near], level[inner][near], rtol=2e-3)
    assert ((share >= 0.0) & (share <= 1.0)).all()


def test_the_limit_at_infinity_is_the_limit() -> None:
    """The level at ω = ∞ is what the level tends to."""
    problem, response = _problem(), _response(1e5, 800.0, 3e4)
    level, _ = worst_level(problem, response, OMEGA)
    far = np.array([1e13])
    near_infinity = worst_level(problem, response[-1:], far)[0]
    assert level[-1] == pytest.approx(near_infinity[0], rel=1e-6)


@given(delta=st.floats(-1.0, 1.0), gain=st.floats(2e3, 1e5))
@settings(deadline=None, max_examples=40)
def test_closing_the_mass_channel_gives_the_loop_of_that_mass(delta: float, gain: float) -> None:
    """M with its first channel closed by a real δ is W1 S and W3 T of the member with δ, δ = −1 at the last end."""
    problem, response = _problem(), _response(gain, 800.0, 3e4)
    matrix = interconnection(problem, response, OMEGA)[:-1]
    omega, k = OMEGA[:-1], response[:-1]
    plant = problem.plant(omega, 0.5 * (1.0 - delta))
    closed = matrix[:, 1:, 1:] + matrix[:, 1:, :1] * matrix[:, :1, 1:] * (delta / (1 - delta * matrix[:, :1, :1]))
    sensitivity = 1.0 / (1.0 - k * plant)
    np.testing.assert_allclose(closed[:, 0, 0], problem.performance(1j * omega) * sensitivity, rtol=1e-7)
    complementary = problem.bandwidth_bound(omega) * np.abs(k * plant * sensitivity)
    np.testing.assert_allclose(np.abs(closed[:, 1, 1]), complementary, rtol=1e-7, atol=1e-300)


@pytest.mark.parametrize(
    ("omega_c", "high", "channels"), [(2e4, 4.5, 3), (None, 4.5, 2), (2e4, 3.0, 2), (None, 3.0, 1)]
)
def test_only_the_channels_that_exist_are_there(omega_c: float | None, high: float, channels: int) -> None:
    """No bandwidth limit and no mass range each take a channel away."""
    p11, p12, p21 = open_interconnection(_problem(omega_c, high), OMEGA)
    assert p11.shape == (OMEGA.size, channels, channels)
    assert p12.shape == p21.shape == (OMEGA.size, channels)


def test_control_sensitivity_is_k_times_s() -> None:
    """K S from its closed form and from K and S; at ∞ it is K."""
    problem, response = _problem(), _response(1e5, 800.0, 3e4)
    ks = control_sensitivity(problem, response, OMEGA)
    plant = problem.plant(OMEGA[:-1], 0.5)
    np.testing.assert_allclose(ks[:-1] * (1 - response[:-1] * plant), response[:-1], rtol=1e-12)
    assert ks[-1] == response[-1]

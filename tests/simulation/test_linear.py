"""The linear response is the solution of the differential equation, and the chosen duration lets it settle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.bearing import Bearing
from magbear_cli.model.filters import Prefilter, SensorDynamics
from magbear_cli.simulation.linear import choose_duration, linear_response, linearize
from magbear_cli.simulation.loop import close_loop
from magbear_cli.simulation.scenario import Disturbance, StepScenario

Lead = Callable[..., StateSpace]


def test_proportional_control_is_a_cosine(bearing: Bearing) -> None:
    """With u = −k (z − r) the rotor swings as m z̈ = k_z z − k_i k (z − r) says, undamped."""
    linear = linearize(close_loop(bearing, StateSpace.gain([[-5000.0]]), StepScenario(10e-6, 2.0)))
    position, current = linear_response(linear, np.linspace(0.0, 0.1, 501))
    stiffness = 50.0 * 5000.0 - 62500.0
    rest = 50.0 * 5000.0 * 10e-6 / stiffness
    exact = rest * (1.0 - np.cos(np.sqrt(stiffness / 2.0) * np.linspace(0.0, 0.1, 501)))
    np.testing.assert_allclose(position, exact, rtol=0, atol=1e-12 * 10e-6 * 1e3)
    np.testing.assert_allclose(current, -5000.0 * (exact - 10e-6), rtol=0, atol=1e-10)


def test_a_pulse_is_two_steps_of_force(bearing: Bearing, lqg: StateSpace) -> None:
    """The response to a pulse is that to a force that stays, minus the same later."""
    still = StepScenario(0.0, 2.0)

    def response(disturbance: Disturbance) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        loop = close_loop(bearing, lqg, replace(still, disturbance=disturbance))
        return linear_response(linearize(loop), np.linspace(0.0, 20e-3, 201))[0]

    stays, later = response(Disturbance(50.0, 0.0, 1.0)), response(Disturbance(50.0, 2e-3, 1.0))
    np.testing.assert_allclose(response(Disturbance(50.0, 0.0, 2e-3)), stays - later, rtol=0, atol=1e-15)


def test_poles_of_the_lqg_loop_with_the_sensor(bearing: Bearing, lqg: StateSpace) -> None:
    """The sensor of eq. 2.11 makes the LQG loop of section 2.3.1 unstable; without it the loop is stable."""
    scenario = StepScenario(10e-6, 2.0)
    assert linearize(close_loop(bearing, lqg, scenario)).is_stable
    with_sensor = close_loop(bearing, lqg, replace(scenario, sensor=SensorDynamics(4000.0, 560.0)))
    assert not linearize(with_sensor).is_stable


@pytest.mark.parametrize("scale", [1.0, 8.0])
def test_duration_lets_the_response_settle(scale: float, bearing: Bearing, lead: Lead) -> None:
    """At the chosen duration the response is at rest, and it was not at a quarter of it."""
    linear = linearize(close_loop(bearing, lead(2e6 / scale, 500.0, 5e4), StepScenario(10e-6, 3.6)))
    duration = choose_duration(linear)
    position, _ = linear_response(linear, np.linspace(0.0, duration, 1001))
    errors = np.abs(position - linear.rest()) / abs(linear.rest())
    assert errors[700:].max() < 0.005
    assert errors[250:].max() > 0.005


def test_a_slow_pole_that_does_not_show_costs_nothing(bearing: Bearing, lead: Lead) -> None:
    """A slow state that the output does not see, or an unstable one that nothing moves, leaves the duration alone."""
    plain = lead()
    scenario = StepScenario(10e-6, 3.6)
    expected = choose_duration(linearize(close_loop(bearing, plain, scenario)))
    for pole, gain in ((-0.5, 1.0), (3000.0, 0.0)):
        hidden = StateSpace.of(
            np.diag([plain.a[0, 0], pole]), [[1.0], [gain]], np.append(plain.c, [[0.0]], axis=1), plain.d
        )
        assert choose_duration(linearize(close_loop(bearing, hidden, scenario))) == pytest.approx(expected, rel=0.15)


def test_an_unstable_loop_is_simulated_until_it_touches(bearing: Bearing, lqg: StateSpace) -> None:
    """The duration of an unstable loop reaches past the time at which its linear response leaves the gap."""
    scenario = StepScenario(10e-6, 2.0, sensor=SensorDynamics(4000.0, 560.0))
    linear = linearize(close_loop(bearing, lqg, scenario))
    position, _ = linear_response(linear, np.linspace(0.0, choose_duration(linear), 1001))
    assert np.abs(position).max() > 400e-6


def test_duration_covers_the_prefilter(bearing: Bearing, lead: Lead) -> None:
    """A prefilter slower than the loop sets the duration."""
    scenario = StepScenario(10e-6, 3.6, prefilter=Prefilter(5.0, 1.0))
    assert choose_duration(linearize(close_loop(bearing, lead(), scenario))) >= 20.0 / 5.0


def test_duration_of_a_loop_that_does_nothing(bearing: Bearing, lead: Lead) -> None:
    """Without a step and a pulse there is still a duration."""
    assert 0.0 < choose_duration(linearize(close_loop(bearing, lead(), StepScenario(0.0, 3.6)))) <= 10.0

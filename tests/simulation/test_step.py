"""Step responses show what the thesis says of them, and every way a run can end is an answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

from magbear_cli.errors import NumericsError
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.bearing import Bearing
from magbear_cli.model.filters import Prefilter, SensorDynamics
from magbear_cli.model.rotor import FlexibleRotor
from magbear_cli.simulation.scenario import Disturbance, StepScenario
from magbear_cli.simulation.step import simulate_step
from magbear_cli.simulation.trajectory import End

Lead = Callable[..., StateSpace]

PULSE = StepScenario(0.0, 2.0, disturbance=Disturbance(50.0, 0.0, 2e-3))  # thesis section 2.3.1
STEP = StepScenario(10e-6, 3.6)


@pytest.mark.parametrize("model", ["nonlinear", "linear"])
def test_lqg_settles_the_pulse_in_20_ms_without_overshoot(
    bearing: Bearing, lqg: StateSpace, model: Literal["nonlinear", "linear"]
) -> None:
    """The LQG loop of section 2.3.1 settles a pulse of 50 N and 2 ms within 20 ms, from one side (Fig 2.4)."""
    response = simulate_step(bearing, lqg, replace(PULSE, model=model))
    assert response.end == End.FINISHED
    assert response.sentence == ""
    settling, overshoot = response.metrics.settling_time_s, response.metrics.overshoot
    assert settling is not None
    assert settling < 20e-3
    assert overshoot == pytest.approx(0.0, abs=1e-4)


def test_lqg_with_the_sensor_is_unstable(bearing: Bearing, lqg: StateSpace) -> None:
    """With the sensor of eq. 2.11 the linear loop swings into the stator, the nonlinear one swings on (Fig 2.7)."""
    scenario = replace(PULSE, sensor=SensorDynamics(4000.0, 560.0))
    linear = simulate_step(bearing, lqg, replace(scenario, model="linear"))
    assert linear.end == End.TOUCHED_DOWN
    nonlinear = simulate_step(bearing, lqg, replace(scenario, duration_s=40e-3))
    assert nonlinear.metrics.settling_time_s is None
    assert "not settled" in nonlinear.sentence


@pytest.mark.parametrize("mass_kg", [3.0, 3.6, 4.5])
def test_prefilter_lowers_the_peak_current(bearing: Bearing, lead: Lead, mass_kg: float) -> None:
    """A prefilter of 20 000 rad/s cuts the current of a 10 µm step and leaves the settling time (section 3.7)."""
    plain = simulate_step(bearing, lead(), replace(STEP, mass_kg=mass_kg))
    filtered = simulate_step(bearing, lead(), replace(STEP, mass_kg=mass_kg, prefilter=Prefilter(20000.0, 1.0)))
    assert plain.metrics.peak_current_a == pytest.approx(2e6 * 10e-6)  # the step times the direct gain
    assert filtered.metrics.peak_current_a is not None
    assert filtered.metrics.peak_current_a < 0.5 * 20.0
    assert filtered.metrics.settling_time_s == pytest.approx(plain.metrics.settling_time_s, abs=5e-4)


def test_a_step_of_390_um_touches_down(bearing: Bearing, lead: Lead) -> None:
    """A step to just before the magnet overshoots into it: a touch-down, and no figure that would pretend otherwise."""
    response = simulate_step(bearing, lead(2e6, 2000.0), replace(STEP, step_m=390e-6))
    assert response.end == End.TOUCHED_DOWN
    assert "touched the stator" in response.sentence
    metrics = response.metrics
    assert (metrics.settling_time_s, metrics.overshoot, metrics.rise_time_s, metrics.final_error_m) == (None,) * 4
    assert metrics.peak_current_a == pytest.approx(2e6 * 390e-6)
    assert response.position_m[-1] == pytest.approx(400e-6, rel=1e-3)
    assert np.isfinite(response.current_a).all()


def test_a_controller_that_is_too_weak_lets_the_rotor_fall(bearing: Bearing) -> None:
    """Less stiffness than the magnets take away ends at the stator."""
    response = simulate_step(bearing, StateSpace.gain([[-1000.0]]), STEP)
    assert response.end == End.TOUCHED_DOWN


def test_nothing_happens(half_bearing: Bearing, lead: Lead) -> None:
    """Without a step and a pulse a rotor whose weight is balanced stays where it is."""
    scenario = StepScenario(0.0, 4.5, gravity_m_per_s2=9.8, gravity_compensation=True)
    response = simulate_step(half_bearing, lead(), scenario)
    assert response.end == End.FINISHED
    assert response.metrics.settling_time_s == 0.0
    assert np.abs(response.position_m).max() < 1e-15
    np.testing.assert_allclose(response.current_a, 1.6563132345, rtol=1e-9)


def test_gravity_that_is_not_balanced_moves_the_rotor(bearing: Bearing, lead: Lead) -> None:
    """A loop without integral action sags by its weight over its stiffness."""
    scenario = StepScenario(0.0, 3.6, gravity_m_per_s2=0.1)
    response = simulate_step(bearing, lead(), scenario)
    stiffness = 50.0 * 2e6 * 500.0 / 5e4 - 62500.0
    assert response.position_m[-1] == pytest.approx(-3.6 * 0.1 / stiffness, rel=0.01)


def test_response_is_in_the_coordinates_of_the_gap(bearing: Bearing, lead: Lead) -> None:
    """About another operating point position, command and current begin there."""
    scenario = replace(STEP, position_m=50e-6, current_a=0.2, prefilter=Prefilter(20000.0, 1.0), samples=201)
    response = simulate_step(bearing, lead(), scenario)
    assert response.time_s.shape == response.position_m.shape == response.linear_current_a.shape == (201,)
    assert (response.position_m[0], response.reference_m[0], response.linear_position_m[0]) == (50e-6,) * 3
    assert response.reference_m[-1] == pytest.approx(60e-6)
    assert response.current_a[0] == pytest.approx(0.2)


def test_current_limit(bearing: Bearing, lead: Lead) -> None:
    """The current is what the limit leaves of it; the linear loop beside it knows no limit."""
    response = simulate_step(bearing, lead(), replace(STEP, current_limit_a=2.0))
    assert response.metrics.peak_current_a == 2.0
    assert np.abs(response.current_a).max() <= 2.0
    assert np.abs(response.linear_current_a).max() == pytest.approx(20.0)


def test_a_duration_that_is_too_short_gives_no_settling_time(bearing: Bearing, lead: Lead) -> None:
    """A run that ends while the rotor still moves says so."""
    response = simulate_step(bearing, lead(), replace(STEP, duration_s=2e-4))
    assert response.end == End.FINISHED
    assert response.time_s[-1] == 2e-4
    assert response.metrics.settling_time_s is None
    assert "not settled" in response.sentence


def test_a_duration_of_its_own_is_prolonged_for_the_nonlinear_loop(bearing: Bearing, lead: Lead) -> None:
    """A current limit that slows the loop down gets the time that it needs."""
    response = simulate_step(bearing, lead(2e6, 2000.0), replace(STEP, current_limit_a=0.05))
    assert response.metrics.settling_time_s is not None


def test_numbers_beyond_reach_are_an_answer(bearing: Bearing) -> None:
    """A force that overflows at t = 0 is the end not_finite, with its sentence."""
    response = simulate_step(bearing, StateSpace.gain([[-1e200]]), STEP)
    assert response.end == End.NOT_FINITE
    assert "no first step" in response.sentence
    assert response.metrics.peak_current_a is None


def test_parts_that_do_not_fit_are_refused(bearing: Bearing, lead: Lead) -> None:
    """Controllers of the wrong size, points in the iron, and weights beyond the limit end in a sentence."""
    with pytest.raises(NumericsError, match="one input and one output"):
        simulate_step(bearing, StateSpace.gain(np.ones((2, 2))), STEP)
    with pytest.raises(NumericsError, match="not inside the gap"):
        simulate_step(bearing, lead(), replace(STEP, position_m=1e-3))
    with pytest.raises(NumericsError, match="no sensor mass"):
        simulate_step(bearing, lead(), replace(STEP, rotor=FlexibleRotor(5.0, 1e6)))
    weighty = replace(STEP, gravity_m_per_s2=9.8, gravity_compensation=True, current_limit_a=0.5)
    with pytest.raises(NumericsError, match="beyond the current limit"):
        simulate_step(bearing, lead(), weighty)
    with pytest.raises(NumericsError, match="double precision"):
        simulate_step(bearing, StateSpace.gain([[-1e308]]), replace(STEP, step_m=10.0))

"""The adaptive loop is marched exactly, switches where it should, ends where it must, and tracks its model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from magbear_cli.model.adaptive_law import AdaptiveLaw, Trigger
from magbear_cli.model.bearing import Bearing, magnetic_force
from magbear_cli.model.filters import Prefilter, SensorDynamics
from magbear_cli.model.rotor import FlexibleRotor
from magbear_cli.simulation.adaptive import choose_adaptive_duration, simulate_adaptive_step
from magbear_cli.simulation.scenario import Disturbance, StepScenario
from magbear_cli.simulation.trajectory import End

LAW = AdaptiveLaw(600.0, 1.0, 1.71e4, 52.8, 1200.0 / 52.8, 2e9, 1e-6, 0.5e-6)  # thesis Table 4.2
STEP = StepScenario(1e-4, 3.0, duration_s=0.02, samples=401)


def fixed_steps(bearing: Bearing, law: AdaptiveLaw, scenario: StepScenario, width_s: float) -> tuple[float, float]:
    """Position and current of a rigid rotor at the end, by the classic Runge-Kutta method and nothing of the code."""
    omega, zeta, mass, step = law.omega_rad_s, law.zeta, scenario.mass_kg, scenario.step_m
    p12, p22 = law.lyapunov[1]
    centre, adapting = np.zeros(2), False

    def current(x: np.ndarray) -> float:
        k = np.array([law.gain_position_a_per_m, law.gain_speed_a_s_per_m])
        return float(law.feedforward_a_per_m * step - k @ x[:2] - x[4] - x[5:] @ (x[:2] - centre))

    def slope(x: np.ndarray) -> np.ndarray:
        force = float(magnetic_force(bearing, x[0], current(x))) - mass * scenario.gravity_m_per_s2
        wanted = omega**2 * (step - x[2]) - 2.0 * zeta * omega * x[3]
        error = x[2:4] - x[:2]
        learned = -law.gamma * law.input_gain_m_per_s2_a * (p12 * error[0] + p22 * error[1]) * adapting
        return np.array([x[1], force / mass, x[3], wanted, learned, *(learned * (x[:2] - centre))])

    def stepped(x: np.ndarray, width: float) -> np.ndarray:
        k1 = slope(x)
        k2 = slope(x + width / 2 * k1)
        k3 = slope(x + width / 2 * k2)
        return np.asarray(x + width / 6 * (k1 + 2 * k2 + 2 * k3 + slope(x + width * k3)))

    def outside(x: np.ndarray) -> float:
        return float(abs(x[2] - x[0]) - (law.inner_m if adapting else law.outer_m))

    x, left = np.zeros(7), scenario.duration_s or 0.0
    while left > 1e-12:
        width = min(width_s, left)
        after = stepped(x, width)
        if adapting != (outside(after) >= 0.0):  # the switch turns within this step: go there by the secant
            width *= outside(x) / (outside(x) - outside(after))
            after = stepped(x, width)
            if not adapting:
                after[4] += after[5:] @ (after[:2] - centre)
                centre = after[:2].copy()
            adapting = not adapting
        x, left = after, left - width
    return float(x[0]), current(x)


def test_it_agrees_with_a_second_integration(half_bearing: Bearing) -> None:
    """A fixed-step integration written anew ends at the same position and current."""
    scenario = replace(STEP, duration_s=6e-3, gravity_m_per_s2=4.9)
    response = simulate_adaptive_step(half_bearing, LAW, scenario)
    position, current = fixed_steps(half_bearing, LAW, scenario, 2e-6)
    assert response.position_m[-1] == pytest.approx(position, abs=2e-11)
    assert response.current_a[-1] == pytest.approx(current, rel=2e-5)
    assert response.statistics["switchings"] >= 1.0


@pytest.mark.parametrize("mass", [2.2, 4.5])
def test_the_late_error_stays_at_the_sphere(half_bearing: Bearing, mass: float) -> None:
    """With Table 4.2 a large step follows the reference model to about rho + sigma, whatever the mass."""
    response = simulate_adaptive_step(half_bearing, LAW, replace(STEP, step_m=2e-4, mass_kg=mass, duration_s=0.04))
    assert response.end is End.FINISHED
    assert response.statistics["tracking_error_m"] <= 1.01 * LAW.outer_m
    late = response.time_s >= 0.02
    sampled = np.abs(response.position_m - response.reference_m)[late].max()
    assert sampled == pytest.approx(response.statistics["tracking_error_m"], rel=0.02)


def test_the_norm_of_the_state_switches_earlier(half_bearing: Bearing) -> None:
    """A trigger on position and speed together keeps the error far smaller."""
    position, state = (
        simulate_adaptive_step(half_bearing, replace(LAW, trigger=trigger), STEP).statistics for trigger in Trigger
    )
    assert state["largest_error_m"] < 0.2 * position["largest_error_m"]
    assert state["switchings"] > position["switchings"]


def test_gravity_is_learned(half_bearing: Bearing) -> None:
    """Without a compensating current the estimate ends near the weight's current, and the error inside the sphere."""
    scenario = replace(STEP, step_m=1e-5, mass_kg=2.2, gravity_m_per_s2=4.9, duration_s=0.04)
    response = simulate_adaptive_step(half_bearing, LAW, scenario)
    assert response.statistics["tracking_error_m"] <= 1.02 * LAW.outer_m
    assert response.statistics["estimate_constant_a"] == pytest.approx(-2.2 * 4.9 / 25.0, rel=0.3)


def test_a_perfect_law_never_adapts(bearing: Bearing) -> None:
    """On the linear force of its own rotor the law follows the model exactly, with every slope and no switching."""
    gain = ((2.2 * 600.0**2 + 62500.0) / 50.0, 1200.0 * 2.2 / 50.0)
    law = replace(LAW, gain_position_a_per_m=gain[0], gain_speed_a_s_per_m=gain[1], input_gain_m_per_s2_a=50.0 / 2.2)
    scenario = replace(STEP, mass_kg=2.2, model="linear", prefilter=Prefilter(1000.0, 1.0))
    response = simulate_adaptive_step(bearing, law, scenario)
    assert response.statistics["switchings"] == 0.0
    assert response.statistics["largest_error_m"] < 1e-11
    assert np.isnan(response.linear_position_m).all()
    assert response.metrics.overshoot == pytest.approx(0.0, abs=1e-6)


def test_learning_nothing_is_the_state_feedback_alone(half_bearing: Bearing) -> None:
    """With gamma = 0 the switch turns and nothing else happens."""
    still = simulate_adaptive_step(half_bearing, replace(LAW, gamma=0.0), STEP).statistics
    assert still["switchings"] >= 1.0
    assert still["estimate_constant_a"] == still["estimate_position_a_per_m"] == 0.0


def test_a_constant_alone_learns_no_slopes(half_bearing: Bearing) -> None:
    """Of order 0 the estimate has a constant and no slopes."""
    response = simulate_adaptive_step(half_bearing, replace(LAW, taylor_order=0), STEP)
    assert response.statistics["estimate_position_a_per_m"] == 0.0
    assert response.statistics["estimate_constant_a"] != 0.0


def test_too_much_gain_throws_an_elastic_rotor_onto_the_stator(half_bearing: Bearing) -> None:
    """An elastic rotor with little damping touches the stator at the gain of Table 4.2; the run ends there."""
    rotor = FlexibleRotor(0.18, 2.736e6, 100.0)
    response = simulate_adaptive_step(half_bearing, LAW, replace(STEP, rotor=rotor))
    assert response.end is End.TOUCHED_DOWN
    assert "stator" in response.sentence
    assert response.time_s[-1] < 0.02
    assert response.metrics.settling_time_s is None


def test_a_pulse_through_a_sensor_with_a_limited_current(half_bearing: Bearing) -> None:
    """A pulse of force is survived with the sensor's dynamics, and the current stays within its limit."""
    scenario = StepScenario(
        0.0, 3.0, sensor=SensorDynamics(4e4, 4e4), current_limit_a=1.5, disturbance=Disturbance(20.0, 1e-3, 2e-3)
    )
    response = simulate_adaptive_step(half_bearing, replace(LAW, gamma=1e7), scenario)
    assert response.end is End.FINISHED
    assert np.abs(response.current_a).max() <= 1.5
    assert response.metrics.peak_current_a is not None
    assert response.time_s[-1] == pytest.approx(choose_adaptive_duration(LAW, scenario))
    assert response.position_m.max() > 1e-6


def test_an_end_before_the_edge_of_a_pulse_stays_the_end(bearing: Bearing) -> None:
    """A rotor that touches the stator while the pulse lasts ends there, and not when the pulse does."""
    rotor = FlexibleRotor(0.1824, 2.612e6, 170.0)
    scenario = StepScenario(0.0, 3.0, rotor=rotor, duration_s=0.02, disturbance=Disturbance(30.0, 0.0, 5e-3))
    response = simulate_adaptive_step(bearing, LAW, scenario)
    assert response.end is End.TOUCHED_DOWN
    assert response.time_s[-1] < 4e-3
    assert np.abs(response.position_m).max() <= 400e-6


def test_a_sphere_without_hysteresis_is_followed(half_bearing: Bearing) -> None:
    """With sigma = 0 both borders are one, and each crossing of it is one switching."""
    response = simulate_adaptive_step(half_bearing, replace(LAW, sigma_m=0.0), STEP)
    assert response.end is End.FINISHED
    assert 1.0 <= response.statistics["switchings"] < 100.0


@pytest.mark.parametrize("trigger", Trigger)
def test_the_errors_are_those_of_a_dense_look(half_bearing: Bearing, trigger: Trigger) -> None:
    """The largest errors agree with those of a hundred thousand samples."""
    law, scenario = replace(LAW, gamma=1e7, trigger=trigger), replace(STEP, samples=100_001)
    response = simulate_adaptive_step(half_bearing, law, replace(scenario, mass_kg=2.2))
    error, time = np.abs(response.reference_m - response.position_m), response.time_s
    for name, begin, end in (
        ("largest_error_m", 0.0, 1.0), ("third_quarter_error_m", 0.5, 0.75), ("fourth_quarter_error_m", 0.75, 1.0),
    ):  # fmt: skip
        inside = (time >= begin * time[-1]) & (time <= end * time[-1])
        assert response.statistics[name] == pytest.approx(error[inside].max(), rel=1e-6)

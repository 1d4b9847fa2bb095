"""The march agrees with a second integrator, with exact solutions, and with the symmetries of the bearing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad, solve_ivp

from magbear_cli.errors import NumericsError
from magbear_cli.lti.connection import series
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.bearing import Bearing
from magbear_cli.model.filters import Prefilter, SensorDynamics
from magbear_cli.model.rotor import FlexibleRotor
from magbear_cli.simulation.integration import integrate
from magbear_cli.simulation.linear import linear_response, linearize
from magbear_cli.simulation.loop import DEMAND, MAGNETS, SENSOR, Loop, close_loop
from magbear_cli.simulation.scenario import Disturbance, StepScenario
from magbear_cli.simulation.trajectory import End

Lead = Callable[..., StateSpace]
Floats = NDArray[np.float64]

STEP = StepScenario(20e-6, 3.6, duration_s=1.5e-3)
SCENARIOS = {
    "plain": STEP,
    "prefilter": replace(STEP, prefilter=Prefilter(20000.0, 1.0)),
    "limit": replace(STEP, current_limit_a=2.0),
    "gravity": replace(STEP, gravity_m_per_s2=9.8, gravity_compensation=True, mass_kg=4.5),
    "sensor": replace(STEP, sensor=SensorDynamics(40000.0, 30000.0)),
    "rotor": replace(STEP, rotor=FlexibleRotor(0.2, 2e8, 4e3)),
    "pulse": replace(STEP, disturbance=Disturbance(50.0, 0.1e-3, 0.15e-3)),
    "off centre": replace(STEP, position_m=60e-6, current_a=-0.3),
}


def _reference(loop: Loop, end_s: float, times: Floats) -> tuple[Floats, Floats]:
    """Position and current by SciPy's Radau at a relative tolerance of 1e-11."""
    state, positions, currents = loop.start, list[Floats](), list[Floats]()
    for start, end, pulse in loop.scenario.segments(end_s):

        def slope(_: float, x: Floats, pulse: float = pulse) -> Floats:
            outputs = loop.c @ x
            force = loop.magnets.force(outputs[MAGNETS], outputs[DEMAND])[0]
            return loop.a @ x + loop.b * (force + pulse)

        def jacobian(_: float, x: Floats) -> Floats:
            outputs = loop.c @ x
            stiffness, gain = loop.magnets.force(outputs[MAGNETS], outputs[DEMAND])[1:]
            return loop.a + np.outer(loop.b, stiffness * loop.c[MAGNETS] + gain * loop.c[DEMAND])

        inside = times[(times >= start) & ((times < end) | (end == end_s))]
        answer = solve_ivp(
            slope, (start, end), state, method="Radau", jac=jacobian, rtol=1e-11, atol=1e-18, dense_output=True
        )
        outputs = loop.c @ answer.sol(inside)
        positions.append(outputs[SENSOR])
        currents.append(loop.magnets.current(outputs[DEMAND]))
        state = answer.y[:, -1]
    return np.concatenate(positions), np.concatenate(currents)


@pytest.mark.parametrize("name", SCENARIOS)
def test_agreement_with_a_second_integrator(name: str, half_bearing: Bearing, lead: Lead) -> None:
    """Position and current agree with Radau IIA at rtol 1e-11 to a millionth of the step and of the peak."""
    loop = close_loop(half_bearing, lead(2e6, 500.0, 5e4), SCENARIOS[name])
    trajectory = integrate(loop, 0.5e-3)
    assert trajectory.end == End.FINISHED
    times = np.linspace(0.0, 0.5e-3, 201)
    position, current = _reference(loop, 0.5e-3, times)
    np.testing.assert_allclose(trajectory.position_m(times), position, rtol=0, atol=1e-6 * 20e-6)
    np.testing.assert_allclose(trajectory.current_a(times), current, rtol=0, atol=1e-6 * np.abs(current).max())


@pytest.mark.parametrize("lags", [0, 30])
def test_agreement_with_the_exact_linear_response(lags: int, bearing: Bearing, lead: Lead) -> None:
    """With a linear force the march is the matrix exponential, also for a controller of 31 states and poles to 1e7."""
    controller = lead(2e6, 500.0, 5e4)
    for pole in np.logspace(6.5, 7.5, lags):
        controller = series(controller, StateSpace.of([[-pole]], [[pole]], [[1.0]], [[0.0]]))
    scenario = StepScenario(10e-6, 3.6, model="linear", disturbance=Disturbance(20.0, 1e-3, 0.7e-3))
    loop = close_loop(bearing, controller, scenario)
    trajectory = integrate(loop, 4e-3)
    position, current = linear_response(linearize(loop), np.linspace(0.0, 4e-3, 1001))
    times = np.linspace(0.0, 4e-3, 1001)
    np.testing.assert_allclose(trajectory.position_m(times), position, rtol=0, atol=1e-8 * 10e-6)
    np.testing.assert_allclose(trajectory.current_a(times), current, rtol=0, atol=1e-7 * np.abs(current).max())


def test_small_steps_are_linear(bearing: Bearing, lead: Lead) -> None:
    """The bearing is odd, so the nonlinear part of the response falls with the cube of the step."""
    departures = []
    for step in (20e-6, 10e-6):
        loop = close_loop(bearing, lead(), replace(STEP, step_m=step))
        times = np.linspace(0.0, 2e-3, 201)
        linear, _ = linear_response(linearize(loop), np.linspace(0.0, 2e-3, 201))
        departures.append(np.abs(integrate(loop, 2e-3).position_m(times) - linear).max())
    assert departures[0] / departures[1] == pytest.approx(8.0, rel=0.1)


def test_mirror(half_bearing: Bearing, lead: Lead) -> None:
    """A step down is a step up, turned over."""
    times = np.linspace(0.0, 1e-3, 101)
    up, down = (
        integrate(close_loop(half_bearing, lead(), replace(STEP, step_m=step, current_limit_a=3.0)), 1e-3)
        for step in (20e-6, -20e-6)
    )
    np.testing.assert_allclose(down.position_m(times), -up.position_m(times), rtol=0, atol=1e-12 * 20e-6)


def test_fall_onto_the_magnet(bearing: Bearing) -> None:
    """Without control the rotor falls as its energy says, and the time of contact is that of the quadrature."""
    scenario = StepScenario(0.0, 2.0, gravity_m_per_s2=9.8, samples=50)
    trajectory = integrate(close_loop(bearing, StateSpace.gain([[0.0]]), scenario), 1.0)
    z0, pull = 400e-6, 4e-6 * 0.5**2

    def energy(z: float) -> float:
        return pull * 2 * z**2 / (z0 * (z0**2 - z**2)) - 2.0 * 9.8 * z

    exact, _ = quad(lambda w: 2 * w / np.sqrt(energy(-(w**2))), 0.0, np.sqrt(z0), epsrel=1e-12, epsabs=0)
    assert trajectory.end == End.TOUCHED_DOWN
    assert trajectory.end_s == pytest.approx(exact, rel=1e-6)
    for time in np.linspace(0.1, 0.95, 10) * trajectory.end_s:
        speed = float(trajectory.position_m.derivative()(time))
        assert speed**2 == pytest.approx(energy(float(trajectory.position_m(time))), rel=1e-7)


def test_linear_contact(bearing: Bearing) -> None:
    """The linear rotor without control leaves the gap when its hyperbolic sine does."""
    scenario = StepScenario(0.0, 2.0, model="linear", gravity_m_per_s2=9.8)
    trajectory = integrate(close_loop(bearing, StateSpace.gain([[0.0]]), scenario), 1.0)
    rate = np.sqrt(62500.0 / 2.0)
    exact = np.arccosh(1.0 + 400e-6 * 62500.0 / (2.0 * 9.8)) / rate
    assert trajectory.end == End.TOUCHED_DOWN
    assert trajectory.end_s == pytest.approx(exact, rel=1e-9)


def test_stiff_rotor_is_rigid(bearing: Bearing, lead: Lead) -> None:
    """An elastic rotor that hardly bends moves like a rigid one."""
    times = np.linspace(0.0, 1e-3, 101)
    rigid, elastic = (
        integrate(close_loop(bearing, lead(), replace(STEP, rotor=rotor)), 1e-3)
        for rotor in (None, FlexibleRotor(0.1, 1e11, 2e5))
    )
    np.testing.assert_allclose(elastic.position_m(times), rigid.position_m(times), rtol=0, atol=1e-3 * 20e-6)


def test_contact_of_the_sensor_end(bearing: Bearing, lead: Lead) -> None:
    """A rotor that whips against the stator at its sensor has touched down, wherever its magnets are."""
    rotor = FlexibleRotor(0.2, 2e5, 1.0)
    scenario = StepScenario(0.0, 3.6, rotor=rotor, disturbance=Disturbance(2000.0, 0.0, 4e-4))
    trajectory = integrate(close_loop(bearing, lead(1e3), scenario), 0.1)
    assert trajectory.end == End.TOUCHED_DOWN


def test_current_stays_within_its_limit(bearing: Bearing, lead: Lead) -> None:
    """A gain so high that the current only knows its two limits is followed to the end."""
    loop = close_loop(bearing, lead(2e8, 2000.0, 5e4), replace(STEP, current_limit_a=1.0))
    trajectory = integrate(loop, 3e-3)
    assert trajectory.end == End.FINISHED
    assert np.abs(trajectory.current_a(np.linspace(0, 3e-3, 2001))).max() <= 1.0 + 1e-9


def test_a_force_that_is_no_number_has_no_first_step(bearing: Bearing) -> None:
    """A loop whose force overflows at t = 0 is refused there, by name."""
    loop = close_loop(bearing, StateSpace.gain([[-1e200]]), STEP)
    with pytest.raises(NumericsError, match="no first step"):
        integrate(loop, 1e-3)


def test_a_hidden_state_that_overflows_ends_the_run(bearing: Bearing, lead: Lead) -> None:
    """A mode that nobody sees still ends the run when it passes the largest number."""
    seen = lead()
    controller = StateSpace.of(np.diag([seen.a[0, 0], 5e5]), [[1.0], [1.0]], np.append(seen.c, [[0.0]], axis=1), seen.d)
    assert integrate(close_loop(bearing, controller, STEP), 1e-2).end == End.NOT_FINITE


def test_a_demand_that_runs_away_ends_the_run(bearing: Bearing) -> None:
    """A controller that diverges behind its limit is stopped before it overflows."""
    controller = StateSpace.of([[5000.0]], [[1.0]], [[-1e3]], [[-3e3]])
    loop = close_loop(bearing, controller, replace(STEP, current_limit_a=0.1, step_m=1e-7))
    trajectory = integrate(loop, 1.0)
    assert trajectory.end == End.DIVERGED
    assert "asked for more than" in trajectory.sentence

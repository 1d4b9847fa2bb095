"""The linear model touches the stator when its exact response does: also for an instant between two knots of a step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.bearing import Bearing
from magbear_cli.model.filters import SensorDynamics
from magbear_cli.model.rotor import FlexibleRotor
from magbear_cli.simulation.collocation import hull, knots
from magbear_cli.simulation.crossings import extremes
from magbear_cli.simulation.integration import integrate
from magbear_cli.simulation.linear import LinearLoop, linear_response, linearize
from magbear_cli.simulation.loop import close_loop
from magbear_cli.simulation.scenario import StepScenario
from magbear_cli.simulation.trajectory import End

GAP_M = 400e-6
GROWING = {
    "sensor": StepScenario(1e-6, 2.0, model="linear", sensor=SensorDynamics(2e5, 4e3)),
    "elastic": StepScenario(1e-6, 3.6, model="linear", rotor=FlexibleRotor(0.6, 2e6, 1.0)),
}


def _position(linear: LinearLoop, time_s: float) -> float:
    """The exact response at one time."""
    return float(linear_response(linear, np.array([0.0, time_s]))[0][-1])


def _peaks(linear: LinearLoop, duration_s: float) -> list[tuple[float, float]]:
    """The exact local maxima of |position|: times and values."""
    times = np.linspace(0.0, duration_s, 20_001)
    size = np.abs(linear_response(linear, times)[0])
    found = []
    for at in np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])) + 1:
        best = minimize_scalar(
            lambda time: -abs(_position(linear, time)),
            bounds=(times[at - 1], times[at + 1]),
            method="bounded",
            options={"xatol": 1e-13},
        )
        found.append((float(best.x), -float(best.fun)))
    return found


@pytest.mark.parametrize("excess", [1e-9, 1e-7, 1e-6, 9e-6, 1e-4, -1e-9, -1e-6])
@pytest.mark.parametrize(("gain", "mass_kg"), [(2000.0, 1.0), (5000.0, 3.7), (1e5, 2.0)])
def test_an_undamped_swing_touches_where_its_cosine_does(
    bearing: Bearing, gain: float, mass_kg: float, excess: float
) -> None:
    """A motion rest (1 − cos ωt) with peaks just beyond the gap touches at the first of them, just below it never."""
    stiffness = 50.0 * gain - 62_500.0
    omega, rest = np.sqrt(stiffness / mass_kg), 0.5 * GAP_M * (1.0 + excess)
    scenario = StepScenario(rest * stiffness / (50.0 * gain), mass_kg, model="linear")
    trajectory = integrate(close_loop(bearing, StateSpace.gain([[-gain]]), scenario), 11.3 / omega)
    if excess < 0.0:
        assert trajectory.end == End.FINISHED
        assert trajectory.end_s == 11.3 / omega
    else:
        assert trajectory.end == End.TOUCHED_DOWN
        assert trajectory.end_s == pytest.approx(np.arccos(1.0 - GAP_M / rest) / omega, rel=1e-6)


@pytest.mark.parametrize("name", list(GROWING))
@pytest.mark.parametrize("excess", [1e-6, 5e-6])
def test_a_growing_swing_touches_at_the_first_peak_that_reaches_the_gap(
    bearing: Bearing, name: str, excess: float
) -> None:
    """The time is that of the exact exponential response, not that of a later and higher peak."""
    scenario, controller = GROWING[name], StateSpace.gain([[-5000.0]])
    duration = 0.173
    peaks = _peaks(linearize(close_loop(bearing, controller, scenario)), duration)
    heights = np.array([height for _, height in peaks])
    records = [at for at in range(1, len(peaks)) if heights[at] > 1.00002 * heights[:at].max()]
    chosen = records[len(records) // 2]
    step = scenario.step_m * GAP_M * (1.0 + excess) / heights[chosen]
    loop = close_loop(bearing, controller, replace(scenario, step_m=step))
    linear, peak_s = linearize(loop), peaks[chosen][0]
    before = peak_s - 1e-2 * (peak_s - peaks[chosen - 1][0])
    exact = brentq(lambda time: abs(_position(linear, time)) - GAP_M, before, peak_s, xtol=1e-14)
    trajectory = integrate(loop, duration)
    assert trajectory.end == End.TOUCHED_DOWN
    assert trajectory.end_s == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize("seed", range(12))
def test_a_finished_run_stayed_within_the_gap(bearing: Bearing, seed: int) -> None:
    """Whatever the loop: where a run is told as finished no value of its polynomials is beyond the gap."""
    generator = np.random.default_rng(seed)
    gain, mass = float(generator.uniform(2e3, 5e4)), float(generator.uniform(1.0, 5.0))
    omega = np.sqrt((50.0 * gain - 62_500.0) / mass)
    step = GAP_M * float(generator.uniform(0.49, 0.51)) * (1.0 - 62_500.0 / (50.0 * gain))
    loop = close_loop(bearing, StateSpace.gain([[-gain]]), StepScenario(step, mass, model="linear"))
    trajectory = integrate(loop, float(generator.uniform(4.0, 30.0)) / omega)
    assert (trajectory.end == End.FINISHED) == (max(np.abs(extremes(trajectory.position_m))) < GAP_M)


def test_the_hull_holds_the_polynomial() -> None:
    """Between the coefficients of Bernstein's form lie all values, and its first and last are those at the ends."""
    generator = np.random.default_rng(3)
    for _ in range(50):
        powers = generator.normal(size=8)
        values = np.polyval(powers, knots())
        form = hull() @ values
        inside = np.polyval(powers, np.linspace(0.0, 1.0, 501))
        assert form.min() - 1e-12 <= inside.min()
        assert inside.max() <= form.max() + 1e-12
        np.testing.assert_allclose(form[[0, -1]], values[[0, -1]], atol=1e-12)

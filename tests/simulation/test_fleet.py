"""Loops marched together are the loops marched alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from magbear_cli.errors import NumericsError
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.bearing import Bearing
from magbear_cli.model.filters import Prefilter
from magbear_cli.model.rotor import FlexibleRotor
from magbear_cli.simulation.integration import integrate, integrate_fleet
from magbear_cli.simulation.loop import Fleet, close_loop
from magbear_cli.simulation.scenario import Disturbance, StepScenario
from magbear_cli.simulation.step import simulate_step, simulate_steps
from magbear_cli.simulation.trajectory import End, Trajectory

STEP = StepScenario(10e-6, 3.0, duration_s=0.02)
PULSE = Disturbance(20.0, 2e-3, 1e-3)
SCENARIOS = [
    STEP,
    replace(STEP, prefilter=Prefilter(2000.0, 1.0), gravity_m_per_s2=9.8),
    replace(STEP, current_limit_a=4.0, gravity_m_per_s2=9.8, gravity_compensation=True, disturbance=PULSE),
    replace(STEP, model="linear", disturbance=PULSE),
]


@pytest.mark.parametrize("scenario", SCENARIOS, ids=["step", "filtered", "limited", "linear"])
def test_each_loop_goes_its_own_way(bearing: Bearing, lead: Callable[..., StateSpace], scenario: StepScenario) -> None:
    """Position and current of every mass are those of a run of its own, to the tolerance of a run."""
    loops = [close_loop(bearing, lead(), replace(scenario, mass_kg=mass)) for mass in (3.0, 3.6, 4.5, 6.0)]
    times = np.linspace(0.0, 0.02, 300)
    for loop, together in zip(loops, integrate_fleet(loops, 0.02), strict=True):
        assert isinstance(together, Trajectory)
        alone = integrate(loop, 0.02)
        assert together.end == alone.end
        assert together.end_s == pytest.approx(alone.end_s, rel=1e-9)
        inside = times[times < alone.end_s]
        for mine, other in ((together.position_m, alone.position_m), (together.current_a, alone.current_a)):
            np.testing.assert_allclose(mine(inside), other(inside), rtol=0, atol=1e-8 * np.abs(other(inside)).max())


def test_one_that_ends_does_not_end_the_others(bearing: Bearing, lead: Callable[..., StateSpace]) -> None:
    """A rotor too heavy for its controller touches the stator, a light one beside it settles."""
    heavy = replace(STEP, step_m=20e-6, gravity_m_per_s2=9.8, mass_kg=60.0)
    loops = [close_loop(bearing, lead(), one) for one in (heavy, replace(heavy, mass_kg=3.0))]
    ends = [one.end for one in integrate_fleet(loops, 0.02) if isinstance(one, Trajectory)]
    assert ends == [integrate(loop, 0.02).end for loop in loops]
    assert ends == [End.TOUCHED_DOWN, End.FINISHED]


def test_loops_that_differ_otherwise_are_refused(bearing: Bearing, lead: Callable[..., StateSpace]) -> None:
    """Another controller, another step or an elastic rotor makes another linear part."""
    loop = close_loop(bearing, lead(), STEP)
    elastic = replace(STEP, rotor=FlexibleRotor(0.5, 2.6e6, 100.0))
    for other in (
        close_loop(bearing, lead(1.1e6, 3000.0), STEP),
        close_loop(bearing, lead(), replace(STEP, step_m=20e-6)),
        close_loop(bearing, lead(), elastic),
    ):
        with pytest.raises(NumericsError, match="together"):
            Fleet((loop, other))


def test_many_scenarios_are_answered_in_their_order(bearing: Bearing, lead: Callable[..., StateSpace]) -> None:
    """Runs that go together, one that cannot begin and one of a chosen duration come back each at its place."""
    impossible = replace(STEP, position_m=0.0, current_a=0.0, rotor=FlexibleRotor(5.0, 1e6))
    chosen = replace(STEP, duration_s=None)
    scenarios = [STEP, impossible, replace(STEP, mass_kg=4.5), chosen]
    first, second, third, fourth = simulate_steps(bearing, lead(), scenarios)
    assert isinstance(second, NumericsError)
    for scenario, answer in ((STEP, first), (scenarios[2], third), (chosen, fourth)):
        assert not isinstance(answer, NumericsError)
        alone = simulate_step(bearing, lead(), scenario)
        np.testing.assert_allclose(answer.position_m, alone.position_m, rtol=0, atol=1e-8 * STEP.step_m)
        assert answer.metrics.peak_current_a == pytest.approx(alone.metrics.peak_current_a, rel=1e-7)

"""Each margin is the perturbation at which a pole reaches the axis, and no smaller one does."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from magbear_cli.analysis.frequency_grid import closed_frequency_grid
from magbear_cli.analysis.loop_functions import loop_functions
from magbear_cli.analysis.margins import Margins, disk_margin, gain_margins, stability_margins
from magbear_cli.analysis.pole_family import pole_family
from magbear_cli.lti.conversion import from_transfer_function
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem

ProblemMaker = Callable[[float, float, float | None], ControlProblem]


def _times(controller: StateSpace, factor: float) -> StateSpace:
    return StateSpace(controller.a, controller.b, factor * controller.c, factor * controller.d)


@pytest.fixture
def filtered_lead() -> StateSpace:
    """A lead behind a second-order roll-off, so that the gain may not rise without end."""
    return from_transfer_function([-400.0, -8e4], np.polymul([1e-4, 1.0], [5e-5, 1.0]))


def _judge(problem: ControlProblem, controller: StateSpace) -> Margins:
    return stability_margins(problem, controller, closed_frequency_grid(problem, controller))


def test_the_loop_with_the_gain_margins_is_on_the_edge(quickstart: ControlProblem, filtered_lead: StateSpace) -> None:
    """Just inside both gain margins all masses are stable; just outside one is not."""
    masses = quickstart.mass.samples_kg(9)
    grid = closed_frequency_grid(quickstart, filtered_lead)
    low, high = gain_margins(quickstart, filtered_lead, grid)
    assert 0 < low < 1 < high < np.inf
    for factor, stable in ((low * 1.001, True), (low * 0.999, False), (high * 0.999, True), (high * 1.001, False)):
        worst = pole_family(quickstart, _times(filtered_lead, factor), masses).max_real_rad_s
        assert (worst < 0) is stable


def test_the_gain_of_a_lead_may_rise_without_end(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """No frequency makes a lead real, so only the fall to k_z/(k_i |K(0)|) matters."""
    margins = _judge(quickstart, good_lead)
    assert margins.gain_high == np.inf
    assert margins.gain_low == pytest.approx(62_500.0 / (50.0 * 7_764_165.0 * 72.0 / 17_995.0), rel=1e-9)


def test_the_phase_margin_is_the_least_over_masses(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """Against crossovers read off a very dense grid for 41 masses: K G e^{-jφ} = 1."""
    omega = np.geomspace(1e2, 1e6, 200_001)
    response = np.polyval([-7_764_165.0, -7_764_165.0 * 72.0], 1j * omega) / (1j * omega + 17_995.0)
    phases, delays = [], []
    for mass in quickstart.mass.samples_kg(41):
        gain = response * quickstart.plant(omega, mass)
        for place in np.flatnonzero(np.diff(np.sign(np.abs(gain) - 1.0))):
            angle = np.angle(gain[place])
            phases.append(abs(angle))
            delays.append(np.mod(angle, 2 * np.pi) / omega[place])
    margins = _judge(quickstart, good_lead)
    assert margins.phase_deg == pytest.approx(np.degrees(min(phases)), rel=1e-3)
    assert margins.delay_s == pytest.approx(min(delays), rel=1e-3)


def test_a_delay_at_its_margin_is_on_the_edge(thrust_problem: ProblemMaker, good_lead: StateSpace) -> None:
    """1 − K G e^{-jωτ} has a zero on the axis for the margin τ of a known mass, and none for a smaller delay."""
    problem = thrust_problem(3.0, 3.0, None)
    delay = _judge(problem, good_lead).delay_s
    omega = np.geomspace(1e2, 1e5, 400_001)
    gain = loop_functions(problem, good_lead, omega, 3.0).controller_a_per_m * problem.plant(omega, 3.0)
    assert np.abs(1 - gain * np.exp(-1j * omega * delay)).min() < 1e-3
    assert np.abs(1 - gain * np.exp(-0.9j * omega * delay)).min() > 1e-2


def test_the_disk_margin_is_the_peak_of_s_minus_t(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """Against 201 masses on a dense grid; never above 2, the value of a loop without gain."""
    omega = np.geomspace(1.0, 1e6, 4001)
    loop = loop_functions(quickstart, good_lead, omega, quickstart.mass.samples_kg(201))
    peak = np.abs(loop.sensitivity - loop.complementary_sensitivity).max()
    margin = disk_margin(quickstart, good_lead, closed_frequency_grid(quickstart, good_lead))
    assert margin == pytest.approx(2.0 / peak, rel=1e-4)
    assert margin <= 2.0 / peak * (1 + 1e-9)


def test_the_disk_margin_guarantees_gain_and_phase(quickstart: ControlProblem, filtered_lead: StateSpace) -> None:
    """Gains in [(2 − α)/(2 + α), (2 + α)/(2 − α)] and phases to 2 atan(α/2) are inside the other margins."""
    margins = _judge(quickstart, filtered_lead)
    assert margins.gain_low <= (2 - margins.disk) / (2 + margins.disk)
    assert margins.gain_high >= (2 + margins.disk) / (2 - margins.disk)
    assert margins.phase_deg >= np.degrees(2 * np.arctan(margins.disk / 2))


def test_an_integrator_lets_the_gain_fall_to_little(quickstart: ControlProblem) -> None:
    """A pole of K at zero is no point of the grid; the lower gain margin comes from elsewhere."""
    controller = from_transfer_function([-7.7e6, -7.7e6 * 72.0, -7.7e6 * 72.0 * 5.0], [1.0, 18_000.0, 0.0])
    low, high = gain_margins(quickstart, controller, closed_frequency_grid(quickstart, controller))
    masses = quickstart.mass.samples_kg(5)
    assert 0 < low < 1
    assert high == np.inf
    assert pole_family(quickstart, _times(controller, 1.001 * low), masses).max_real_rad_s < 0
    assert pole_family(quickstart, _times(controller, 0.999 * low), masses).max_real_rad_s > 0

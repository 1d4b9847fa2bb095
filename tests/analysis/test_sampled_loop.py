"""Sampled loops: poles, levels and margins by more than one way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from magbear_cli.analysis.frequency_grid import closed_frequency_grid
from magbear_cli.analysis.margins import stability_margins
from magbear_cli.analysis.sampled_loop import (
    SampledLoop,
    is_stable_on_samples,
    sampled_margins,
    sampled_poles,
    sampled_worst_case,
)
from magbear_cli.analysis.worst_case import worst_case
from magbear_cli.lti.connection import series
from magbear_cli.lti.conversion import from_zeros_poles_gain
from magbear_cli.lti.sampled_system import SampledSystem, bilinear
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.held_plant import Sampling, held_plant
from magbear_cli.model.problem import ControlProblem, RationalWeight


def _loop(problem: ControlProblem, controller: StateSpace, time: float, late: float = 1.0) -> SampledLoop:
    return SampledLoop(problem, bilinear(controller, time), Sampling(time, late * time))


def test_fast_sampling_is_continuous_time(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """At a tenth of a microsecond worst case and margins are within 1 % of those of the continuous loop."""
    loop = _loop(quickstart, good_lead, 1e-7)
    found, before = sampled_worst_case(loop), worst_case(quickstart, good_lead)
    assert found.level == pytest.approx(before.level, rel=5e-3)
    grid = closed_frequency_grid(quickstart, good_lead)
    margins, expected = sampled_margins(loop), stability_margins(quickstart, good_lead, grid)
    assert margins.gain_low == pytest.approx(expected.gain_low, rel=1e-2)
    assert margins.phase_deg == pytest.approx(expected.phase_deg, rel=1e-2)
    assert margins.disk == pytest.approx(expected.disk, rel=1e-2)
    assert margins.delay_s == pytest.approx(expected.delay_s, rel=1e-2)


@pytest.mark.parametrize("late", [0.0, 0.4, 1.0])
def test_the_level_is_that_of_the_matrices(quickstart: ControlProblem, good_lead: StateSpace, late: float) -> None:
    """|W1 S| + |W3 T| from the closed form equals that from the matrices of plant and controller."""
    loop, share = _loop(quickstart, good_lead, 3e-5, late), 0.6
    omega = np.array([50.0, 2e3, 1.2e4, 9e4])
    plant = held_plant(quickstart.family.member(share), loop.sampling)
    z = np.exp(1j * omega * 3e-5)
    gain = np.array([plant(point - 1.0)[0, 0] for point in z]) * [loop.controller.shifted(point)[0, 0] for point in z]
    sensitivity = 1.0 / (1.0 - gain)
    expected = quickstart.performance_bound(omega) * abs(sensitivity)
    expected += quickstart.bandwidth_bound(omega) * abs(gain * sensitivity)
    np.testing.assert_allclose(loop.level(omega, share), expected, rtol=1e-7)


def test_the_loop_moves_as_its_poles_say(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """The matrices of plant and controller, run step by step, decay or grow at the rate of the largest pole."""
    for time, stable in ((2e-5, True), (2e-4, False)):
        loop = _loop(quickstart, good_lead, time)
        plant, chain = held_plant(quickstart.family.first, loop.sampling), loop.controller.shifted
        a_p = plant.a + np.eye(plant.order)
        x_p, x_k = np.eye(plant.order)[0], np.zeros(chain.order)
        sizes = []
        for _ in range(4000 if stable else 400):
            y = float(plant.c[0] @ x_p)
            u = float(chain.c[0] @ x_k + chain.d[0, 0] * y)
            x_k = chain.a @ x_k + chain.b[:, 0] * y
            x_p = a_p @ x_p + plant.b[:, 0] * u
            sizes.append(float(np.abs(x_p[:2] / [1.0, 1e3]).max()))
        rate = (sizes[-1] / sizes[-201]) ** (1.0 / 200.0)
        assert rate == pytest.approx(float(np.abs(sampled_poles(loop, 0.0)).max()), rel=2e-2)
        assert is_stable_on_samples(loop) is stable


def test_margins_are_where_the_loop_ends(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """A gain just inside the margins is stable, one just outside is not; likewise for the delay."""
    loop = _loop(quickstart, good_lead, 2e-5)
    margins = sampled_margins(loop)

    def with_gain(factor: float) -> SampledLoop:
        last = loop.controller.sections[-1]
        louder = StateSpace(last.a, last.b, factor * last.c, factor * last.d)
        return replace(loop, controller=SampledSystem((*loop.controller.sections[:-1], louder), 2e-5))

    assert is_stable_on_samples(with_gain(margins.gain_high * 0.995))
    assert not is_stable_on_samples(with_gain(margins.gain_high * 1.005))
    assert is_stable_on_samples(with_gain(margins.gain_low * 1.005))
    assert not is_stable_on_samples(with_gain(margins.gain_low * 0.995))
    for part, stable in ((0.98, True), (1.03, False)):
        later = Sampling(2e-5, 2e-5 + part * margins.delay_s)
        assert is_stable_on_samples(replace(loop, sampling=later)) is stable


def test_an_integrator_is_no_crossing(slow_pi: StateSpace) -> None:
    """The gain may fall to where the loop's phase crosses 180 degrees at 35.6 rad/s; a little more is not stable."""
    problem = ControlProblem.of_mass(62_500.0, 50.0, (3.6, 3.6), RationalWeight((0.4, 4.0), (1.0, 0.01)), None)
    loop = _loop(problem, slow_pi, 2e-5)
    margins = sampled_margins(loop)
    assert margins.gain_low == pytest.approx(0.583023, rel=5e-4)
    assert margins.gain_low <= (2 - margins.disk) / (2 + margins.disk)
    for part, stable in ((1.001, True), (0.999, False)):
        weaker = StateSpace(
            slow_pi.a, slow_pi.b, part * margins.gain_low * slow_pi.c, part * margins.gain_low * slow_pi.d
        )
        assert is_stable_on_samples(_loop(problem, weaker, 2e-5)) is stable


@pytest.mark.parametrize("integrators", [0, 1, 2])
@pytest.mark.parametrize("slow_rad_s", [0.5, 5.0, 20.0])
def test_no_margin_is_tighter_than_the_disk_allows(integrators: int, slow_rad_s: float) -> None:
    """Gains from (2 − α)/(2 + α) to its inverse and phases up to 2 atan(α/2), with none to two integrators."""
    zeros, poles = [-60.0, *[-slow_rad_s] * integrators], [-2e4, *[0.0] * integrators]
    problem = ControlProblem.of_mass(62_500.0, 50.0, (3.0, 3.9), RationalWeight((0.4, 4.0), (1.0, 0.01)), None)
    loop = _loop(problem, from_zeros_poles_gain(zeros, poles, -8e5 * 20.0), 2e-5)
    assert is_stable_on_samples(loop)
    margins = sampled_margins(loop)
    least = (2 - margins.disk) / (2 + margins.disk)
    assert margins.gain_low <= least * (1 + 1e-9)
    assert margins.gain_high >= (1 - 1e-9) / least
    assert margins.phase_deg >= np.degrees(2 * np.arctan(margins.disk / 2)) * (1 - 1e-9)


def test_a_narrow_peak_of_the_weight_is_seen_between_the_points(
    narrow_peak: ControlProblem, blind_to_the_peak: StateSpace
) -> None:
    """A peak of 0.01 % damping is found in the sampled loop as well, as by a grid laid around it by hand."""
    damping = 1e-4
    num = np.polymul([0.5, 50.0], [1.0, 20.0 * damping * 300.0, 9e4])
    den = np.polymul([1.0, 0.05], [1.0, 2.0 * damping * 300.0, 9e4])
    problem = replace(narrow_peak, performance=RationalWeight(tuple(num), tuple(den)))
    loop = _loop(problem, blind_to_the_peak, 1e-6)
    omega = 300.0 * (1.0 + damping * np.linspace(-20.0, 20.0, 4001))
    by_hand = loop.levels(omega, problem.family.shares(33)).max()
    assert sampled_worst_case(loop).level == pytest.approx(by_hand, rel=1e-4)


def test_a_light_pole_of_the_controller_is_seen_in_the_sampled_loop(
    quickstart: ControlProblem, good_lead: StateSpace
) -> None:
    """A pole and a zero of 0.01 % damping side by side in the controller leave their mark on the worst case."""
    pair = from_zeros_poles_gain([-0.1 - 1001.0j, -0.1 + 1001.0j], [-0.1 - 1000.0j, -0.1 + 1000.0j], 1.0)
    loop = _loop(quickstart, series(pair, good_lead), 1e-6)
    omega = np.linspace(990.0, 1011.0, 40_001)
    by_hand = loop.levels(omega, quickstart.family.shares(33)).max()
    assert sampled_worst_case(loop).level >= by_hand * (1.0 - 1e-4)

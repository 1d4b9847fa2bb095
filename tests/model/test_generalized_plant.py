"""The generalised plant, closed with any controller, has the closed forms of S and T."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.lti.conversion import from_transfer_function
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.generalized_plant import (
    GeneralizedPlant,
    build_generalized_plant,
    build_mixed_sensitivity_plant,
)
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.model.robust_performance import interconnection

OMEGA = np.geomspace(1.0, 1e6, 61)
LEAD = from_transfer_function([-60.0, -60.0 * 500.0], [1.0 / 3e4, 1.0])
WEIGHTS = {
    "low-pass": RationalWeight.low_pass(10.0, 200.0),
    "second order": RationalWeight((360000.0,), (1.0, 400.0, 40000.0)),
    "biproper": RationalWeight((0.5, 300.0), (1.0, 3.0)),
    "constant": RationalWeight((0.7,), (1.0,)),
}


def _problem(low: float, high: float, weight: str = "low-pass", omega_c: float | None = 2e4) -> ControlProblem:
    return ControlProblem.of_mass(62500.0, 50.0, (low, high), WEIGHTS[weight], omega_c)


def _loop(
    problem: ControlProblem, share: float, controller: StateSpace
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """S and T of a member, from the loop's equations."""
    gain, plant = frequency_response(controller, OMEGA)[:, 0, 0], problem.plant(OMEGA, share)
    sensitivity = 1.0 / (1.0 - gain * plant)
    return sensitivity, -gain * plant * sensitivity


@pytest.mark.parametrize("weight", WEIGHTS)
def test_known_mass_gives_weighted_s_and_t(weight: str) -> None:
    """For a known mass the loop is [W1 S, W1 S; −W3 T, −W3 T], and with one disturbance [W1 S; −W3 T]."""
    problem = _problem(2.0, 2.0, weight)
    s, t = _loop(problem, 0.0, LEAD)
    w1, w3 = problem.performance(1j * OMEGA), (1j * OMEGA / 2e4) ** 2
    plant = build_generalized_plant(problem)
    assert plant.inputs == ("disturbance_w1", "disturbance_w3", "control")
    assert plant.outputs == ("weighted_sensitivity", "weighted_complementary", "measurement")
    response = frequency_response(plant.closed_by(LEAD), OMEGA)
    expected = np.stack([w1 * s, -w3 * t], axis=-1)
    np.testing.assert_allclose(response, np.stack([expected, expected], axis=-1), rtol=1e-8, atol=1e-12)
    single = build_mixed_sensitivity_plant(problem)
    assert single.inputs == ("disturbance", "control")
    np.testing.assert_allclose(
        frequency_response(single.closed_by(LEAD), OMEGA)[:, :, 0], expected, rtol=1e-8, atol=1e-12
    )


@pytest.mark.parametrize("omega_c", [2e4, None])
@pytest.mark.parametrize(("low", "high"), [(3.0, 4.5), (2.2, 4.5), (2.0, 2.0)])
@pytest.mark.parametrize("weight", WEIGHTS)
def test_agrees_with_the_closed_form_interconnection(
    weight: str, low: float, high: float, omega_c: float | None
) -> None:
    """The loop equals the closed form used for analysis, up to the unit of the mass channel."""
    problem = _problem(low, high, weight, omega_c)
    ours = frequency_response(build_generalized_plant(problem).closed_by(LEAD), OMEGA)
    theirs = interconnection(problem, frequency_response(LEAD, OMEGA)[:, 0, 0], OMEGA)
    assert ours.shape == theirs.shape
    if low < high:
        unit = ours[0, 1, 0] / theirs[0, 1, 0]
        ours[:, :, 0] /= unit
        ours[:, 0, :] *= unit
        assert unit.imag == pytest.approx(0.0, abs=1e-9 * abs(unit))
    np.testing.assert_allclose(ours, theirs, rtol=1e-7, atol=1e-9 * np.abs(theirs).max())


@settings(deadline=None, max_examples=30)
@given(st.floats(-1.0, 1.0), st.floats(0.5, 10.0), st.floats(1.0, 2.5))
def test_closing_the_mass_channel_moves_the_mass(delta: float, low: float, ratio: float) -> None:
    """Feeding δ times the force back gives exactly S and T of the member with δ."""
    problem = _problem(low, low * ratio * 1.001)
    loop = frequency_response(build_generalized_plant(problem).closed_by(LEAD), OMEGA)
    back = delta / (1.0 - delta * loop[:, 0, 0])
    closed = loop[:, 1:, 1:] + loop[:, 1:, :1] * back[:, None, None] * loop[:, :1, 1:]
    s, t = _loop(problem, 0.5 * (1.0 - delta), LEAD)
    w1, w3 = problem.performance(1j * OMEGA), (1j * OMEGA / 2e4) ** 2
    np.testing.assert_allclose(closed[:, 0, 0], w1 * s, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(closed[:, 1, 1], -w3 * t, rtol=1e-6, atol=1e-9)


def test_without_a_bandwidth_limit_there_is_no_third_output() -> None:
    """A problem without omega_c has neither the channel nor its disturbance."""
    plant = build_generalized_plant(_problem(3.0, 4.5, omega_c=None))
    assert plant.inputs == ("mass_uncertainty", "disturbance_w1", "control")
    assert plant.outputs == ("force", "weighted_sensitivity", "measurement")


def test_as_printed_differs_only_in_the_third_output() -> None:
    """The printed form has −k_i/m times the position coefficient, and no contribution of the uncertainty."""
    problem = _problem(3.0, 4.5)
    mended, printed = build_generalized_plant(problem).system, build_generalized_plant(problem, "as_printed").system
    np.testing.assert_array_equal(mended.a, printed.a)
    np.testing.assert_array_equal(mended.b, printed.b)
    np.testing.assert_array_equal(mended.c[[0, 1, 3]], printed.c[[0, 1, 3]])
    nominal = problem.nominal.mass_kg
    assert nominal == pytest.approx(3.6)
    assert mended.c[2, 0] == pytest.approx(62500.0 / nominal / 2e4**2)
    assert printed.c[2, 0] == pytest.approx(-50.0 / nominal * 62500.0 / nominal / 2e4**2)
    assert mended.d[2, 0] == pytest.approx(5.5556e-2 / 2e4**2, rel=1e-4)
    assert printed.d[2, 0] == 0.0
    assert mended.d[2, 3] == printed.d[2, 3] == pytest.approx(50.0 / nominal / 2e4**2)


def test_every_channel_has_a_name() -> None:
    """A plant with too few names is refused."""
    with pytest.raises(NumericsError, match="needs a name"):
        GeneralizedPlant(StateSpace.gain(np.eye(2)), ("a",), ("b", "c"))

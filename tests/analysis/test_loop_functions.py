"""S, T and K S are what their definitions say."""

from __future__ import annotations

import numpy as np
import pytest

from magbear_cli.analysis.loop_functions import (
    controller_response,
    loop_functions,
    peak_control_sensitivity,
    peak_controller_gain,
)
from magbear_cli.errors import NumericsError
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem

OMEGA = np.geomspace(1.0, 1e6, 200)


def test_s_and_t_add_to_one_and_follow_their_definitions(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """S + T = 1, S = 1/(1 − K G), T = −K G S, for each member."""
    loop = loop_functions(quickstart, good_lead, OMEGA, [0.0, 0.5, 1.0])
    gain = loop.controller_a_per_m * quickstart.plant(OMEGA, loop.shares[:, None])
    np.testing.assert_allclose(loop.sensitivity + loop.complementary_sensitivity, 1.0, rtol=1e-12)
    np.testing.assert_allclose(loop.sensitivity, 1.0 / (1.0 - gain), rtol=1e-10)
    np.testing.assert_allclose(loop.complementary_sensitivity, -gain * loop.sensitivity, rtol=1e-10)
    np.testing.assert_allclose(loop.control_sensitivity_a_per_m, loop.controller_a_per_m * loop.sensitivity)
    assert loop.sensitivity.shape == (3, OMEGA.size)


def test_the_controller_response_is_its_transfer_function(good_lead: StateSpace) -> None:
    """K(jω) is C (jω I − A)⁻¹ B + D."""
    expected = [good_lead(1j * omega)[0, 0] for omega in OMEGA]
    np.testing.assert_allclose(controller_response(good_lead, OMEGA), expected, rtol=1e-10)


def test_the_peaks_of_a_lead_are_its_direct_gain(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """|K| of a lead rises to |D| at infinity, where S is one."""
    assert peak_controller_gain(good_lead, OMEGA) == (7_764_165.0, np.inf)
    peak, _ = peak_control_sensitivity(quickstart, good_lead, OMEGA, 0.5)
    sampled = loop_functions(quickstart, good_lead, np.geomspace(1.0, 1e7, 20_000), 0.5).control_sensitivity_a_per_m
    assert peak >= np.abs(sampled).max() * (1.0 - 1e-9)
    assert peak <= max(np.abs(sampled).max(), 7_764_165.0) * (1.0 + 1e-6)


def test_a_controller_of_another_size_is_refused() -> None:
    """A controller with two inputs ends in a sentence."""
    with pytest.raises(NumericsError, match="one input"):
        controller_response(StateSpace.gain([[1.0, 2.0]]), OMEGA)

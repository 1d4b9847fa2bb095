"""python-control, which shares no code with this project, sees the same loops."""

from __future__ import annotations

import warnings
from types import ModuleType

import numpy as np
import pytest

from magbear_cli.analysis.loop_functions import loop_functions
from magbear_cli.analysis.margins import gain_margins
from magbear_cli.analysis.pole_family import pole_family
from magbear_cli.lti.norm import hinf_norm
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem

MASSES = (3.0, 3.6, 4.5)
SHARES = [(1.0 / mass - 1.0 / 3.0) / (1.0 / 4.5 - 1.0 / 3.0) for mass in MASSES]  # of 3.0-4.5 kg


@pytest.fixture(scope="module")
def control() -> ModuleType:
    """The library; what it warns of while it is imported is its own."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import control
    return control  # type: ignore[no-any-return]


def test_s_and_t_are_those_of_the_second_library(
    control: ModuleType, quickstart: ControlProblem, good_lead: StateSpace
) -> None:
    """S and T of three masses agree to nine digits over ten decades of frequency."""
    omega = np.logspace(-2, 8, 200)
    ours = loop_functions(quickstart, good_lead, omega, SHARES)
    controller = control.ss(good_lead.a, good_lead.b, good_lead.c, good_lead.d)
    for row, mass in enumerate(MASSES):
        plant = control.ss([[0.0, 1.0], [62_500.0 / mass, 0.0]], [[0.0], [50.0 / mass]], [[1.0, 0.0]], [[0.0]])
        sensitivity = control.feedback(1, plant * controller, sign=1)(1j * omega)
        np.testing.assert_allclose(ours.sensitivity[row], sensitivity, rtol=1e-9)
        np.testing.assert_allclose(ours.complementary_sensitivity[row], 1.0 - sensitivity, rtol=1e-6, atol=1e-12)


def test_closed_loop_poles_are_those_of_the_second_library(
    control: ModuleType, quickstart: ControlProblem, good_lead: StateSpace
) -> None:
    """The poles of each mass agree."""
    family = pole_family(quickstart, good_lead, np.array(SHARES))
    controller = control.ss(good_lead.a, good_lead.b, good_lead.c, good_lead.d)
    for row, mass in enumerate(MASSES):
        plant = control.ss([[0.0, 1.0], [62_500.0 / mass, 0.0]], [[0.0], [50.0 / mass]], [[1.0, 0.0]], [[0.0]])
        poles = np.sort_complex(control.poles(control.feedback(1, plant * controller, sign=1)))
        np.testing.assert_allclose(np.sort_complex(family.poles_rad_s[row]), poles, rtol=1e-8)


def test_the_norm_is_that_of_the_second_library(control: ModuleType) -> None:
    """The H-infinity norm of a resonance, 1/(2 zeta) and a little, agrees."""
    system = StateSpace.of([[0.0, 1.0], [-1e6, -20.0]], [[0.0], [1e6]], [[1.0, 0.0]], [[0.0]])
    norm, omega = hinf_norm(system)
    theirs, at = control.linfnorm(control.ss(system.a, system.b, system.c, system.d))
    assert norm == pytest.approx(theirs, rel=1e-5)
    assert omega == pytest.approx(at, rel=1e-2)


def test_the_gain_margins_are_those_of_the_second_library(
    control: ModuleType, quickstart: ControlProblem, good_lead: StateSpace
) -> None:
    """The factors by which the gain may fall and rise agree for the mass where they are least."""
    low, high = gain_margins(quickstart, good_lead, np.logspace(-2, 8, 2000))
    assert low < 1 < high
    controller = control.ss(good_lead.a, good_lead.b, good_lead.c, good_lead.d)
    for factor, is_stable in ((low * 1.001, True), (low * 0.999, False)):
        unstable = 0
        for mass in np.linspace(3.0, 4.5, 7):
            plant = control.ss([[0.0, 1.0], [62_500.0 / mass, 0.0]], [[0.0], [50.0 / mass]], [[1.0, 0.0]], [[0.0]])
            loop = control.feedback(1, plant * controller * factor, sign=1)
            unstable += int(np.max(control.poles(loop).real) > 0)
        assert (unstable == 0) == is_stable

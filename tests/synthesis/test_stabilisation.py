"""The screen that keeps destabilising candidates out."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.scaling import scale_problem
from magbear_cli.synthesis.stabilisation import stabilises

Maker = Callable[[float, float, float | None], ControlProblem]


@pytest.mark.parametrize(("gain", "stable"), [(-2.0, True), (-0.5, False), (2.0, False)])
def test_a_lead_must_outweigh_the_negative_stiffness(thrust_problem: Maker, gain: float, *, stable: bool) -> None:
    """K = gain (1 + s)/(1 + s/50) holds the scaled rotor only when its stiffness exceeds one."""
    scaled, _ = scale_problem(thrust_problem(3.0, 4.5, 2e4))
    lead = StateSpace.of([[-50.0]], [[1.0]], [[-49.0 * 50.0 * gain]], [[50.0 * gain]])
    assert stabilises(scaled, lead) is stable

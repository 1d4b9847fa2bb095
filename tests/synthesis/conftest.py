"""Problems that several synthesis tests share."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from magbear_cli.model.problem import ControlProblem, MassRange, RationalWeight

ProblemMaker = Callable[[float, float, float | None], ControlProblem]


@pytest.fixture
def thrust_problem() -> ProblemMaker:
    """The thesis's thrust bearing with W1 = 2000/(s + 200), for a mass range and a bandwidth limit."""

    def make(low_kg: float, high_kg: float, omega_c_rad_s: float | None) -> ControlProblem:
        weight = RationalWeight.low_pass(10.0, 200.0)
        return ControlProblem(62500.0, 50.0, MassRange(low_kg, high_kg), weight, omega_c_rad_s)

    return make

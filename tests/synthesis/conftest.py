"""Problems that several synthesis tests share."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from magbear_cli.model.problem import ControlProblem, RationalWeight

ProblemMaker = Callable[[float, float, float | None], ControlProblem]


@pytest.fixture
def thrust_problem() -> ProblemMaker:
    """The thesis's thrust bearing with W1 = 2000/(s + 200), for a mass range and a bandwidth limit."""

    def make(low_kg: float, high_kg: float, omega_c_rad_s: float | None) -> ControlProblem:
        weight = RationalWeight.low_pass(10.0, 200.0)
        return ControlProblem.of_mass(62500.0, 50.0, (low_kg, high_kg), weight, omega_c_rad_s)

    return make


@pytest.fixture
def peaked_problem() -> Callable[[float, float], ControlProblem]:
    """The thrust bearing with W1 = (0.5 s + 50)/(s + 0.05) and a peak upon it, by its frequency and damping."""

    def make(peak_rad_s: float, damping: float) -> ControlProblem:
        num = np.polymul([0.5, 50.0], [1.0, 40.0 * damping * peak_rad_s, peak_rad_s**2])
        den = np.polymul([1.0, 0.05], [1.0, 2.0 * damping * peak_rad_s, peak_rad_s**2])
        return ControlProblem.of_mass(62500.0, 50.0, (3.0, 4.5), RationalWeight(tuple(num), tuple(den)), 20_000.0)

    return make

"""Values that rule each other out, against the numerics that know why."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from magbear_cli.model.bearing import Bearing, CurrentLaw, linearization
from magbear_cli.spec import Problem, StudyError, read_study_text

GAP_M, BIAS_A = 4.0e-4, 1.0
STUDY = """\
magbear: 1
name: point
bearing: {{air_gap_m: 4.0e-4, force_constant_n_m2_per_a2: 1.0e-5, bias_current_a: 1.0, current_law: {law}}}
operating_point: {{position_m: {position!r}, current_a: {current!r}}}
mass_kg: 3.0
performance: {{dc_gain: 10, corner_rad_s: 200}}
controller: {{method: mu_convex}}
"""
POSITIONS = [-3.9e-4, -2.0e-4, -1.0e-6, 0.0, 1.0e-5, 1.5e-4, 3.5e-4]
CURRENTS = [-500.0, -20.0, -3.0, -1.5, -1.0, 0.0, 0.7, 1.2, 2.5, 9.0, 500.0]


def _refusal(text: str) -> tuple[Problem, ...]:
    try:
        read_study_text(text, "study.yaml")
    except StudyError as error:
        return error.problems
    return ()


@pytest.mark.parametrize("law", list(CurrentLaw))
@pytest.mark.parametrize("position", POSITIONS)
def test_an_operating_point_pulls_more_with_more_current(law: CurrentLaw, position: float) -> None:
    """It is refused where the linearisation has k_i <= 0, with that value, and legal everywhere else."""
    bearing = Bearing(GAP_M, 1.0e-5, BIAS_A, law)
    for current in CURRENTS:
        k_i = linearization(bearing, position, current).current_stiffness_n_per_a
        problems = _refusal(STUDY.format(law=law.value, position=position, current=current))
        assert bool(problems) == (k_i <= 0.0), (current, k_i)
        for problem in problems:
            assert (problem.code, problem.line) == ("E114", 4)
            assert f"k_i = {k_i:.3g} N/A" in problem.sentence


@pytest.mark.parametrize(("position", "current"), [(1.5e-4, -3.0), (-2.0e-4, 9.0)])
def test_the_remedy_names_the_current_at_which_the_sign_changes(position: float, current: float) -> None:
    """On one side of it the linearisation has k_i > 0, on the other k_i < 0; the half law has k_i > 0 there."""
    (problem,) = _refusal(STUDY.format(law="full", position=position, current=current))
    words = problem.remedy.split()
    side, limit = words[3], float(words[4])
    bearing = Bearing(GAP_M, 1.0e-5, BIAS_A)
    sign = 1.0 if side == "above" else -1.0
    assert linearization(bearing, position, limit + sign * 2e-3).current_stiffness_n_per_a > 0.0
    assert linearization(bearing, position, limit - sign * 2e-3).current_stiffness_n_per_a < 0.0
    assert _refusal(STUDY.format(law="half_switched", position=position, current=current)) == ()


def test_a_swept_operating_point_is_refused_at_its_value(refused: Callable[..., Any]) -> None:
    """A swept current is refused at the value that has the fault."""
    text = STUDY.format(law="full", position=1.5e-4, current=0.0)
    (problem,) = refused(text + "sweep: {operating_point.current_a: [0.0, -3.0]}\n")
    assert problem.line == 8
    assert "more current must pull more" in problem.sentence

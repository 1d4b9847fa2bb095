"""Where two studies differ, and where they only seem to."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from magbear_cli.errors import Status
from magbear_cli.study.comparison import Difference, compare_studies
from magbear_cli.study.outcome import CaseOutcome, StepOutcome, StudyResults, Summary


def case(index: int = 0, worst_case: float | None = 0.5, **changes: Any) -> CaseOutcome:  # noqa: ANN401 - any field
    """A finished case; each index has a bandwidth limit of its own."""
    inputs = {
        "controller": {"method": "fixed_order", "order": 1},
        "mass_kg": [3.0, 4.5],
        "bandwidth": {"omega_c_rad_s": 1e4 * (index + 1)},
    }
    made = CaseOutcome(f"{index:016x}", index, inputs, Status.OK, summary=Summary(worst_case=worst_case, order=1))
    return replace(made, **changes)


def step(**changes: Any) -> StepOutcome:  # noqa: ANN401 - any field
    """A step response without samples."""
    figures: dict[str, Any] = {"settling_time_s": 1e-3, "overshoot": 0.1, "rise_time_s": 1e-4, "peak_current_a": 2.0}
    empty = [np.empty(0)] * 6
    made = StepOutcome(3.0, 1e-5, "nonlinear", "lqg", {}, "finished", "", **figures, final_error_m=0.0, **_named(empty))
    return replace(made, **changes)


def _named(arrays: list[Any]) -> dict[str, Any]:
    names = ("time_s", "position_m", "current_a", "reference_m", "linear_position_m", "linear_current_a")
    return dict(zip(names, arrays, strict=True))


def study(*outcomes: CaseOutcome) -> StudyResults:
    """A study of these cases."""
    return StudyResults("s", "", outcomes, {}, {})


def differences(one: StudyResults, two: StudyResults, rtol: float = 1e-6) -> list[tuple[str, object, object]]:
    """Figure, first and second of each difference."""
    return [(found.figure, found.first, found.second) for found in compare_studies(one, two, rtol)]


def test_equal_studies_do_not_differ() -> None:
    """A study is itself, whatever the order of the cases and whatever their identities and sentences."""
    one = study(case(0), case(1))
    two = study(case(1, case_id="f" * 16, sentence="other words"), replace(case(0), index=1))
    assert compare_studies(one, one, 0.0) == []
    assert compare_studies(one, two, 0.0) == []


@pytest.mark.parametrize(("moved", "count"), [(0.5 * (1 + 0.9e-3), 0), (0.5 * (1 + 1.1e-3), 1), (None, 1)])
def test_the_tolerance_is_relative(moved: float | None, count: int) -> None:
    """A figure within the tolerance is the same, one beyond it or missing is not."""
    assert len(differences(study(case()), study(case(worst_case=moved)), 1e-3)) == count


def test_a_status_is_not_a_number() -> None:
    """However wide the tolerance, another status, another order of kind and another truth are differences."""
    other = case(status=Status.TIMEOUT, summary=Summary(verified=True, worst_case=0.5, order=1))
    figures = {figure for figure, _, _ in differences(study(case()), study(other), 1e9)}
    assert {"status", "verified"} <= figures


def test_the_place_of_a_flat_maximum_is_not_compared() -> None:
    """Where the worst case is may jump when its value does not move."""
    here = case(summary=Summary(worst_case=0.5, worst_omega_rad_s=10.0, worst_mass_kg=3.0))
    there = case(summary=Summary(worst_case=0.5, worst_omega_rad_s=1e4, worst_mass_kg=4.5))
    assert differences(study(here), study(there)) == []


def test_a_case_of_one_study_only_is_a_difference() -> None:
    """Both directions are told."""
    found = differences(study(case(0), case(1)), study(case(1), case(2)))
    assert found == [("case", "present", "missing"), ("case", "missing", "present")]


def test_a_changed_weight_shows_as_changed_figures() -> None:
    """Cases are matched by method, masses and bandwidth limit, so a stricter weight is no other case."""
    changed = case(worst_case=0.7)
    changed = replace(changed, inputs={**changed.inputs, "performance": {"num": [1.0], "den": [1.0]}})
    assert differences(study(case()), study(changed)) == [("worst_case", 0.5, 0.7)]


def test_cases_of_one_label_are_matched_in_their_order() -> None:
    """A study may sweep what a label does not name; the second is then compared with the second."""
    one = study(case(), case(worst_case=0.6, case_id="b" * 16))
    two = study(case(), case(worst_case=0.8, case_id="c" * 16))
    (found,) = compare_studies(one, two, 1e-6)
    assert (found.figure, found.first, found.second) == ("worst_case", 0.6, 0.8)
    assert found.case.endswith("(#2)")


def test_steps_are_compared_figure_by_figure() -> None:
    """A moved peak current, a touch-down and another number of steps are told with their place."""
    one = case(steps=(step(), step()))
    moved = case(steps=(step(), step(peak_current_a=3.0, end="touched_down", settling_time_s=None)))
    found = {figure: (first, second) for figure, first, second in differences(study(one), study(moved))}
    assert found["step 2 peak_current_a"] == (2.0, 3.0)
    assert found["step 2 touched_down"] == (False, True)
    assert found["step 2 settling_time_s"] == (1e-3, None)
    assert differences(study(one), study(case(steps=(step(),)))) == [("steps", 2, 1)]


def test_rounding_near_zero_is_no_difference() -> None:
    """What is left of a step, and a fraction near zero, are measured against the step and against one."""
    one = case(steps=(step(final_error_m=2e-19, overshoot=1e-12),))
    two = case(steps=(step(final_error_m=-3e-13, overshoot=0.0),))
    assert differences(study(one), study(two)) == []
    assert len(differences(study(one), study(case(steps=(step(final_error_m=2e-8, overshoot=0.01),))))) == 2


def test_numbers_that_are_none_agree_with_each_other() -> None:
    """NaN on both sides is no difference: both have no such figure."""
    nowhere = case(summary=Summary(worst_case=float("nan")))
    assert differences(study(nowhere), study(nowhere)) == []


def test_a_difference_is_a_line_and_a_document() -> None:
    """It can be read by a person and by a program."""
    found = Difference("lqg m=3 kg", "worst_case", 0.5, 1.0 / 3.0)
    assert str(found) == "lqg m=3 kg: worst_case: 0.5 != 0.333333"
    assert json.loads(json.dumps(found.document()))["second"] == 1.0 / 3.0

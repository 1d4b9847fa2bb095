"""The verdict in words."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from magbear_cli.errors import Status
from magbear_cli.report.series import Labels
from magbear_cli.report.verdict import STATUS_MARKS, STATUS_WORDS, headline, remarks
from magbear_cli.study.outcome import CaseOutcome, StudyResults

MakeCase = Callable[..., CaseOutcome]
MakeStudy = Callable[..., StudyResults]


def test_verified_is_said_of_verified_cases_alone(make_case: MakeCase) -> None:
    """The headline counts what the independent check confirmed, and says so when it confirmed nothing."""
    good = make_case(0)
    believed = replace(good, summary=replace(good.summary, verified=False))
    assert headline([good, good]) == "All 2 cases meet the specification, proven for every mass and frequency."
    assert "1 of them proven" in headline([good, believed])
    assert "none is verified" in headline([believed])
    assert headline([make_case(0, status=Status.FAILED, curves=False)]) == "The case does not meet the specification."


@pytest.mark.parametrize("status", [status for status in Status if status != Status.OK])
def test_proven_and_not_found_are_never_confused(make_case: MakeCase, make_study: MakeStudy, status: Status) -> None:
    """The word of proof is used for infeasible cases and for no others."""
    cases = [make_case(index, status=status, curves=False) for index in range(2)]
    for count in (1, 2):
        study = make_study(*cases[:count])
        told = " ".join(remarks(study, Labels(study.outcomes)))
        assert f"{count} case" in told
        assert ("proven impossible" in told) == (status == Status.INFEASIBLE)
        assert ("does not prove" in told) == (status == Status.NOT_ACHIEVED)
    assert status in STATUS_MARKS
    assert status in STATUS_WORDS


def test_the_simplest_controller_is_named_beside_the_best(make_case: MakeCase, make_study: MakeStudy) -> None:
    """Of several verified controllers for one problem, the one with the fewest states and the best are compared."""
    simple = make_case(0, controller={"method": "fixed_order", "order": 1}, order=1, steps=False)
    rich = make_case(1, order=12, steps=False)
    rich = replace(rich, summary=replace(rich.summary, worst_case=0.9 * (simple.summary.worst_case or 0.0)))
    study = make_study(rich, simple)
    (sentence,) = remarks(study, Labels(study.outcomes))
    assert sentence.index("fixed_order 1 with 1 state") < sentence.index("mu_convex with 12 states")


def test_touch_downs_are_counted(mixed_study: StudyResults) -> None:
    """A run that ended at the stator is not among those that settled."""
    told = " ".join(remarks(mixed_study, Labels(mixed_study.outcomes)))
    assert "Of 4 step responses, 3 settled, 1 touched down." in told

"""The rows of the tables."""

from __future__ import annotations

from magbear_cli.errors import Status
from magbear_cli.report.series import Labels
from magbear_cli.report.tables import CASE_HEADS, STEP_HEADS, case_rows, failures, step_groups
from magbear_cli.study.outcome import StudyResults


def test_a_touch_down_is_words_not_numbers(mixed_study: StudyResults) -> None:
    """The row of a run that ended at the stator has no settling time or overshoot, but its end in words."""
    (group,) = step_groups(mixed_study, Labels(mixed_study.outcomes))
    fallen, *others = group.rows
    assert fallen.end == "touches down after 0.200 ms"
    assert [fallen.cells[place] for place in (1, 2, 3, 5)] == ["–"] * 4
    assert all(row.end == "settled" and "–" not in row.cells for row in others)
    assert len(fallen.cells) == len(STEP_HEADS)


def test_every_case_that_is_not_ok_has_its_reason_and_repro_line(mixed_study: StudyResults) -> None:
    """Failures and negative answers are listed with the sentence of the case and the command that repeats it."""
    found = failures(mixed_study, Labels(mixed_study.outcomes))
    bad = [outcome for outcome in mixed_study.outcomes if outcome.status != Status.OK]
    assert [(failure.case_id, failure.sentence) for failure in found] == [(case.case_id, case.sentence) for case in bad]
    assert all(failure.case_id in failure.repro for failure in found)


def test_rows_have_a_cell_for_each_head(mixed_study: StudyResults) -> None:
    """A case without arrays has dashes, not fewer cells."""
    rows = case_rows(mixed_study, Labels(mixed_study.outcomes))
    assert {len(row.cells) for row in rows} == {len(CASE_HEADS)}
    assert rows[-1].cells[2:] == ("–",) * (len(CASE_HEADS) - 2)
    assert [row.verified for row in rows] == ["yes", "yes", "no", "no", "no"]

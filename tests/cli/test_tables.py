"""The tables on the terminal: every case, no line too long."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from magbear_cli.cli import tables
from magbear_cli.cli.tables import study_tables
from magbear_cli.errors import Status
from magbear_cli.store.results import read_results
from magbear_cli.study.outcome import StudyResults, Summary


@pytest.fixture
def results(finished: Path) -> StudyResults:
    """A small study as it was stored."""
    return read_results(finished / "results.h5")


@pytest.mark.parametrize("columns", [80, 100])
def test_no_line_is_longer_than_the_terminal(
    results: StudyResults, monkeypatch: pytest.MonkeyPatch, columns: int
) -> None:
    """On a terminal of 80 columns no figure is cut off, however long a name is."""
    long = {**results.outcomes[0].inputs, "mass_kg": [3.125, 4.375]}
    long["controller"] = {"method": "fixed_order", "order": 2, "uncertainty": "complex", "minimise": "ks_peak"}
    changed = replace(results.outcomes[0], inputs=long, sentence="a sentence " * 30)
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setenv("TERM", "dumb")
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    text = study_tables(replace(results, outcomes=(changed, *results.outcomes)))
    assert max(len(line) for line in text.splitlines()) <= columns
    assert "…" not in text
    assert "3.125-4.375" in text


def test_figures_without_a_meaning_are_dashes(results: StudyResults) -> None:
    """A case that gave no answer has its status, its sentence, and no numbers."""
    bare = replace(results.outcomes[0], status=Status.TIMEOUT, sentence="stopped", summary=Summary(), steps=())
    text = study_tables(replace(results, outcomes=(bare,)))
    assert "nan" not in text
    assert f"{bare.case_id[:7]} timeout: stopped" in text
    assert "Step responses" not in text


def test_a_touch_down_is_an_end_and_not_a_number(results: StudyResults) -> None:
    """The table says when the rotor met the stator."""
    outcome = results.outcomes[0]
    step = replace(outcome.steps[0], end="touched_down", settling_time_s=None, time_s=np.array([0.0, 4.2e-4]))
    text = study_tables(replace(results, outcomes=(replace(outcome, steps=(step,)),)))
    assert "touched down at 0.42 ms" in text


def test_many_steps_are_counted(results: StudyResults, monkeypatch: pytest.MonkeyPatch) -> None:
    """What does not fit into the table is counted, not dropped silently."""
    monkeypatch.setattr(tables, "MOST_STEPS", 1)
    assert "1 more step responses are in the report" in study_tables(results)

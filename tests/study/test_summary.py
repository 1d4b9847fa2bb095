"""The JSON documents have the promised keys, in plain and finite values."""

from __future__ import annotations

import dataclasses
import json
from pathlib import PurePosixPath

import numpy as np
import pytest

from magbear_cli.errors import Status
from magbear_cli.study.outcome import CaseOutcome, StepOutcome, StudyResults, Summary
from magbear_cli.study.summary import case_document, plain_number, study_document

CASE_KEYS = (
    "id status method mass_kg omega_c_rad_s peak_mu worst_case order "
    "peak_gain_a_per_m peak_ks_a_per_m verified sentence steps"
)
STEP_KEYS = "mass_kg step_m model controller settling_time_s overshoot peak_current_a touched_down"


@pytest.fixture
def outcome() -> CaseOutcome:
    """A case with one touched-down step and figures of numpy's types."""
    none = np.empty(0)
    told = ("nonlinear", "mu_convex", {"prefilter": None}, "touched_down", "it met the stator")
    step = StepOutcome(3.0, 1e-5, *told, None, float("nan"), None, np.float64(2.5), None, *([none] * 6))
    inputs = {"controller": {"method": "mu_convex"}, "mass_kg": [3.0, 4.5], "bandwidth": {"omega_c_rad_s": 2e4}}
    summary = Summary(level=np.float64(0.5), peak_mu=0.512, order=np.int64(7), gain_margin_high=float("inf"))  # type: ignore[arg-type]
    return CaseOutcome("ab" * 8, 0, inputs, Status.OK, summary=summary, steps=(step,))


def test_the_public_keys_come_first_and_in_order(outcome: CaseOutcome) -> None:
    """Every promised key is there, before any other."""
    document = case_document(outcome)
    assert list(document)[:13] == CASE_KEYS.split()
    assert list(document["steps"][0])[:8] == STEP_KEYS.split()
    assert document["steps"][0]["touched_down"] is True
    assert document["omega_c_rad_s"] == 2e4
    assert document["repro"] is None


def test_the_document_is_strict_json(outcome: CaseOutcome) -> None:
    """No NaN, no infinity and no array gets in; counts stay whole."""
    results = StudyResults("s", "", (outcome,), {}, {})
    document = study_document(results, PurePosixPath("out/results.h5"), PurePosixPath("out/report/index.html"))
    again = json.loads(json.dumps(document, allow_nan=False))
    assert list(again) == ["study", "results", "report", "cases"]
    case = again["cases"][0]
    assert (case["order"], case["peak_mu"], case["gain_margin_high"]) == (7, 0.512, None)
    assert isinstance(case["order"], int)
    assert case["steps"][0]["overshoot"] is None


def test_a_failed_case_says_how_to_repeat_it(outcome: CaseOutcome) -> None:
    """The line names the study of the run and the case."""
    failed = dataclasses.replace(outcome, status=Status.TIMEOUT, sentence="stopped")
    results = StudyResults("s", "", (failed,), {}, {})
    case = study_document(results, PurePosixPath("my out/results.h5"), None)["cases"][0]
    assert case["repro"] == f"magbear run 'my out/study.yaml' --case {failed.case_id} --debug"
    assert case["sentence"] == "stopped"


@pytest.mark.parametrize(
    ("value", "plain"),
    [(None, None), (float("nan"), None), (float("-inf"), None), (2, 2), (np.float64(0.5), 0.5), (np.int64(3), 3)],
)
def test_numbers_are_plain_or_null(value: object, plain: object) -> None:
    """Figures without a meaning are null."""
    assert plain_number(value) == plain
    assert type(plain_number(value)) is type(plain)

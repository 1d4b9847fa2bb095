"""The verdict on a loop: which status, in which words, and what is left unsaid."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from magbear_cli.analysis.verification import Verification
from magbear_cli.errors import Status
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.study.building import build_problem
from magbear_cli.study.judging import judge_loop, verdict, without_levels
from magbear_cli.study.outcome import Summary
from magbear_cli.study.proving import verify_controller
from magbear_cli.synthesis.design import Design

Resolve = Callable[..., dict[str, Any]]

LEAD = StateSpace.of([[-2e5]], [[1.0]], [[1.5e12]], [[-7.6e6]])
NAN = float("nan")


def _verification(*, verified: bool, worst: float) -> Verification:
    return Verification(verified=verified, sentence="so it was found", worst_level=worst)


@pytest.mark.parametrize(
    ("verified", "recomputed", "worst", "status", "says"),
    [
        (True, 0.9, 0.9, Status.OK, ""),
        (True, 1.0005, 1.0005, Status.OK, ""),
        (False, float("inf"), 0.3, Status.UNSTABLE, "the loop is not stable for every mass: so it was found"),
        (False, 1.2, 0.99, Status.UNVERIFIED, "the worst case seems to be 0.99, but so it was found"),
        (False, NAN, 0.99, Status.UNVERIFIED, "the worst case seems to be 0.99, but so it was found"),
        (False, 1.7, 1.7, Status.NOT_ACHIEVED, "the worst case over the mass range is 1.7, above 1"),
        (False, NAN, 1.7, Status.NOT_ACHIEVED, "the worst case over the mass range is 1.7, above 1"),
        (False, NAN, NAN, Status.FAILED, "the worst case cannot be computed: so it was found"),
        (False, NAN, None, Status.FAILED, "the worst case cannot be computed: so it was found"),
    ],
)
def test_each_verdict_has_its_status_and_sentence(
    *, verified: bool, recomputed: float, worst: float | None, status: Status, says: str
) -> None:
    """Only a verified loop is ok; a number that is none is never a level."""
    answer = verdict(
        Design(LEAD, Status.OK), Summary(worst_case=worst), _verification(verified=verified, worst=recomputed)
    )
    assert answer == (status, says)


def test_the_method_speaks_first(resolved: Resolve) -> None:
    """Where the level is not reached, what the method itself found stands before the figure."""
    problem = build_problem(resolved())
    summary, _, _ = judge_loop(problem, LEAD)
    design = Design(LEAD, Status.NOT_ACHIEVED, "the search ended at 4")
    status, sentence = verdict(design, summary, verify_controller(problem, LEAD, summary.worst_case))
    assert status is Status.NOT_ACHIEVED
    assert sentence.startswith("the search ended at 4; the worst case")


def test_a_summary_is_complete_for_a_stable_loop(resolved: Resolve) -> None:
    """Every figure of a stable loop is a number; margins contain the loop as it is."""
    summary, frequency, poles = judge_loop(build_problem(resolved()), LEAD)
    missing = {field.name for field in fields(summary) if getattr(summary, field.name) is None}
    limits = {"omega_c_feasible_rad_s", "omega_c_infeasible_rad_s"}
    assert missing == {"worst_case_proven", "lower_bound"} | limits  # proofs are another's business
    assert summary.gain_margin_low is not None
    assert summary.gain_margin_high is not None
    assert summary.gain_margin_low < 1.0 < summary.gain_margin_high
    assert summary.max_pole_real_rad_s == poles.poles_rad_s.real.max()
    assert summary.peak_sensitivity is not None
    assert summary.peak_sensitivity >= np.abs(frequency.sensitivity).max() * (1 - 1e-9)
    assert (summary.peak_ks_a_per_m or 0.0) <= (summary.peak_gain_a_per_m or 0.0) * summary.peak_sensitivity


def test_an_unstable_loop_has_no_margins_and_no_levels(resolved: Resolve) -> None:
    """Without stability a margin is no margin and the peak of a curve no level; what the controller is remains."""
    problem = build_problem(resolved())
    controller = StateSpace.gain([[1e6]])
    summary, _, _ = judge_loop(problem, controller)
    assert (summary.gain_margin_low, summary.phase_margin_deg, summary.disk_margin) == (None, None, None)
    bare = without_levels(summary)
    left = {field.name for field in fields(bare) if getattr(bare, field.name) is not None}
    assert left == {"level", "order", "peak_gain_a_per_m", "max_pole_real_rad_s", "verified", "verification_sentence"}
    assert bare.peak_gain_a_per_m == pytest.approx(1e6)


def test_a_fixed_mass_is_drawn_once(resolved: Resolve) -> None:
    """One mass gives one row of each curve, a range gives its ends and its nominal mass between them."""
    _, frequency, poles = judge_loop(build_problem(resolved("mass_kg=3.6")), LEAD)
    assert frequency.masses_kg.tolist() == [3.6]
    assert poles.masses_kg.tolist() == [3.6]
    _, frequency, _ = judge_loop(build_problem(resolved()), LEAD)
    assert frequency.masses_kg.tolist() == pytest.approx([3.0, 3.6, 4.5])

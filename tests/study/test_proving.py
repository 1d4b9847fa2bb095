"""The proofs of a case: given where they hold, withheld where they do not, and whole after they were stored."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from magbear_cli.analysis.gridless import prove_level
from magbear_cli.errors import Status
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.store.results import read_results, write_results
from magbear_cli.study.building import build_problem
from magbear_cli.study.outcome import CaseOutcome, StudyResults
from magbear_cli.study.pipeline import run_case
from magbear_cli.study.plan import case_id
from magbear_cli.study.proving import is_proof, prove_impossible, verify_controller

Resolve = Callable[..., dict[str, Any]]

LEAD = StateSpace.of([[-2e5]], [[1.0]], [[1.5e12]], [[-7.6e6]])
FRONTIER = 5091.0  # rad/s for 3.0-4.5 kg: within 1 % of where linear control ends


def _run(inputs: dict[str, Any]) -> CaseOutcome:
    return run_case(inputs, case_id(inputs), 0)


@pytest.fixture(scope="module")
def best(resolved: Resolve) -> CaseOutcome:
    """The best controller of any order where the specification is met with room."""
    return _run(resolved("controller={method: mu_convex}", simulate=[]))


@pytest.fixture(scope="module")
def frontier(resolved: Resolve) -> CaseOutcome:
    """A controller of 14 states right at the end of what linear control can do."""
    inputs = resolved(
        "controller={method: mu_convex, max_order: 14}", f"bandwidth.omega_c_rad_s={FRONTIER}", simulate=[]
    )
    return _run(inputs)


@pytest.fixture(scope="module")
def beyond(resolved: Resolve) -> CaseOutcome:
    """A case that no linear controller can meet."""
    return _run(resolved("controller={method: mu_convex}", "bandwidth.omega_c_rad_s=4900", simulate=[]))


def test_the_best_worst_case_is_proven_from_both_sides(best: CaseOutcome) -> None:
    """At 3.0-4.5 kg and 20 000 rad/s: 0.402 at most, proven, and nothing more than 1 % lower, proven."""
    summary = best.summary
    assert best.status is Status.OK
    assert summary.verified
    assert summary.lower_bound is not None
    assert summary.worst_case is not None
    assert summary.worst_case_proven is not None
    assert 0.99 * summary.worst_case < summary.lower_bound < summary.worst_case < summary.worst_case_proven
    assert summary.worst_case_proven < 1.001 * summary.worst_case
    assert summary.worst_case < 1.01 * 0.402
    assert (summary.order or 99) <= 12


def test_stored_proofs_convince_the_checkers(best: CaseOutcome, beyond: CaseOutcome, tmp_path: Path) -> None:
    """What is read back from a results file is a proof by its numbers alone."""
    path = tmp_path / "results.h5"
    write_results(path, StudyResults("proofs", "", (best, replace(beyond, index=1)), {}, {}))
    for outcome in read_results(path).outcomes:
        problem = build_problem(outcome.inputs)
        assert outcome.impossibility is not None
        assert is_proof(problem, outcome.impossibility)
        if outcome.status is Status.OK:
            assert outcome.controller is not None
            assert outcome.summary.worst_case_proven is not None
            assert prove_level(problem, outcome.controller, outcome.summary.worst_case_proven).proved


def test_what_cannot_be_met_is_infeasible_with_its_proof(beyond: CaseOutcome) -> None:
    """A proof is stored, its level is at least that of the specification, and the sentence says it is one."""
    assert beyond.status is Status.INFEASIBLE
    assert not beyond.summary.verified
    assert beyond.impossibility is not None
    assert beyond.summary.lower_bound == beyond.impossibility.level
    assert 1.0 <= beyond.impossibility.level < (beyond.summary.worst_case or 0.0)
    assert beyond.sentence.startswith("proven: every linear controller's worst case is above 1.0")


def test_a_proof_covers_every_method(resolved: Resolve) -> None:
    """What no linear controller meets, a design for one plant does not meet either: proven, not just not found."""
    outcome = _run(resolved("controller={method: lqg}", "bandwidth.omega_c_rad_s=4000", simulate=[]))
    assert outcome.status is Status.INFEASIBLE
    assert outcome.controller is not None


def test_what_others_could_meet_is_only_not_achieved(resolved: Resolve) -> None:
    """LQG misses what a better controller meets: there is no proof, and none is claimed."""
    outcome = _run(resolved("controller={method: lqg}", simulate=[]))
    assert outcome.status is Status.NOT_ACHIEVED
    assert outcome.impossibility is None
    assert outcome.summary.lower_bound is None


@pytest.mark.parametrize("factor", [0.99, 1.01])
def test_one_percent_of_gain_error_at_the_frontier_is_refused(frontier: CaseOutcome, factor: float) -> None:
    """The controller itself is verified; the same with 1 % more or less gain is not."""
    assert frontier.summary.verified, frontier.sentence
    assert frontier.controller is not None
    problem = build_problem(frontier.inputs)
    found = frontier.controller
    erring = replace(found, c=factor * found.c, d=factor * found.d)
    verification = verify_controller(problem, erring, None)
    assert not verification.verified
    assert verification.worst_level > 1.0


def test_one_perturbed_coefficient_is_no_proof(beyond: CaseOutcome) -> None:
    """Each number of a stored proof matters: 1 % on one of them, and the checker refuses."""
    proof, problem = beyond.impossibility, build_problem(beyond.inputs)
    assert proof is not None
    tight = prove_impossible(problem, proof.level)
    assert tight is not None
    for name in ("x_coefficients", "y_coefficients", "x_poles_rad_s", "y_poles_rad_s"):
        values = getattr(tight, name)
        for index in range(2, values.size, 7):
            spoilt = values.copy()
            spoilt[index] *= 1.01
            assert not is_proof(problem, replace(tight, **{name: spoilt})), (name, index)


def test_numbers_that_make_no_functions_are_no_proof(beyond: CaseOutcome) -> None:
    """NaN, a pole in the wrong place or a coefficient too few do not pass."""
    proof, problem = beyond.impossibility, build_problem(beyond.inputs)
    assert proof is not None
    assert not is_proof(problem, replace(proof, level=np.nan))
    assert not is_proof(problem, replace(proof, x_poles_rad_s=-proof.x_poles_rad_s))
    assert not is_proof(problem, replace(proof, y_coefficients=proof.y_coefficients[:-2]))


def test_sampling_is_never_enough(resolved: Resolve) -> None:
    """A worst case that samples put below 1 is not verified where the proof finds more between them."""
    problem = build_problem(resolved("performance.dc_gain=27.0"))
    assert not verify_controller(problem, LEAD, 0.5).verified


def test_verification_asks_for_level_one(resolved: Resolve) -> None:
    """The same loop is verified for a weight that it meets and refused for one that it does not."""
    lenient = build_problem(resolved("performance.dc_gain=1", "performance.corner_rad_s=20"))
    verification = verify_controller(lenient, LEAD, None)
    assert verification.verified
    assert verification.statistics["level"] == 1.0
    assert not verify_controller(build_problem(resolved()), LEAD, None).verified

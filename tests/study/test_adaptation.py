"""An adaptive case tells what its runs were and claims no more; its gain's limit lies between the two that are told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from magbear_cli.errors import Status
from magbear_cli.store.results import read_results, write_results
from magbear_cli.study.adaptation import build_design, unbounded
from magbear_cli.study.building import build_problem
from magbear_cli.study.outcome import CaseOutcome, StudyResults
from magbear_cli.study.pipeline import run_case
from magbear_cli.study.plan import case_id

Resolve = Callable[..., dict[str, Any]]

LAW = "controller={method: adaptive_lfe, gamma: 1e8}"
ELASTIC = "rotor: {sensor_mass_kg: 0.18, stiffness_n_per_m: 2.7e6, damping_n_s_per_m: 170}"
BASE = ("bearing=thesis_thrust_half_switched", "mass_kg=[2.2, 4.5]", "performance=thesis_slow")


def case(resolved: Resolve, controller: str, run: str) -> CaseOutcome:
    """The outcome of a small case."""
    inputs = resolved(*BASE, controller, f"simulate=[{{{run}}}]")
    return run_case(inputs, case_id(inputs), 0)


@pytest.fixture(scope="module")
def rigid(resolved: Resolve) -> CaseOutcome:
    """Two rigid rotors after a step of 100 µm."""
    return case(resolved, LAW, "step_m: 1e-4, masses_kg: [2.2, 4.5], duration_s: 0.04, samples: 201")


def test_runs_that_are_bounded_prove_nothing(rigid: CaseOutcome) -> None:
    """The case is unverified, says so, and has no figure of a linear loop."""
    assert rigid.status is Status.UNVERIFIED
    assert "nothing is proven" in rigid.sentence
    assert (rigid.controller, rigid.frequency, rigid.poles) == (None, None, None)
    assert rigid.summary.worst_case is None
    assert not rigid.summary.verified


def test_each_run_has_its_statistics(rigid: CaseOutcome) -> None:
    """The tracking error of every run is told, and the largest of them."""
    errors = [rigid.statistics[f"step_{number:02d}_tracking_error_m"] for number in (1, 2)]
    assert rigid.statistics["tracking_error_m"] == max(errors)
    assert all(0.0 < error < 1e-5 for error in errors)
    for step, error in zip(rigid.steps, errors, strict=True):
        late = step.time_s >= 0.5 * step.time_s[-1]
        assert np.abs(step.position_m - step.reference_m)[late].max() == pytest.approx(error, rel=0.05)
    assert rigid.statistics["gain_position_a_per_m"] == 1.71e4


def test_an_adaptive_case_is_stored_and_read_again(rigid: CaseOutcome, tmp_path: Path) -> None:
    """What was computed comes back from the results file."""
    path = tmp_path / "results.h5"
    write_results(path, StudyResults("adaptive", "", (rigid,), {}, {}))
    (again,) = read_results(path).outcomes
    assert again.status is rigid.status
    assert dict(again.statistics) == dict(rigid.statistics)
    assert np.isnan(again.steps[0].linear_position_m).all()


def test_a_run_onto_the_stator_is_unstable(resolved: Resolve) -> None:
    """An elastic rotor at the gain of Table 4.2 touches the stator, and the sentence says which."""
    outcome = case(resolved, "controller={method: adaptive_lfe}", f"step_m: 1e-5, masses_kg: [4.5], {ELASTIC}")
    assert outcome.status is Status.UNSTABLE
    assert "4.5 kg, 10 µm: after" in outcome.sentence
    assert outcome.statistics["tracking_error_m"] == np.inf
    assert outcome.statistics["step_01_bounded"] == 0.0


def test_growing_is_not_bounded(rigid: CaseOutcome, resolved: Resolve) -> None:
    """An error outside the sphere that grows from quarter to quarter is not bounded; one inside it is."""
    law = build_design(build_problem(rigid.inputs), rigid.inputs["controller"]).law
    calm = {
        f"{part}_quarter_{what}": 1e-7 for part in ("third", "fourth") for what in ("error_m", "speed_error_m_per_s")
    }
    assert not unbounded(law, (rigid.steps[0], calm))
    assert "grows" in unbounded(law, (rigid.steps[0], calm | {"fourth_quarter_error_m": 2e-6}))
    assert not unbounded(law, (rigid.steps[0], calm | {"fourth_quarter_error_m": 1.4e-6}))
    assert "grows" in unbounded(law, (rigid.steps[0], calm | {"fourth_quarter_speed_error_m_per_s": 1e-2}))
    assert "60 kg" in unbounded(law, (replace(rigid.steps[0], mass_kg=60.0, end="diverged"), calm))
    assert case_without_runs(resolved).sentence.endswith("nothing is known of it")


def case_without_runs(resolved: Resolve) -> CaseOutcome:
    """An adaptive law that is asked for no run."""
    inputs = resolved(*BASE, LAW, simulate=[])
    return run_case(inputs, case_id(inputs), 0)


def test_a_run_that_cannot_begin_fails_the_case(resolved: Resolve) -> None:
    """A weight that the limited current cannot hold is told."""
    run = "step_m: 1e-5, masses_kg: [4.5], gravity_m_per_s2: 9.8, gravity_compensation: true, current_limit_a: 0.5"
    outcome = case(resolved, LAW, run)
    assert outcome.status is Status.FAILED
    assert outcome.steps[0].end == "not_begun"


def test_the_largest_gain_is_bracketed(resolved: Resolve) -> None:
    """Below the bracket the runs are bounded, above it they are not, and the ends are as near as asked."""
    run = f"step_m: 1e-5, masses_kg: [4.5], duration_s: 0.04, samples: 101, {ELASTIC}"
    limit = case(resolved, "controller={method: adaptive_limit, low: 1e6, high: 1e9, tolerance: 0.3}", run)
    low, high = limit.statistics["gamma_stable"], limit.statistics["gamma_unstable"]
    assert limit.status is Status.OK
    assert low < high <= 1.3 * low
    gains, stable = limit.tables["gains"]["gamma"], limit.tables["gains"]["stable"]
    assert (np.diff(gains) > 0).all()
    assert stable[gains == low] == 1.0
    assert stable[gains == high] == 0.0
    for gamma, expected in ((low, Status.UNVERIFIED), (high, Status.UNSTABLE)):
        assert case(resolved, f"controller={{method: adaptive_lfe, gamma: {gamma!r}}}", run).status is expected


@pytest.mark.parametrize(("low", "high", "word"), [(1e9, 1e10, "smallest"), (1e4, 1e5, "largest")])
def test_a_limit_outside_of_the_search_is_told(resolved: Resolve, low: float, high: float, word: str) -> None:
    """Where every gain or none is stable, the side that is missing is named and is no number."""
    run = f"step_m: 1e-5, masses_kg: [4.5], duration_s: 0.03, samples: 101, {ELASTIC}"
    outcome = case(resolved, f"controller={{method: adaptive_limit, low: {low}, high: {high}}}", run)
    assert outcome.status is Status.NOT_ACHIEVED
    assert word in outcome.sentence
    assert np.isnan([outcome.statistics["gamma_stable"], outcome.statistics["gamma_unstable"]]).sum() == 1

"""Cases are found by their inputs, numbers are noted by their place, and what is no answer is not taken for one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from magbear_cli.claims.evidence import ANY, Case, Evidence, MissingEvidenceError, Run, crossing, is_like
from magbear_cli.errors import Status
from magbear_cli.model.table import Column, Table
from magbear_cli.study.outcome import CaseOutcome, StepOutcome, StudyResults, Summary

INPUTS = {
    "controller": {"method": "lqg", "r": 3e-9, "grid": [10.0, 1e4, 50.0]},
    "bearing": {"current_law": "full"},
    "simulate": [{"rotor": None}, {"rotor": {"damping": 100.0}}],
}


@pytest.mark.parametrize(
    ("where", "found"),
    [
        ({}, True),
        ({"controller.r": 3e-9}, True),
        ({"controller.r": 3.0000000001e-9}, True),
        ({"controller.r": 3.1e-9}, False),
        ({"controller.grid": [10, 10000, 50]}, True),
        ({"controller.grid": [10, 10000]}, False),
        ({"bearing.current_law": "full", "controller.method": "lqr"}, False),
        ({"simulate.0.rotor": None, "simulate.1.rotor.damping": 100}, True),
        ({"simulate.1.rotor": ANY}, True),
        ({"simulate.0.rotor": ANY}, False),
        ({"simulate.7.rotor": ANY}, False),
        ({"bearing": {"current_law": "full"}}, True),
        ({"nothing.there": None}, True),
    ],
)
def test_a_selection_finds_what_it_names(where: dict[str, object], found: bool) -> None:  # noqa: FBT001
    """Dotted keys, numbers to rounding, lists by their entries, and a word for whatever is there."""
    assert is_like(INPUTS, where) is found


def make_run(position: Callable[[np.ndarray], np.ndarray], end: str = "finished") -> StepOutcome:
    """A run over a tenth of a second."""
    time = np.linspace(0.0, 0.1, 1001)
    nothing = np.zeros_like(time)
    moved = position(time)
    return StepOutcome(
        3.0, 1e-5, "linear", "lqg", {"sensor": None}, end, "", None, None, None, 2.0, 0.0, time, moved, nothing,
        np.full_like(time, 1e-5), nothing, nothing,
    )  # fmt: skip


def outcome(steps: tuple[StepOutcome, ...] = (), status: Status = Status.OK) -> CaseOutcome:
    """A case with a level, a statistic and a table."""
    table = Table((Column("order", np.array([1.0, 2.0]), "1", "states"),), "orders")
    summary = Summary(level=0.5, order=None)
    return CaseOutcome(
        "ab", 2, INPUTS, status, "", summary, steps=steps, statistics={"gain": 2.0}, tables={"reduction": table}
    )


def evidence(of: CaseOutcome) -> Evidence:
    """Evidence with one study of one case."""
    study = StudyResults("study", "", (of,), {}, {})
    return Evidence({"s": study}, {"it": {"study": "s", "controller.method": "lqg"}, "other": {"study": "t"}})


def test_what_is_read_is_noted_by_its_place() -> None:
    """Every number leaves the path of its dataset, once."""
    seen = evidence(outcome((make_run(lambda time: 1e-5 - 1e-5 * np.exp(-300.0 * time)),)))
    case = seen.one("it")
    assert (case.figure("level"), case.statistic("gain")) == (0.5, 2.0)
    assert case.table("reduction", "order").tolist() == [1.0, 2.0]
    assert case.step(sensor=None).figure("peak_current_a") == 2.0
    case.figure("level")
    assert list(seen.read) == [
        "s/results.h5:/case_0003/summary/level",
        "s/results.h5:/case_0003/statistics/value[gain]",
        "s/results.h5:/case_0003/tables/reduction/order",
        "s/results.h5:/case_0003/steps/step_01/peak_current_a",
    ]


def test_what_is_missing_is_said_and_never_guessed() -> None:
    """A case, a run or a number that is not there ends the judgement with a sentence."""
    seen = evidence(outcome())
    case: Case = seen.one("it")
    asked: list[Callable[[], object]] = [
        lambda: seen.one("other"),
        lambda: case.figure("order"),
        lambda: case.statistic("loss"),
        lambda: case.table("reduction", "mu"),
        lambda: case.curve("mu_upper"),
        case.poles_rad_s,
        lambda: case.step(sensor=None),
        lambda: evidence(outcome(status=Status.TIMEOUT)).one("it").status,
    ]
    for ask in asked:
        with pytest.raises(MissingEvidenceError):
            ask()


def test_a_level_of_an_unstable_loop_is_infinite() -> None:
    """An unstable loop has no level, which is worse than any."""
    unstable = replace(outcome(status=Status.UNSTABLE), summary=Summary(peak_mu=None))
    assert evidence(unstable).one("it").figure("peak_mu") == np.inf


@pytest.mark.parametrize(
    ("growth_per_s", "end", "stable"),
    [(-100.0, "finished", True), (20.0, "finished", False), (-100.0, "touched_down", False)],
)
def test_a_swing_that_widens_is_no_stability(growth_per_s: float, end: str, stable: bool) -> None:  # noqa: FBT001
    """The last fifth of a run must not swing wider than the one before, and the run must have ended well."""
    step = make_run(lambda time: 1e-5 * np.exp(growth_per_s * time) * np.sin(3000.0 * time), end)
    run: Run = evidence(outcome((step,))).one("it").step()
    assert run.is_stable is stable


def test_settling_is_the_last_entry_into_the_band() -> None:
    """A response that leaves the band again has not settled before it comes back."""
    step = make_run(lambda time: 1e-5 * np.where(time < 0.02, 0.5, np.where((time > 0.05) & (time < 0.06), 1.3, 1.0)))
    run = evidence(outcome((step,))).one("it").step()
    assert run.settled_s(0.1) == pytest.approx(0.06, abs=2e-4)
    assert run.largest_error_m(0.7) == pytest.approx(0.0, abs=1e-12)
    assert run.largest_error_m() == pytest.approx(5e-6)


def test_a_crossing_is_interpolated() -> None:
    """Between a level above and one below, on a logarithmic scale; NaN when there is none."""
    places = np.array([100.0, 10.0, 1.0])
    assert crossing(np.array([0.5, 1.5, 2.5]), places) == pytest.approx(10.0**1.5)
    assert np.isnan(crossing(np.array([0.5, 0.6, 0.7]), places))

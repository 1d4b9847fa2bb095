"""Limitation curves against a baseline: what counts as moved."""

from __future__ import annotations

from typing import Any

import pytest

from magbear_cli.errors import InputError
from magbear_cli.study.limit_curves import compare_curves, curve_line, curve_name


def curve(low: float | None = 5000.0, high: float | None = 5050.0, **other: object) -> dict[str, Any]:
    """One curve as the command prints it."""
    known: dict[str, Any] = {
        "mass_kg": [3.0, 4.5], "omega_c_feasible": high, "omega_c_infeasible": low, "controller_order": 14,
        "verified": True, "over": {}, "sentence": "", "status": "ok",
    }  # fmt: skip
    return known | other


def test_what_stays_within_the_tolerance_has_not_moved() -> None:
    """One per cent up or down is nothing at a tolerance of one per cent."""
    assert compare_curves([curve(4960.0, 5090.0)], {"curves": [curve()]}, 0.01).moved == []


@pytest.mark.parametrize(
    ("now", "says"),
    [
        (curve(4900.0), "omega_c_infeasible moved from 5000.0 rad/s to 4900.0 rad/s, by -2.00 %"),
        (curve(high=5200.0), "omega_c_feasible moved from 5050.0"),
        (curve(low=None), "omega_c_infeasible was 5000.0 rad/s and is none"),
        (curve(verified=False), "no longer verified"),
        (curve(mass_kg=3.0), "3 kg: not in the baseline"),
        (curve(over={"performance.corner_rad_s": 100.0}), "performance.corner_rad_s = 100: not in the baseline"),
    ],
)
def test_what_moved_is_told(now: dict[str, Any], says: str) -> None:
    """A side, a proof or a curve that is not where it was has its sentence."""
    told = compare_curves([now], {"curves": [curve()]}, 0.01).moved
    assert any(says in text for text in told), told


def test_a_curve_that_is_gone_is_told() -> None:
    """What only the baseline has counts as a difference."""
    assert compare_curves([], {"curves": [curve()]}, 0.01).moved == ["3-4.5 kg: in the baseline only"]


@pytest.mark.parametrize(
    "document",
    [
        None,
        [],
        {},
        {"curves": 3},
        {"curves": [3]},
        {"curves": [curve(mass_kg="3")]},
        {"curves": [curve() | {"omega_c_infeasible": "x"}]},
        {"curves": [curve(over=[1])]},
        {"curves": [curve(high=-1.0)]},
    ],
)
def test_what_is_no_baseline_is_refused(document: object) -> None:
    """A document of another shape is a mistake of the user, not a difference."""
    with pytest.raises(InputError, match="curves"):
        compare_curves([], document, 0.01)


def test_a_bracket_is_one_sentence() -> None:
    """Both sides, the order, and what stopped the search."""
    assert curve_line(curve()) == (
        "3-4.5 kg: proven impossible up to 5000.0 rad/s, met from 5050.0 rad/s by a controller of order 14"
    )
    assert (
        curve_line(curve(None, None, sentence="too hard")) == "3-4.5 kg: no proof of impossibility, not met (too hard)"
    )
    assert curve_name(curve(over={"a.b": 0.5})) == "3-4.5 kg, a.b = 0.5"


def test_a_part_of_the_baseline_may_be_asked_for() -> None:
    """Curves that were not asked for are not missed, and the page says of each row what became of it."""
    baseline = {"curves": [curve(), {**curve(), "mass_kg": 3.0}]}
    found = compare_curves([curve(4960.0, 5300.0)], baseline, 0.01, is_part=True)
    assert len(found.moved) == 1
    page = found.markdown("base.json")
    assert "**1 of 1 moved**" in page
    assert "| 3-4.5 kg |" in page
    assert "3 kg" in compare_curves([curve(4960.0, 5090.0)], baseline, 0.01).markdown("base.json")
    assert "all 1 where they were" in compare_curves([curve()], baseline, 0.01, is_part=True).markdown("base.json")


def test_a_problem_without_any_limit_is_infeasible() -> None:
    """Where no bandwidth limit helps, the line says so and why, and no side is missed."""
    line = curve_line(curve(None, None, status="infeasible", sentence="proven: |W1| is above 1"))
    assert line == "3-4.5 kg: infeasible at every bandwidth limit (proven: |W1| is above 1)"

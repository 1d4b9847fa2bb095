"""A report of many cases shows some of them, says so, and keeps all of them in a file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from magbear_cli.report.selection import MOST_CASES, MOST_DRAWN, omissions
from magbear_cli.report.writing import write_report

MakeCase = Callable[..., Any]
MakeStudy = Callable[..., Any]


def test_of_many_cases_some_are_shown_and_all_are_kept(
    make_case: MakeCase, make_study: MakeStudy, tmp_path: Path
) -> None:
    """The page counts every case, lists the first, draws a few, and says where the rest is."""
    total = MOST_CASES + 3
    first = [make_case(index, mass_kg=(3.0, 4.0 + 0.01 * index), steps=False) for index in range(MOST_DRAWN + 1)]
    rest = [make_case(index, mass_kg=(3.0, 4.0 + 0.01 * index), curves=False) for index in range(len(first), total)]
    page = write_report(make_study(*first, *rest, figures=("mu",)), tmp_path).read_text("utf-8")
    assert page.count("data-case=") == MOST_CASES
    assert f"All {total} cases" in page
    assert all(sentence in page for sentence in omissions(total, has_case_figures=True))
    assert len(list((tmp_path / "figures").glob("mu-*.svg"))) == MOST_DRAWN
    lines = (tmp_path / "tables" / "cases.csv").read_text("utf-8").splitlines()
    assert len(lines) == total + 1
    assert lines[0].startswith("case_id,status,method,mass_low_kg")


def test_a_small_study_leaves_nothing_out() -> None:
    """Nothing is said about what is not left out."""
    assert omissions(MOST_DRAWN, has_case_figures=True) == []
    assert omissions(MOST_CASES, has_case_figures=False) == []
    assert len(omissions(MOST_CASES + 1, has_case_figures=True)) == 2

"""Which of many cases a report shows: a page of ten thousand rows, or as many figures, helps nobody and takes hours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from magbear_cli.report.series import Labels
from magbear_cli.report.sweep import Sweep, find_sweep
from magbear_cli.study.outcome import CaseOutcome, StudyResults

Planned = TypeVar("Planned")  # a case, or what came of it

ALWAYS = ("mu", "sensitivity", "nyquist", "poles", "controller_gain", "step")  # of a study that asks for none by name
OF_ONE_CASE = ("mu", "sensitivity", "nyquist", "poles", "step")  # the others are about several
MOST_CASES = 200  # rows of the tables, and cases told one by one
MOST_DRAWN = 12  # cases with figures of their own
MOST_SWEPT = 2000  # cases that limitation curves are made of
MOST_CURVES = 24  # in one figure, where there are more than MOST_CASES cases


def wanted_figures(report: Mapping[str, Any]) -> list[str]:
    """The kinds of figure that a study's ``report`` section asks for, in its order."""
    asked = report.get("figures") or ALWAYS
    return [str(kind) for kind in asked]


def shown(results: StudyResults) -> StudyResults:
    """The study with the cases that the page tells one by one: the first of them, in the order of the study."""
    return replace(results, outcomes=results.outcomes[:MOST_CASES])


def drawn(outcomes: Sequence[Planned]) -> Sequence[Planned]:
    """The cases that get figures of their own."""
    return outcomes[:MOST_DRAWN]


def shown_sweep(outcomes: tuple[CaseOutcome, ...], labels: Labels) -> Sweep | None:
    """The curves along the swept quantity: all of them, or of many cases the first."""
    sweep = find_sweep(outcomes[:MOST_SWEPT], labels)
    if sweep is None or len(outcomes) <= MOST_CASES:
        return sweep
    return replace(sweep, curves=sweep.curves[:MOST_CURVES])


def omissions(total: int, *, has_case_figures: bool) -> list[str]:
    """What the page leaves out of so many cases, in sentences; empty where it shows all."""
    told = []
    if total > MOST_CASES:
        told.append(
            f"The tables and the figures are about the first {MOST_CASES} of {total} cases (limitation curves: the "
            f"first {min(total, MOST_SWEPT)}); tables/cases.csv has all of them, and so has results.h5."
        )
    if total > MOST_DRAWN and has_case_figures:
        told.append(
            f"The first {MOST_DRAWN} cases have figures of their own; "
            "magbear report results.h5 --case ID draws those of another one."
        )
    return told

"""All drawings of a study, one after the other, so that no more than one is in memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from magbear_cli.report.control_sensitivity_figure import control_sensitivity_drawing
from magbear_cli.report.controller_gain_figure import controller_gain_drawings
from magbear_cli.report.drawing import Drawing
from magbear_cli.report.least_current_figure import least_current_drawing
from magbear_cli.report.limitation_figure import limitation_drawing
from magbear_cli.report.limits_figure import limits_drawing
from magbear_cli.report.mu_figure import mu_drawing
from magbear_cli.report.nyquist_figure import nyquist_drawing
from magbear_cli.report.orders_figure import orders_drawing
from magbear_cli.report.poles_figure import poles_drawing
from magbear_cli.report.selection import drawn, shown, shown_sweep, wanted_figures
from magbear_cli.report.sensitivity_figure import sensitivity_drawing
from magbear_cli.report.series import Labels
from magbear_cli.report.step_figure import step_drawings
from magbear_cli.report.trade_off_figure import trade_off_drawings
from magbear_cli.study.outcome import CaseOutcome, StudyResults

CaseDrawings = Callable[[CaseOutcome, tuple[CaseOutcome, ...], Labels], list[Drawing]]


def _one(draw: Callable[[CaseOutcome, tuple[CaseOutcome, ...], Labels], Drawing | None]) -> CaseDrawings:
    def drawings(outcome: CaseOutcome, outcomes: tuple[CaseOutcome, ...], labels: Labels) -> list[Drawing]:
        drawing = draw(outcome, outcomes, labels)
        return [] if drawing is None else [drawing]

    return drawings


def _each(*draws: Callable[[CaseOutcome, tuple[CaseOutcome, ...], Labels], Drawing | None]) -> CaseDrawings:
    def drawings(outcome: CaseOutcome, outcomes: tuple[CaseOutcome, ...], labels: Labels) -> list[Drawing]:
        return [drawing for draw in draws for drawing in _one(draw)(outcome, outcomes, labels)]

    return drawings


PER_CASE: dict[str, CaseDrawings] = {
    "mu": _one(mu_drawing),
    "sensitivity": _each(sensitivity_drawing, control_sensitivity_drawing),
    "nyquist": _one(nyquist_drawing),
    "poles": _one(poles_drawing),
    "step": step_drawings,
}


def study_drawings(results: StudyResults, labels: Labels) -> Iterator[Drawing]:
    """The figures about several cases: limitation curves, the trade-off of order, controller gains."""
    wanted, outcomes = wanted_figures(results.report), shown(results).outcomes
    limits = limits_drawing(outcomes)  # of whoever sought one
    if limits is not None:
        yield limits
    current = least_current_drawing(outcomes)
    if current is not None:
        yield current
    sweep = shown_sweep(results.outcomes, labels) if "limitation" in wanted else None
    if sweep is not None:
        yield limitation_drawing(sweep)
    orders = orders_drawing(outcomes, labels)
    if orders is None:
        yield from trade_off_drawings(outcomes, labels)
    else:
        yield orders
    if "controller_gain" in wanted:
        yield from controller_gain_drawings(outcomes, labels)


def case_drawings(results: StudyResults, labels: Labels) -> Iterator[Drawing]:
    """The figures about one case each, case by case in the order of the study, of the first cases."""
    wanted, outcomes = wanted_figures(results.report), shown(results).outcomes
    for outcome in drawn(outcomes):
        for kind in wanted:
            if kind in PER_CASE:
                yield from PER_CASE[kind](outcome, outcomes, labels)

"""What robustness costs in current: the least peak of |K S| that meets the specification, along a sweep."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from magbear_cli.errors import Status
from magbear_cli.report.canvas import COLOURS, DASHES, MARKERS, legend_below, new_figure, panel_title, panels, plain
from magbear_cli.report.drawing import Drawing, stacked
from magbear_cli.report.limit_curves import LimitCurves, limit_curves
from magbear_cli.report.numbers import mass_text, significant
from magbear_cli.report.series import Labels, mass_ends_kg
from magbear_cli.study.outcome import CaseOutcome

BOUND = "current_lower_bound"  # statistic of the designs that have one, A/m
STEP_M = 1e-5  # the current is told for a step of 10 µm


def least_current_drawing(outcomes: tuple[CaseOutcome, ...]) -> Drawing | None:
    """The least peaks of a study that minimises them along some quantity; None for any other."""
    cases = [
        outcome
        for outcome in outcomes
        if outcome.inputs["controller"].get("minimise") == "ks_peak"
        and outcome.status is Status.OK
        and outcome.summary.peak_ks_a_per_m is not None
    ]
    if len({mass_ends_kg(case) for case in cases}) < 2 or len({case.omega_c_rad_s for case in cases}) > 1:
        return None
    curves = limit_curves(cases, Labels(cases).controller)
    figure = new_figure(3.2)
    axes = panels(figure, 1, below=0.3)[0][0]
    _draw(axes, curves)
    axes.set_xlabel(plain(curves.axis, 80).replace("m_Δ", r"$m_\Delta$"))
    axes.set_ylabel("least peak of |K S| (A per 10 µm)")
    panel_title(axes, "What robustness costs in current")
    legend_below(figure, *axes.get_legend_handles_labels())
    limit = "no bandwidth limit" if cases[0].omega_c_rad_s is None else f"ω_c = {cases[0].omega_c_rad_s:g} rad/s"
    return Drawing(
        name="least_current",
        title="Least current",
        caption="The smallest peak over frequency of the gain from command to current with which the specification is "
        f"met, {limit}, for a command of 10 µm. Every controller is proven to meet it; crosses are bounds by duality, "
        "not proofs, below which no linear controller comes.",
        alt=f"Least peak of K S by {curves.axis}: {_spoken(curves)}.",
        figure=figure,
        columns=stacked(
            [
                {
                    "curve": [curve.label] * len(curve.cases),
                    "case_id": [case.case_id for case in curve.cases],
                    "mass_low_kg": [mass_ends_kg(case)[0] for case in curve.cases],
                    "mass_high_kg": [mass_ends_kg(case)[1] for case in curve.cases],
                    "peak_ks_a_per_m": [case.summary.peak_ks_a_per_m for case in curve.cases],
                    "bound_a_per_m": [case.statistics.get(BOUND) for case in curve.cases],
                    "order": [case.summary.order for case in curve.cases],
                }
                for curve in curves.curves
            ]
        ),
    )


_ROOM_FOR_FIGURES = 0.06  # of the width, right of the last points


def _draw(axes: Axes, curves: LimitCurves) -> None:
    top = 0.0
    for index, curve in enumerate(curves.curves):
        last = index == len(curves.curves) - 1
        peaks = np.array([STEP_M * (case.summary.peak_ks_a_per_m or np.nan) for case in curve.cases])
        axes.plot(
            curve.values, peaks, color=COLOURS[index % len(COLOURS)], linestyle=DASHES[index % len(DASHES)],
            marker=MARKERS[index % len(MARKERS)], markersize=4.5, label=plain(curve.label, 60),
        )  # fmt: skip
        axes.annotate(
            f"{significant(float(peaks[-1]))} A", (curve.values[-1], peaks[-1]), xytext=(6, 0), ha="left", va="center",
            textcoords="offset points", fontsize=7.5, color=COLOURS[index % len(COLOURS)],
        )  # fmt: skip
        bounds = np.array([STEP_M * case.statistics.get(BOUND, np.nan) for case in curve.cases])
        told = "no linear controller below (bound)" if last and np.isfinite(bounds).any() else None
        axes.plot(
            curve.values, bounds, color=COLOURS[index % len(COLOURS)], linestyle="none", marker="x", markersize=5,
            markeredgewidth=1.2, label=told,
        )  # fmt: skip
        top = max(top, float(peaks.max()))
    axes.set_ylim(0.0, 1.08 * top)
    low, high = axes.get_xlim()
    axes.set_xlim(low, high + _ROOM_FOR_FIGURES * (high - low))


def _spoken(curves: LimitCurves) -> str:
    return "; ".join(
        f"{curve.label}, {mass_text(case.mass_kg)}: {significant(STEP_M * (case.summary.peak_ks_a_per_m or np.nan))} A"
        for curve in curves.curves
        for case in curve.cases
    )

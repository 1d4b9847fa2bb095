"""Where linear control ends: both proven sides of the bandwidth limit, with the thesis's points beside them."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from magbear_cli.report.canvas import (
    COLOURS,
    INK,
    MARKERS,
    PAPER,
    SOFT,
    hertz_of,
    new_figure,
    panel_title,
    panels,
    plain,
    rad_s_of,
)
from magbear_cli.report.drawing import Drawing, stacked
from magbear_cli.report.limit_curves import (
    MASS,
    LimitCurve,
    LimitCurves,
    ThesisPoint,
    brackets,
    limit_curves,
    thesis_points,
)
from magbear_cli.report.numbers import mass_text, shortest, significant
from magbear_cli.report.series import mass_ends_kg
from magbear_cli.study.outcome import CaseOutcome

Floats = NDArray[np.float64]

_MET, _IMPOSSIBLE = "#e3eef7", "#ececec"
_PER_ROW_IN, _LEGEND_WIDTH = 0.165, 104
_ABOUT_THESIS = "Diamonds are the thesis's own designs: filled where they met it, open where they did not. "
_RANGE = 1.35  # how far the axes of the whole picture reach beyond what is in it


def limits_drawing(outcomes: tuple[CaseOutcome, ...]) -> Drawing | None:
    """The brackets of a study; None when it has none."""
    cases = brackets(outcomes)
    if not cases:
        return None
    curves = limit_curves(cases)
    points = thesis_points(cases[0]) if curves.quantity == MASS else []
    lines = len(curves.curves) if len(curves.curves) > 1 else 0
    below = 0.3 + _PER_ROW_IN * lines
    figure = new_figure(3.3 + below)
    whole, close = panels(figure, 2, below=below, wspace=0.26, right=0.62)[0]
    _draw_whole(whole, curves, points)
    _draw_close(close, curves)
    for axes in (whole, close):
        axes.set_xlabel(plain(curves.axis, 60).replace("m_Δ", r"$m_\Delta$"))
    whole.set_ylabel(r"bandwidth limit $\omega_c$ (rad/s)")
    panel_title(whole, "What is proven" + (", and the thesis" if points else ""))
    panel_title(close, "Both sides of the limit")
    _legends(figure, curves, points)
    return Drawing(
        name="limits",
        title="Where linear control ends",
        caption="The smallest bandwidth limit ω_c that any linear controller can meet. Below the crosses a checked "
        "certificate proves that none does, for every linear time-invariant controller of any order; from the "
        "triangles up a stored controller is proven to meet the specification for every mass and every frequency. "
        f"Between the points the lines only guide the eye. {_ABOUT_THESIS if points else ''}"
        "The panel on the right shows the same brackets close up.",
        alt=f"Brackets of the bandwidth limit: {_spoken(curves)}.",
        figure=figure,
        columns=_columns(curves),
    )


def _sides(curve: LimitCurve) -> tuple[Floats, Floats, Floats]:
    """The quantity, the impossible side and the met side; NaN where a side is missing."""
    summaries = [case.summary for case in curve.cases]
    low = [np.nan if s.omega_c_infeasible_rad_s is None else s.omega_c_infeasible_rad_s for s in summaries]
    high = [np.nan if s.omega_c_feasible_rad_s is None else s.omega_c_feasible_rad_s for s in summaries]
    return np.array(curve.values), np.array(low), np.array(high)


def _all(curves: LimitCurves) -> Floats:
    found = np.concatenate([np.concatenate(_sides(curve)[1:]) for curve in curves.curves])
    return np.asarray(found[np.isfinite(found)])


def _set_x(axes: Axes, curves: LimitCurves) -> tuple[float, float]:
    values = sorted({value for curve in curves.curves for value in curve.values})
    span = values[-1] - values[0]
    positive = values[0] > 0 and curves.quantity != MASS and values[-1] > 8 * values[0]
    if positive:
        axes.set_xscale("log")
        view = values[0] / 1.15, values[-1] * 1.15
        axes.xaxis.set_major_locator(FixedLocator(values))
        axes.xaxis.set_minor_locator(FixedLocator([]))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: shortest(float(f"{value:.3g}"))))
    else:
        margin = 0.06 * span or 0.06 * abs(values[0]) or 0.5
        view = values[0] - margin, values[-1] + margin
        axes.xaxis.set_major_locator(MaxNLocator(6))
    axes.set_xlim(*view)
    return view


def _draw_whole(axes: Axes, curves: LimitCurves, points: list[ThesisPoint]) -> None:
    """Every curve on a logarithmic axis, with the regions that one curve parts and the thesis's points."""
    view = _set_x(axes, curves)
    places = [(_place(point, curves), point) for point in points]
    placed = [(place, point) for place, point in places if place is not None]
    levels = np.concatenate([_all(curves), [point.omega_c_rad_s for _, point in placed]])
    axes.set_yscale("log")
    bottom, top = levels.min() / _RANGE, levels.max() * _RANGE
    axes.set_ylim(bottom, top)
    axes.yaxis.set_major_locator(LogLocator(10.0, subs=(1.0, 2.0, 3.0, 5.0, 7.0), numticks=12))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: shortest(value)))
    axes.yaxis.set_minor_formatter(NullFormatter())
    if len(curves.curves) == 1:
        x, low, high = _sides(curves.curves[0])
        wide = np.concatenate([[view[0]], x, [view[1]]])
        axes.fill_between(wide, np.pad(high, 1, mode="edge"), top, color=_MET, linewidth=0, zorder=0.4)
        axes.fill_between(
            wide, bottom, np.pad(low, 1, mode="edge"), facecolor=_IMPOSSIBLE, edgecolor="#c6cbd1", hatch="////",
            linewidth=0, zorder=0.4,
        )  # fmt: skip
        _name_region(axes, 0.06, "no linear controller: proven")
        _name_region(axes, 0.93, "met by a stored controller: proven")
        _tell_one_mass(axes, curves.curves[0])
    for index, curve in enumerate(curves.curves):
        x, low, high = _sides(curve)
        colour = COLOURS[index % len(COLOURS)]
        axes.fill_between(x, low, high, color=colour, alpha=0.6, linewidth=0, zorder=2)
        axes.plot(x, high, color=colour, linewidth=1.1, marker=MARKERS[index % len(MARKERS)], markersize=3, zorder=3)
        axes.plot(x, low, color=colour, linewidth=0.8, linestyle=(0, (3, 1.5)), zorder=3)
    for value, point in placed:
        axes.plot(
            value, point.omega_c_rad_s, "D", markersize=6, color=INK, zorder=5, markeredgewidth=1.2,
            markerfacecolor=INK if point.met else "white",
        )  # fmt: skip


def _name_region(axes: Axes, height: float, text: str) -> None:
    style: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 7.5, "color": INK, "bbox": PAPER}
    axes.text(0.6, height, text, transform=axes.transAxes, **style)


def _tell_one_mass(axes: Axes, curve: LimitCurve) -> None:
    """The limit of one known mass, across the panel: no range that holds it can do better."""
    known = [case for case in curve.cases if not isinstance(case.mass_kg, list)]
    if len(known) != 1 or len(curve.cases) == 1 or known[0].summary.omega_c_infeasible_rad_s is None:
        return
    axes.axhline(known[0].summary.omega_c_infeasible_rad_s, color=INK, linewidth=0.8, linestyle=(0, (1, 1.5)), zorder=2)
    axes.annotate(
        f"one known mass, {mass_text(known[0].mass_kg)}",
        (0.985, known[0].summary.omega_c_infeasible_rad_s), xycoords=axes.get_yaxis_transform(),
        xytext=(0, 2), textcoords="offset points", ha="right", va="bottom", fontsize=6.5, color=INK, bbox=PAPER,
    )  # fmt: skip


def _place(point: ThesisPoint, curves: LimitCurves) -> float | None:
    """Where a point of the thesis stands on the axis, where its masses are among those of the curves."""
    for curve in curves.curves:
        for value, case in zip(curve.values, curve.cases, strict=True):
            if case.mass_kg == list(point.mass_kg):
                return value
    return None


def _draw_close(axes: Axes, curves: LimitCurves) -> None:
    """Both sides of each bracket on a linear axis, with Hz at the right."""
    _set_x(axes, curves)
    levels = _all(curves)
    margin = 0.1 * (levels.max() - levels.min()) or 0.02 * levels.max()
    axes.set_ylim(levels.min() - margin, levels.max() + margin)
    for index, curve in enumerate(curves.curves):
        x, low, high = _sides(curve)
        colour = COLOURS[index % len(COLOURS)]
        axes.vlines(x, low, high, color=colour, linewidth=1.0, zorder=2)
        axes.plot(x, high, "^", color=colour, markersize=5.5, zorder=4)
        axes.plot(x, low, "x", color=colour, markersize=5, markeredgewidth=1.4, zorder=4)
        axes.plot(x, high, color=colour, linewidth=0.7, alpha=0.6, zorder=2)
        axes.plot(x, low, color=colour, linewidth=0.7, alpha=0.6, linestyle=(0, (3, 1.5)), zorder=2)
    if len(curves.curves) == 1 and curves.quantity == MASS and len(curves.curves[0].cases) <= 9:
        x, low, high = _sides(curves.curves[0])
        for place, (value, case) in enumerate(zip(x, curves.curves[0].cases, strict=True)):
            last = place == len(x) - 1 and len(x) > 1  # it leans inwards, above the curve
            axes.annotate(
                mass_text(case.mass_kg), (value, (high if last else low)[place]), xytext=(-8, 0) if last else (6, -6),
                textcoords="offset points", ha="right" if last else "left", va="center" if last else "top",
                fontsize=6.5, color=SOFT,
            )  # fmt: skip
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: shortest(value)))
    hertz = axes.secondary_yaxis("right", functions=(hertz_of, rad_s_of))
    hertz.set_ylabel("(Hz)", color=SOFT)
    hertz.tick_params(labelcolor=SOFT)


def _legends(figure: Figure, curves: LimitCurves, points: list[ThesisPoint]) -> None:
    width, height = (float(size) for size in figure.get_size_inches())
    handles = [
        Line2D([], [], color=INK, marker="^", linestyle="-", linewidth=0.8, markersize=5.5),
        Line2D([], [], color=INK, marker="x", linestyle=(0, (3, 1.5)), linewidth=0.8, markersize=5),
    ]
    names = ["met: proven controller", "impossible: checked certificate"]
    if points:
        handles += [
            Line2D([], [], color=INK, marker="D", linestyle="none", markersize=5),
            Line2D([], [], color=INK, marker="D", linestyle="none", markersize=5, markerfacecolor="white"),
        ]
        names += ["thesis: met", "thesis: failed"]
    figure.legend(
        handles, names, loc="lower left", ncols=len(names), bbox_to_anchor=(0.58 / width, 0.03 / height),
        columnspacing=1.5, handlelength=1.8,
    )  # fmt: skip
    if len(curves.curves) > 1:
        patches = [Patch(color=COLOURS[index % len(COLOURS)]) for index in range(len(curves.curves))]
        labels = [plain(curve.label, _LEGEND_WIDTH) for curve in curves.curves]
        figure.legend(patches, labels, loc="lower left", ncols=1, bbox_to_anchor=(0.58 / width, 0.26 / height))


def _spoken(curves: LimitCurves) -> str:
    told = []
    for curve in curves.curves:
        for case, low, high in zip(curve.cases, *_sides(curve)[1:], strict=True):
            name = ", ".join(part for part in (mass_text(case.mass_kg), curve.label) if part)
            told.append(f"{name}: impossible up to {significant(low, 4)}, met from {significant(high, 4)} rad/s")
    return "; ".join(told)


def _columns(curves: LimitCurves) -> dict[str, list[object]]:
    return stacked(
        [
            {
                "curve": [curve.label] * len(curve.cases),
                "case_id": [case.case_id for case in curve.cases],
                "mass_low_kg": [mass_ends_kg(case)[0] for case in curve.cases],
                "mass_high_kg": [mass_ends_kg(case)[1] for case in curve.cases],
                curves.quantity if curves.quantity != MASS else "axis": list(curve.values),
                "omega_c_infeasible_rad_s": [case.summary.omega_c_infeasible_rad_s for case in curve.cases],
                "omega_c_feasible_rad_s": [case.summary.omega_c_feasible_rad_s for case in curve.cases],
                "controller_order": [case.summary.order for case in curve.cases],
                "verified": [int(case.summary.verified) for case in curve.cases],
                "certified": [int(case.impossibility is not None) for case in curve.cases],
            }
            for curve in curves.curves
        ]
    )

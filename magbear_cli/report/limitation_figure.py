"""Limitation curves: peak mu and the worst real mass along a sweep, level 1, and where each curve crosses it."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter

from magbear_cli.errors import Status
from magbear_cli.report.canvas import COLOURS, DASHES, INK, LEVEL, MARKERS, SOFT, new_figure, panel_title, panels, plain
from magbear_cli.report.drawing import Drawing, stacked
from magbear_cli.report.numbers import count_text, shortest, significant
from magbear_cli.report.sweep import AXIS_WORDS, Axis, Crossing, Curve, Measure, Sweep, crossings, peak_mu, worst_case

MEASURES: tuple[tuple[str, Measure, str], ...] = (
    ("peak_mu", peak_mu, "Peak µ, complex blocks"),
    ("worst_case", worst_case, "Worst case, real masses"),
)
_WITHOUT_LEVEL = {  # markers at the head of the panel
    Status.INFEASIBLE: ("x", "proven impossible"),
    Status.UNSTABLE: ("*", "unstable"),
    Status.TIMEOUT: ("|", "no answer"),
    Status.CRASHED: ("|", "no answer"),
    Status.FAILED: ("|", "no answer"),
    Status.NOT_ACHIEVED: ("v", "not achieved"),
    Status.UNVERIFIED: ("d", "not verified"),
    Status.OK: ("|", "no answer"),
}
_LEGEND_WIDTH = 104
_LEGEND_ROW_IN = 0.165
_STRIP_ROW = 0.055  # of the height of the panel below the strip
_MOST_CURVES_WITH_CROSSINGS = 9


def limitation_drawing(sweep: Sweep) -> Drawing:
    """The limitation curves of a study."""
    lines = sum(len(textwrap.wrap(_legend_text(curve, sweep), _LEGEND_WIDTH)) for curve in sweep.curves)
    below = 0.36 + _LEGEND_ROW_IN * lines
    figure = new_figure(3.1 + below)
    axes = panels(figure, 2, below=below, wspace=0.1)[0]
    _scale(axes, sweep)
    for panel, (_, measure, title) in zip(axes, MEASURES, strict=True):
        for curve in sweep.curves:
            _draw_curve(panel, curve, measure, sweep)
        panel.axhline(1.0, **LEVEL)
        panel.set_xlabel(plain(AXIS_WORDS[sweep.axis], 80))
        panel_title(panel, title)
    axes[0].set_ylabel("level (1 meets the specification)")
    axes[1].tick_params(labelleft=False, which="both")
    _legends(figure, sweep)
    return Drawing(
        name="limitation",
        title="Limitation curves",
        caption="The level that each controller reaches along the sweep; at 1 or below the specification is met. "
        "Crossings of level 1 (open diamonds) are interpolated between neighbouring cases. Marks in the strip at the "
        "head belong to cases without a level. An open mark says that its method did not get there; only a cross is a "
        "proof of impossibility.",
        alt=f"{count_text(len(sweep.curves), 'limitation curve')} over the {AXIS_WORDS[sweep.axis]}: {_spoken(sweep)}.",
        figure=figure,
        columns=_columns(sweep),
    )


def _levels(sweep: Sweep) -> list[float]:
    levels = [measure(case) for _, measure, _ in MEASURES for curve in sweep.curves for case in curve.cases]
    return [level for level in levels if level is not None]


def _scale(axes: list[Axes], sweep: Sweep) -> None:
    """Both panels alike: logarithmic levels, a strip at the head for cases without one."""
    levels = [*_levels(sweep), 1.0]
    low, high = min(levels) / 1.25, max(1.3, max(levels) * 1.15)
    head = high * (high / low) ** (_STRIP_ROW * len(_strip_rows(sweep)))
    values = sorted({value for curve in sweep.curves for value in curve.values})
    for panel in axes:
        panel.set_yscale("log")
        panel.set_ylim(low, head)
        panel.yaxis.set_major_locator(FixedLocator(_level_ticks(low, high)))
        panel.yaxis.set_minor_locator(FixedLocator([]))
        panel.yaxis.set_major_formatter(FuncFormatter(lambda level, _: f"{level:g}"))
        panel.yaxis.set_minor_formatter(NullFormatter())
        if _is_logarithmic(sweep.axis, values):
            panel.set_xscale("log")
            margin = max((values[-1] / values[0]) ** 0.07, 1.02)
            panel.set_xlim(values[0] / margin, values[-1] * margin)
        else:
            margin = 0.07 * (values[-1] - values[0]) or 0.5
            panel.set_xlim(values[0] - margin, values[-1] + margin)
        _value_ticks(panel, values)
        if head > high:
            panel.axhspan(high, head, facecolor="#e9edf0", edgecolor="none", zorder=0.5)


def _level_ticks(low: float, high: float) -> list[float]:
    """Round levels for a logarithmic axis, the fewer to a decade the longer it is; none in the strip."""
    digits = (1.0, 2.0, 3.0, 5.0) if high < 30 * low else (1.0, 2.0, 5.0) if high < 300 * low else (1.0,)
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    return [digit * 10.0**decade for decade in decades for digit in digits if low <= digit * 10.0**decade <= high]


def _strip_rows(sweep: Sweep) -> list[Curve]:
    """The curves with a case that has no level: each has a row of its own in the strip at the head."""
    return [
        curve
        for curve in sweep.curves
        if any(measure(case) is None for _, measure, _ in MEASURES for case in curve.cases)
    ]


def _is_logarithmic(axis: Axis, values: list[float]) -> bool:
    return axis == Axis.OMEGA_C and values[0] > 0


def _value_ticks(panel: Axes, values: list[float]) -> None:
    """Ticks at the values of the sweep, thinned where they would touch."""
    start, end = panel.transAxes.inverted().transform(panel.transData.transform([(v, 1.0) for v in values]))[[0, -1], 0]
    kept: list[float] = []
    last = start - 1.0
    for value in values:
        at = panel.transAxes.inverted().transform(panel.transData.transform((value, 1.0)))[0]
        if at - last > 0.13 and (end - at > 0.13 or value == values[-1]):
            kept.append(value)
            last = at
    if values[-1] not in kept:
        kept.append(values[-1])
    panel.xaxis.set_major_locator(FixedLocator(kept))
    panel.xaxis.set_minor_locator(FixedLocator([value for value in values if value not in kept]))
    panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: shortest(float(f"{value:.3g}"))))
    panel.xaxis.set_minor_formatter(NullFormatter())


def _pen(curve: Curve, sweep: Sweep) -> tuple[str, Any, str]:
    """Colour by controller and marker by mass; with one controller both by mass."""
    several = len({other.controller for other in sweep.curves}) > 1
    hue = curve.controller if several else curve.family
    return COLOURS[hue % len(COLOURS)], DASHES[hue % len(DASHES)], MARKERS[curve.family % len(MARKERS)]


def _draw_curve(panel: Axes, curve: Curve, measure: Measure, sweep: Sweep) -> None:
    colour, dashes, marker = _pen(curve, sweep)
    points = [(value, case, measure(case)) for value, case in zip(curve.values, curve.cases, strict=True)]
    line = [(value, level) for value, _, level in points if level is not None]
    panel.plot(*zip(*line, strict=True), color=colour, linestyle=dashes, linewidth=1.3, zorder=3) if line else None
    strip = _strip_height(panel, curve, sweep)
    for value, case, level in points:
        if level is None:
            mark = _WITHOUT_LEVEL[case.status][0]
            panel.plot(value, strip, mark, color=colour, markersize=6, markeredgewidth=1.5, zorder=4, clip_on=False)
            continue
        met = case.status == Status.OK
        shape = marker if met else _WITHOUT_LEVEL[case.status][0]
        panel.plot(
            value,
            level,
            shape,
            color=colour,
            markersize=4.8,
            markerfacecolor=colour if met else "white",
            markeredgewidth=1.2,
            zorder=4,
        )
    for crossing in crossings(curve, measure, sweep.axis):
        if crossing.value is not None:
            panel.plot(crossing.value, 1.0, "D", markersize=5.5, markerfacecolor="none", color=INK, zorder=5)


def _strip_height(panel: Axes, curve: Curve, sweep: Sweep) -> float:
    """Where the curve's row in the strip is, as a level."""
    rows = _strip_rows(sweep)
    if curve not in rows:
        return float("nan")
    low, head = panel.get_ylim()
    share = _STRIP_ROW / (1.0 + _STRIP_ROW * len(rows))
    return float(head * (low / head) ** (share * (rows.index(curve) + 0.55)))


def _legends(figure: Figure, sweep: Sweep) -> None:
    """What the curves are and where they cross, and what the marks mean, below both panels."""
    width, height = (float(size) for size in figure.get_size_inches())
    handles, names = [], []
    for curve in sweep.curves:
        colour, dashes, marker = _pen(curve, sweep)
        handles.append(Line2D([], [], color=colour, linestyle=dashes, marker=marker, markersize=4.8))
        names.append(plain(_legend_text(curve, sweep), _LEGEND_WIDTH))
    figure.legend(handles, names, loc="lower left", bbox_to_anchor=(0.58 / width, 0.24 / height), ncols=1)
    marks = _marks(sweep)
    if not marks:
        return
    shapes = [
        Line2D([], [], color=colour, marker=shape, linestyle="none", markerfacecolor="none", markersize=5.5)
        for shape, _, colour in marks
    ]
    figure.legend(
        shapes,
        [name for _, name, _ in marks],
        loc="lower left",
        ncols=len(marks),
        bbox_to_anchor=(0.58 / width, 0.02 / height),
        handlelength=1.0,
        columnspacing=1.6,
    )


def _marks(sweep: Sweep) -> list[tuple[str, str, str]]:
    """The shape, the words and the colour of every mark that the panels hold beside the curves."""
    found = [
        crossing
        for curve in sweep.curves
        for _, measure, _ in MEASURES
        for crossing in crossings(curve, measure, sweep.axis)
    ]
    marks = [("D", "interpolated crossing", INK)] if any(crossing.value is not None for crossing in found) else []
    for case in (case for curve in sweep.curves for case in curve.cases):
        mark = (*_WITHOUT_LEVEL[case.status], SOFT)
        if case.status != Status.OK and mark not in marks:
            marks.append(mark)
    return marks


def _legend_text(curve: Curve, sweep: Sweep) -> str:
    """The name of a curve and where it crosses level 1."""
    if len(sweep.curves) > _MOST_CURVES_WITH_CROSSINGS:
        return curve.label
    parts, brackets = [], []
    for name, (_, measure, _) in zip(("µ", "worst case"), MEASURES, strict=True):
        found = crossings(curve, measure, sweep.axis)
        near = [crossing.text(sweep.axis) for crossing in found if crossing.value is not None]
        if near:
            parts.append(f"{name} = 1 {' and '.join(near)}")
        brackets += [crossing.text(sweep.axis) for crossing in found if crossing.value is None]
    parts += [f"limit {text}" for text in dict.fromkeys(brackets)]
    return f"{curve.label}: {'; '.join(parts)}" if parts else curve.label


def _spoken(sweep: Sweep) -> str:
    parts = []
    for curve in sweep.curves:
        levels = ", ".join(
            f"{significant(worst_case(case))} at {shortest(value)}"
            for value, case in zip(curve.values, curve.cases, strict=True)
        )
        parts.append(f"{curve.label}: worst case {levels}")
    return "; ".join(parts)


def _columns(sweep: Sweep) -> dict[str, list[object]]:
    tables: list[dict[str, Sequence[object]]] = [
        {
            "curve": [curve.label] * len(curve.cases),
            "case_id": [case.case_id for case in curve.cases],
            sweep.axis.value: list(curve.values),
            "status": [case.status.value for case in curve.cases],
            **{name: [measure(case) for case in curve.cases] for name, measure, _ in MEASURES},
            **{
                f"{name}_crosses_1_before_next_case": _by_segment(curve, crossings(curve, measure, sweep.axis))
                for name, measure, _ in MEASURES
            },
        }
        for curve in sweep.curves
    ]
    return stacked(tables)


def _by_segment(curve: Curve, found: list[Crossing]) -> list[float | None]:
    return [next((c.value for c in found if c.low == value), None) for value in curve.values]

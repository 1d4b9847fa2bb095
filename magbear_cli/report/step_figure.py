"""Position and current over time for the masses, without and with the prefilter side by side."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from magbear_cli.report.canvas import INK, PAPER, RUST, SOFT, legend_below, new_figure, note, panel_title, panels, pen
from magbear_cli.report.drawing import Drawing, stacked
from magbear_cli.report.numbers import MICROMETRES, MILLISECONDS, count_text, kilograms, shortest, significant
from magbear_cli.report.series import Labels, file_stem
from magbear_cli.report.step_words import prefilter_text, step_text
from magbear_cli.report.thinning import thinned
from magbear_cli.study.outcome import CaseOutcome, StepOutcome

Floats = NDArray[np.float64]

MOST_COLUMNS = 3
_GAP_IN_VIEW = 0.5  # of the air gap: from here on the limit is part of the picture
_AT_REST = 0.1  # of the largest excursion
_BEYOND_REST = 2.0
_FEWEST_SAMPLES = 30
_MISSED = 0.97  # of a peak: a curve that shows less has missed it
_ZOOM_FROM = 0.7  # a view that would show more than this of the run shows all of it


def step_drawings(outcome: CaseOutcome, outcomes: tuple[CaseOutcome, ...], labels: Labels) -> list[Drawing]:
    """A figure for each kind of step that the case simulated."""
    groups: dict[str, list[StepOutcome]] = {}
    for step in outcome.steps:
        if step.time_s.size > 1:
            groups.setdefault(_kind(step), []).append(step)
    stem = file_stem(outcome, outcomes)
    return [
        _drawing(steps, outcome, labels, f"step-{stem}" if len(groups) == 1 else f"step-{stem}-{number}")
        for number, steps in enumerate(groups.values(), 1)
    ]


def _kind(step: StepOutcome) -> str:
    rest = {key: value for key, value in step.scenario.items() if key not in {"mass_kg", "masses_kg", "prefilter"}}
    return json.dumps([step.step_m, step.model, rest], sort_keys=True, default=str)


def _drawing(steps: Sequence[StepOutcome], outcome: CaseOutcome, labels: Labels, name: str) -> Drawing:
    columns: dict[str, list[StepOutcome]] = {}
    for step in sorted(steps, key=lambda step: bool(step.scenario.get("prefilter"))):
        columns.setdefault(prefilter_text(step), []).append(step)
    texts = list(columns)[:MOST_COLUMNS]
    figure = new_figure(4.5)
    grid = panels(figure, len(texts), rows=2, wspace=0.1, hspace=0.36, below=0.24)
    views = step_views([step for text in texts for step in columns[text]])
    masses = sorted({step.mass_kg for step in steps})
    for column, text in enumerate(texts):
        for step in columns[text]:
            _draw_step(grid[0][column], grid[1][column], step, masses.index(step.mass_kg), views)
        _finish_column((grid[0][column], grid[1][column]), columns[text], text[0].upper() + text[1:], views)
    for axes in (*grid[0][1:], *grid[1][1:]):
        axes.set_ylabel("")
        axes.tick_params(labelleft=False)
    shown = [step for text in texts for step in columns[text]]
    gap_m = float(outcome.inputs.get("bearing", {}).get("air_gap_m", np.inf))
    _set_heights(grid, shown, views, gap_m * MICROMETRES)
    if np.isfinite(gap_m) and not any(step.touched_down for step in shown):
        note(grid[0][-1], _gap_text(shown, gap_m), "lower right")
    _legend(figure, grid[0][0], steps)
    return Drawing(
        name=name,
        title=step_text(steps[0])[0].upper() + step_text(steps[0])[1:],
        caption=_caption(steps, views, cut=len(columns) > MOST_COLUMNS),
        alt=f"Position and current over time for {labels.case(outcome)}, {step_text(steps[0])}: {_spoken(steps)}.",
        figure=figure,
        columns=_columns(steps),
        case_id=outcome.case_id,
    )


def _draw_step(position: Axes, current: Axes, step: StepOutcome, index: int, views: tuple[float, float]) -> None:
    style, label = pen(index), f"{kilograms(step.mass_kg)} kg"
    panels_of = (
        (position, step.position_m * MICROMETRES, step.linear_position_m * MICROMETRES, views[0]),
        (current, step.current_a, step.linear_current_a, views[1]),
    )
    for axes, curve, linear, view_s in panels_of:
        shown = step.time_s <= view_s
        time = step.time_s[shown] * MILLISECONDS
        kept = thinned(time, curve[shown])
        axes.plot(time[kept], curve[shown][kept], color=style.color, linestyle=style.linestyle, label=label, zorder=3)
        if step.model != "linear":
            tame = _until_wild(linear, 3.0 * _size(curve))[shown]
            kept = thinned(time, tame)
            axes.plot(time[kept], tame[kept], color=style.color, linewidth=0.6, alpha=0.75, zorder=2)
    if step.touched_down and step.time_s[-1] <= views[0]:
        at = step.time_s[-1] * MILLISECONDS
        position.plot(at, step.position_m[-1] * MICROMETRES, "X", color=INK, markersize=6, zorder=5)


def _until_wild(curve: Floats, size: float) -> Floats:
    """The curve up to where it first exceeds a size: a diverging model beside the response would dwarf it."""
    wild = np.logical_or.accumulate(~(np.abs(curve) <= size)) if curve.size else np.zeros(0, dtype=bool)
    return np.where(wild, np.nan, curve)


def _size(curve: Floats) -> float:
    finite = np.abs(curve[np.isfinite(curve)])
    return float(finite.max()) if finite.size else 1.0


def _finish_column(
    pair: tuple[Axes, Axes], steps: Sequence[StepOutcome], title: str, views: tuple[float, float]
) -> None:
    position, current = pair
    longest = max(steps, key=lambda step: float(step.time_s[-1]))
    shown = longest.time_s <= views[0]
    kept = thinned(longest.time_s[shown], longest.reference_m[shown])
    time, reference = longest.time_s[shown][kept] * MILLISECONDS, longest.reference_m[shown][kept] * MICROMETRES
    position.plot(time, reference, color=INK, linewidth=0.9, linestyle=(0, (1, 1.5)), label="reference", zorder=2.5)
    for axes, view_s in zip(pair, views, strict=True):
        axes.set_xlim(0.0, view_s * MILLISECONDS)
        axes.set_xlabel("time (ms)", labelpad=1.5)
    position.set_ylabel("position (µm)")
    current.set_ylabel("control current (A)")
    panel_title(position, title)
    note(current, _peak_text(steps))
    fallen = [step for step in steps if step.touched_down]
    if fallen:
        times = ", ".join(
            f"{kilograms(step.mass_kg)} kg at {significant(step.time_s[-1] * MILLISECONDS)} ms" for step in fallen
        )
        note(position, f"× touch-down: {times}")


def _peak_text(steps: Sequence[StepOutcome]) -> str:
    known = [(step.peak_current_a, step.mass_kg) for step in steps if step.peak_current_a is not None]
    known = [(peak, mass) for peak, mass in known if np.isfinite(peak)]
    if not known:
        return "peak current unknown"
    peak, mass = max(known)
    return f"peak current {significant(peak)} A, at {kilograms(mass)} kg"


def step_views(steps: Sequence[StepOutcome]) -> tuple[float, float]:
    """The time to show of the position and of the current: each until it has nearly come to rest, and as long again.

    Runs that ended in the gap are looked at as a whole; they decide only when there are no others.
    """
    good = [step for step in steps if not step.touched_down] or list(steps)
    return _view_s(good, [step.position_m for step in good]), _view_s(good, [step.current_a for step in good])


def _view_s(steps: Sequence[StepOutcome], curves: Sequence[Floats]) -> float:
    whole = max(float(step.time_s[-1]) for step in steps)
    if any(step.end != "finished" for step in steps):
        return 1.02 * whole
    rest = max(_rest_s(step.time_s, curve) for step, curve in zip(steps, curves, strict=True))
    spacing = max(float(step.time_s[-1]) / step.time_s.size for step in steps)
    view = max(_BEYOND_REST * rest, _FEWEST_SAMPLES * spacing)
    return whole if view > _ZOOM_FROM * whole else view


def _rest_s(time: Floats, curve: Floats) -> float:
    """The last time at which a curve is off its end by more than a tenth of its largest excursion."""
    off = np.abs(np.where(np.isfinite(curve), curve, curve[0]) - curve[-1])
    away = np.flatnonzero(off > _AT_REST * off.max()) if np.isfinite(off).all() else np.arange(off.size)
    return float(time[away[-1]]) if away.size else 0.0


def _set_heights(
    grid: list[list[Axes]], steps: Sequence[StepOutcome], views: tuple[float, float], gap_um: float
) -> None:
    """One vertical scale for a row, made for the runs that did not touch down, and the stator where it is near."""
    good = [step for step in steps if not step.touched_down] or list(steps)
    position = _range(
        [step.position_m[step.time_s <= views[0]] * MICROMETRES for step in good]
        + [step.reference_m[step.time_s <= views[0]] * MICROMETRES for step in good]
    )
    current = _range([step.current_a[step.time_s <= views[1]] for step in good])
    near = max(abs(position[0]), abs(position[1])) > _GAP_IN_VIEW * gap_um
    if near:
        position = (
            (min(position[0], -gap_um), position[1])
            if -position[0] > position[1]
            else (position[0], max(position[1], gap_um))
        )
    fallen = any(step.touched_down for step in steps)
    for row, (low, high), headroom in ((grid[0], position, 0.26 if fallen else 0.08), (grid[1], current, 0.24)):
        span = (high - low) or 1.0
        for axes in row:
            axes.set_ylim(low - 0.08 * span, high + headroom * span)
    if near:
        for axes in grid[0]:
            _draw_stator(axes, gap_um)


def _draw_stator(axes: Axes, gap_um: float) -> None:
    low, high = axes.get_ylim()
    for limit in (-gap_um, gap_um):
        if low < limit < high:
            axes.axhspan(limit, high if limit > 0 else low, facecolor="#f6e3d7", edgecolor="none", zorder=0.5)
            axes.axhline(limit, color=RUST, linewidth=1.2, zorder=4)
            axes.text(
                0.02,
                limit - 0.03 * (high - low),
                "air gap ends",
                transform=axes.get_yaxis_transform(),
                va="top",
                color=RUST,
                fontsize=7.5,
                bbox=PAPER,
            )


def _gap_text(steps: Sequence[StepOutcome], gap_m: float) -> str:
    """How much of the air gap is used."""
    used = max(_size(step.position_m) for step in steps) / gap_m
    return f"at most {significant(100.0 * used, 2)} % of the air gap of {shortest(gap_m * MICROMETRES)} µm"


def _range(curves: Sequence[Floats]) -> tuple[float, float]:
    values = np.concatenate([curve[np.isfinite(curve)] for curve in curves]) if curves else np.empty(0)
    return (float(values.min()), float(values.max())) if values.size else (0.0, 1.0)


def _legend(figure: Figure, axes: Axes, steps: Sequence[StepOutcome]) -> None:
    handles, names = axes.get_legend_handles_labels()
    if _has_linear_beside(steps):
        handles.append(Line2D([], [], color=SOFT, linewidth=0.6))
        names.append("linear model")
    legend_below(figure, handles, names)


def _has_linear_beside(steps: Sequence[StepOutcome]) -> bool:
    """Whether a linear model stands beside a response; an adaptive loop has none."""
    return any(step.model != "linear" and np.isfinite(step.linear_position_m).any() for step in steps)


def _caption(steps: Sequence[StepOutcome], views: tuple[float, float], *, cut: bool) -> str:
    whole = max(float(step.time_s[-1]) for step in steps)
    told = ["Thick: the response as simulated; thin: the linear model beside it; dotted: the reference."]
    if steps[0].model == "linear":
        told = ["The response of the linear model; dotted: the reference."]
    elif not _has_linear_beside(steps):
        told = ["The response as simulated; dotted: the reference."]
    if min(views) < whole:
        first = " and ".join(
            f"the first {significant(min(view, whole) * MILLISECONDS)} ms of the {what}"
            for view, what in zip(views, ("position", "current"), strict=True)
        )
        told.append(f"Shown are {first}; the run lasts {significant(whole * MILLISECONDS)} ms.")
    if any(_size(step.current_a) < _MISSED * (step.peak_current_a or 0.0) for step in steps):
        told.append("The largest current falls between two samples of the curve; the figure given is the exact one.")
    if cut:
        told.append("Further prefilters are in the table.")
    if any(step.touched_down for step in steps):
        told.append("A run ends where the rotor meets the stator.")
    return " ".join(told)


def _spoken(steps: Sequence[StepOutcome]) -> str:
    parts = []
    for step in steps:
        if step.touched_down:
            how = f"touches down after {significant(step.time_s[-1] * MILLISECONDS)} ms"
        elif step.settling_time_s is not None:
            how = f"settles in {significant(step.settling_time_s * MILLISECONDS)} ms"
        else:
            how = "does not settle"
        parts.append(f"{kilograms(step.mass_kg)} kg with {prefilter_text(step)} {how}")
    return f"{count_text(len(steps), 'response')}, " + "; ".join(parts)


def _columns(steps: Sequence[StepOutcome]) -> dict[str, list[object]]:
    return stacked(
        [
            {
                "mass_kg": [step.mass_kg] * step.time_s.size,
                "prefilter": [prefilter_text(step)] * step.time_s.size,
                "time_s": step.time_s.tolist(),
                "position_m": step.position_m.tolist(),
                "current_a": step.current_a.tolist(),
                "reference_m": step.reference_m.tolist(),
                "linear_position_m": step.linear_position_m.tolist(),
                "linear_current_a": step.linear_current_a.tolist(),
            }
            for step in steps
        ]
    )

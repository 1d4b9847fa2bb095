"""The counterpart of a figure of the thesis: its quantities on its axes, the thesis's way and ours side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from magbear_cli.report.canvas import (
    INK,
    LEVEL,
    frequency_axis,
    legend_below,
    new_figure,
    panel_title,
    panels,
    pen,
    plain,
)
from magbear_cli.report.drawing import Drawing
from magbear_cli.report.thesis_lines import SCALES, Line, Scale, lines_of
from magbear_cli.report.thinning import thinned
from magbear_cli.spec.thesis import FigureEntry
from magbear_cli.study.outcome import StudyResults

Floats = NDArray[np.float64]

_ROW_IN = 2.15
_NAMES_IN_A_ROW = 4
_LEGEND_ROW_IN = 0.2
_SPREAD_DB = 120.0  # of a view over frequency that no figure asks to be wider
_MARKED = 25  # points: a curve of so few shows each of them
_TITLE = 88  # letters across the figure
_BOUND: dict[str, Any] = {"color": INK, "linewidth": 1.0, "linestyle": (0, (1, 1.3))}


def thesis_drawing(entry: FigureEntry, studies: Mapping[str, StudyResults]) -> Drawing | None:
    """The figure with the numbers behind it; None when none of its cases has what it shows."""
    drawn = [[lines_of(quantity, entry, panel, studies) for panel in entry.columns] for quantity in entry.rows]
    if not any(line for row in drawn for lines in row for line in lines if not line.is_bound):
        return None
    names = list(dict.fromkeys(line.name for row in drawn for lines in row for line in lines if not line.is_bound))
    bounds = list(dict.fromkeys(line.name for row in drawn for lines in row for line in lines if line.is_bound))
    legend_rows = -(-len([*names, *bounds]) // _NAMES_IN_A_ROW)
    below = 0.12 + _LEGEND_ROW_IN * legend_rows
    figure = new_figure(_ROW_IN * len(entry.rows) + 0.7 + below)
    grid = panels(figure, len(entry.columns), rows=len(entry.rows), below=below, left=0.62, wspace=0.2, hspace=0.12)
    scales = [_scale(quantity, entry, studies) for quantity in entry.rows]
    for place, (axes_row, lines_row, scale) in enumerate(zip(grid, drawn, scales, strict=True)):
        view = _view(entry, scale, lines_row)
        is_last = place == len(entry.rows) - 1
        for number, (axes, lines) in enumerate(zip(axes_row, lines_row, strict=True)):
            _draw(axes, lines, names, scale, view, entry)
            _settle(axes, scale, is_last=is_last, is_first=number == 0)
        _same_height(axes_row, lines_row, entry if len(entry.rows) == 1 else None, scale)
    for axes, panel in zip(grid[0], entry.columns, strict=True):
        panel_title(axes, plain(panel.title, _TITLE // len(entry.columns)))
    _legend(figure, names, bounds)
    return Drawing(
        name=entry.id,
        title=f"{_number(entry.id)}: {entry.shows}",
        caption=_caption(entry),
        alt=f"{entry.shows}. {_told(drawn, names)}",
        figure=figure,
        columns=_columns(entry, drawn, scales),
    )


def _draw(
    axes: Axes, lines: Sequence[Line], names: Sequence[str], scale: Scale, view: tuple[float, float], entry: FigureEntry
) -> None:
    for line in lines:
        x, y = _cut(line, view, is_logarithmic=scale.is_frequency)
        if line.is_bound:
            axes.plot(x, y, **_BOUND)
            continue
        own = pen(names.index(line.name))
        marker = own.marker if line.x.size <= _MARKED else None
        axes.plot(x, y, color=own.color, linestyle=own.linestyle, linewidth=1.3, marker=marker, markersize=3.5)
    level = scale.level if entry.mark is None else entry.mark
    if level is not None:
        axes.axhline(level, **LEVEL)
    if "y" in entry.logarithmic:
        axes.set_yscale("log")
    if scale.is_frequency:
        frequency_axis(axes, view, label=False, hertz=False)
        return
    if "x" in entry.logarithmic:
        axes.set_xscale("log")
    axes.set_xlim(*view)


def _settle(axes: Axes, scale: Scale, *, is_last: bool, is_first: bool) -> None:
    """Labels at the outer panels alone."""
    axes.tick_params(labelbottom=is_last, labelleft=is_first)
    if is_last:
        axes.set_xlabel(scale.x_label)
    if is_first:
        axes.set_ylabel(scale.y_label)


def _scale(quantity: str, entry: FigureEntry, studies: Mapping[str, StudyResults]) -> Scale:
    if quantity != "table":
        return SCALES[quantity]
    for where in entry.columns[0].cases:
        for outcome in studies[str(where["study"])].outcomes:
            table = outcome.tables.get(entry.table or "")
            if table is not None:
                columns = {column.name: column for column in table.columns}
                across = columns[entry.across or table.columns[0].name]
                curves = entry.curves or [name for name in columns if name != across.name]
                shown = columns[curves[0]]
                is_frequency = across.unit == "rad/s" and "x" in entry.logarithmic
                labels = [_axis(column.long_name, column.unit) for column in (across, shown)]
                label = entry.ordinate or (table.long_name if len(curves) > 1 else labels[1])
                return Scale(labels[0], label, across.name if is_frequency else f"over_{across.name}", "value")
    return Scale("", "", "x", "value")


def _axis(name: str, unit: str) -> str:
    return name if unit == "1" else f"{name} ({unit})"


def _view(entry: FigureEntry, scale: Scale, rows: Sequence[Sequence[Line]]) -> tuple[float, float]:
    """The ends of the abscissa, the same for the panels of a row."""
    if entry.view is not None:
        return entry.view[0], entry.view[1]
    every = [
        line.x[np.isfinite(line.x) & ((line.x > 0.0) | (not scale.is_frequency))] for lines in rows for line in lines
    ]
    own = [line.x for lines in rows for line in lines if not line.is_bound] if not scale.is_frequency else every
    points = np.concatenate([x for x in own if x.size] or [np.array([0.0, 1.0])])
    low, high = float(np.min(points)), float(np.max(points))
    return (low, high) if low < high else (low - 0.5, high + 0.5)


def _cut(line: Line, view: tuple[float, float], *, is_logarithmic: bool) -> tuple[Floats, Floats]:
    """The points in view, no more of them than the eye can tell apart."""
    low, high = view
    spare = 0.02 * (high - low)
    shown = np.isfinite(line.x) & (line.x >= (low / 1.05 if is_logarithmic else low - spare)) & (line.x <= high * 1.05)
    shown &= (line.x > 0.0) | (not is_logarithmic)
    x, y = line.x[shown], line.y[shown]
    if x.size <= 60 or not np.isfinite(y).any():
        return x, y
    kept = thinned(np.log10(x) if is_logarithmic else x, np.where(np.isfinite(y), y, np.nan))
    return x[kept], y[kept]


def _same_height(
    row: Sequence[Axes], lines_row: Sequence[Sequence[Line]], entry: FigureEntry | None, scale: Scale
) -> None:
    """One ordinate for the panels of a row, so that they can be compared."""
    if entry is not None and entry.height is not None:
        for axes in row:
            axes.set_ylim(*entry.height)
        return
    ends = [axes.get_ylim() for axes in row]
    low, high = min(end[0] for end in ends), max(end[1] for end in ends)
    if scale.is_frequency and row[0].get_yscale() == "linear":
        own = [line.y[np.isfinite(line.y)] for lines in lines_row for line in lines if not line.is_bound]
        top = max((float(values.max()) for values in own if values.size), default=high)
        low, high = max(low, top - _SPREAD_DB), min(high, top + 15.0)
    for axes in row:
        axes.set_ylim(low, high)


def _legend(figure: Figure, names: Sequence[str], bounds: Sequence[str]) -> None:
    handles = []
    for index, _ in enumerate(names):
        own = pen(index)
        handles.append(Line2D([], [], color=own.color, linestyle=own.linestyle, linewidth=1.3))
    handles += [Line2D([], [], **_BOUND) for _ in bounds]
    told = [plain(name, 60) for name in (*names, *bounds)]
    shown = [(handle, name) for handle, name in zip(handles, told, strict=True) if name]
    if shown:
        legend_below(figure, [handle for handle, _ in shown], [name for _, name in shown], _NAMES_IN_A_ROW)


def _caption(entry: FigureEntry) -> str:
    panels_told = "; ".join(panel.title for panel in entry.columns)
    return (
        f"Counterpart of figure {_number(entry.id).removeprefix('Figure ')} of the thesis, on its axes. {panels_told}."
    )


def _number(name: str) -> str:
    """``fig_3_14`` as ``Figure 3.14``; a suffix tells several counterparts of one figure apart."""
    parts = name.split("_")
    rest = f", {' '.join(parts[3:])}" if len(parts) > 3 else ""
    return f"Figure {parts[1]}.{parts[2]}{rest}"


def _told(drawn: Sequence[Sequence[Sequence[Line]]], names: Sequence[str]) -> str:
    curves = sum(not line.is_bound for row in drawn for lines in row for line in lines)
    named = [name for name in names if name][:6]
    return f"{curves} curves" + (f": {', '.join(named)}" if named else "")


def _columns(
    entry: FigureEntry, drawn: Sequence[Sequence[Sequence[Line]]], scales: Sequence[Scale]
) -> Mapping[str, Sequence[object]]:
    """The numbers behind the figure, one point a row."""
    columns: dict[str, list[object]] = {"panel": [], "kind": [], "curve": [], "x": [], "y": [], "x_is": [], "y_is": []}
    for quantity_lines, scale in zip(drawn, scales, strict=True):
        for panel, lines in zip(entry.columns, quantity_lines, strict=True):
            for line in lines:
                size = line.x.size
                columns["panel"] += [panel.title] * size
                columns["kind"] += ["bound" if line.is_bound else "value"] * size
                columns["curve"] += [line.name] * size
                columns["x"] += line.x.tolist()
                columns["y"] += line.y.tolist()
                columns["x_is"] += [scale.x_name] * size
                columns["y_is"] += [scale.y_name] * size
    return columns

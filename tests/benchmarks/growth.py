"""The curves of growth as a table and a figure, each with its exponent between its last points."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tests.benchmarks.measuring import medians
from tests.benchmarks.rows.growth import CURVES, SEPARATOR


def curves_of(document: Mapping[str, Any]) -> dict[str, dict[int, float]]:
    """Seconds by number of points, by curve."""
    found: dict[str, dict[int, float]] = {}
    for side, seconds in medians(document["samples"]).items():
        name, number = side.rsplit(SEPARATOR, 1)
        found.setdefault(name, {})[int(number)] = seconds
    return found


def growth_table(document: Mapping[str, Any]) -> list[str]:
    """A line for each curve: its points in ms, and the power of its last doublings."""
    lines = ["| cost in ms | | power at the end | why |", "| --- | --- | --- | --- |"]
    for name, points in curves_of(document).items():
        numbers, seconds = np.array(list(points)), np.array(list(points.values()))
        power = np.polyfit(np.log(numbers[-3:]), np.log(seconds[-3:]), 1)[0] if numbers.size > 2 else float("nan")
        told = ", ".join(f"{n}: {1e3 * value:.3g}" for n, value in points.items())
        lines.append(f"| {name} | {told} | {power:.2f} | {CURVES[name]} |")
    return lines


def draw_growth(document: Mapping[str, Any], path: Path) -> None:
    """Every curve in a panel of its own, on logarithmic axes, with the slopes of growth by one and by two."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator, StrMethodFormatter

    found = curves_of(document)
    figure = Figure(figsize=(11.0, 6.6), layout="constrained")
    FigureCanvasSVG(figure)
    for axes, (name, points) in zip(figure.subplots(2, 3).flat, found.items(), strict=False):
        numbers, milliseconds = np.array(list(points), dtype=float), 1e3 * np.array(list(points.values()))
        axes.loglog(numbers, milliseconds, "o-", color="#1f5fa8")
        axes.loglog(numbers, milliseconds[-1] * numbers / numbers[-1], ":", color="0.5", label="in proportion")
        what, over = name.rsplit(", over ", 1)
        axes.set_title(what, fontsize=10)
        axes.set_xlabel(over)
        axes.set_ylabel("ms a case" if "cases" in over else "ms")
        axes.set_xticks(numbers, [f"{number:g}" for number in numbers])
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.minorticks_off()
        axes.set_ylim(0.5 * milliseconds.min(), 2.0 * milliseconds.max())
        axes.grid(visible=True, alpha=0.3)
        axes.legend(fontsize=8)
    with rc_context({"svg.hashsalt": "growth"}):
        figure.savefig(path, metadata={"Date": None})

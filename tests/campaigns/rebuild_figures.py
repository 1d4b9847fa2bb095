"""Whether every curve of every figure can be rebuilt from the CSV behind it, and from nothing else.

Figures are drawn anew from the results and compared with the CSV files on disk: each point of each curve must be a pair
of numbers of one row, each perhaps in another unit. Run it on a directory of ``magbear reproduce`` or of a run:
``python tests/campaigns/rebuild_figures.py out/thesis``.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from magbear_cli.report.canvas import house_style
from magbear_cli.report.drawing import Drawing
from magbear_cli.report.gallery import case_drawings, study_drawings
from magbear_cli.report.series import Labels
from magbear_cli.report.thesis_figure import thesis_drawing
from magbear_cli.spec.thesis import read_figures
from magbear_cli.store.results import read_results
from magbear_cli.study.outcome import StudyResults

Floats = NDArray[np.float64]

FEWEST_POINTS = 5  # of a curve; shorter lines are levels, bars and marks
CLOSE = 1e-7  # of the larger number, and of the panel's span
UNITS = (1.0, -1.0, 1e3, 1e6, 1e-3, 1e-6, 100.0)


def columns_of(path: Path) -> dict[str, Floats]:
    """The columns of numbers of a CSV file, and for each its decibels."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    found = {}
    for name in rows[0] if rows else []:
        try:
            found[name] = np.array([float(row[name]) if row[name] else np.nan for row in rows])
        except ValueError:
            continue
    with np.errstate(all="ignore"):
        decibels = {f"dB of {name}": 20.0 * np.log10(np.abs(values)) for name, values in found.items()}
    return found | decibels


def curves_of(figure: Figure) -> Iterator[tuple[str, Floats, Floats]]:
    """Every curve that is drawn: where, and its finite points."""
    for place, axes in enumerate(figure.axes):
        for line in axes.lines:
            if line.get_transform() != axes.transData:
                continue
            x, y = np.asarray(line.get_xdata(), dtype=float), np.asarray(line.get_ydata(), dtype=float)
            sound = np.isfinite(x) & np.isfinite(y)
            if sound.sum() >= FEWEST_POINTS:
                yield f"panel {place + 1}, {line.get_label()}", x[sound], y[sound]


def is_rebuilt(x: Floats, y: Floats, columns: dict[str, Floats]) -> bool:
    """Whether all points are rows of two columns."""
    across = [values * unit for values in columns.values() for unit in UNITS if _holds(values * unit, x)]
    upward = [values * unit for values in columns.values() for unit in UNITS if _holds(values * unit, y)]
    return any(_are_rows(x, y, one, other) for one in across for other in upward)


def _holds(values: Floats, points: Floats) -> bool:
    """Whether each point is one of the values."""
    known = np.sort(values[np.isfinite(values)])
    if not known.size:
        return False
    right = np.clip(np.searchsorted(known, points), 0, known.size - 1)
    left = np.maximum(right - 1, 0)
    distance = np.minimum(np.abs(known[right] - points), np.abs(known[left] - points))
    return bool((distance <= CLOSE * np.maximum(np.abs(points), CLOSE * np.ptp(points))).all())


def _are_rows(x: Floats, y: Floats, one: Floats, other: Floats) -> bool:
    tolerance = [CLOSE * np.maximum(np.abs(points), CLOSE * np.ptp(points))[:, None] for points in (x, y)]
    with np.errstate(invalid="ignore"):
        same = (np.abs(x[:, None] - one) <= tolerance[0]) & (np.abs(y[:, None] - other) <= tolerance[1])
    return bool(same.any(axis=1).all())


def drawings_of(directory: Path) -> Iterator[tuple[Drawing, Path]]:
    """The drawings of a directory, each with the CSV that should rebuild it."""
    if (directory / "results.h5").is_file():
        results = read_results(directory / "results.h5")
        labels = Labels(results.outcomes)
        for drawing in chain(study_drawings(results, labels), case_drawings(results, labels)):
            yield drawing, directory / "report" / "tables" / f"{drawing.name}.csv"
        return
    studies = _Studies(directory)
    for entry in read_figures():
        table = directory / "tables" / f"{entry.id}.csv"
        found = thesis_drawing(entry, studies) if table.is_file() else None
        if found is not None:
            yield found, table


class _Studies(dict[str, StudyResults]):
    """Results by the name of their study, read when they are asked for."""

    def __init__(self, directory: Path) -> None:
        super().__init__()
        self._directory = directory

    def __missing__(self, name: str) -> StudyResults:
        self[name] = read_results(self._directory / name / "results.h5")
        return self[name]


def main() -> int:
    """Check a directory, tell what cannot be rebuilt, and answer 1 if there is such a curve."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("directory", type=Path)
    directory = parser.parse_args().directory
    figures, curves, lost = 0, 0, 0
    with house_style():
        for drawing, table in drawings_of(directory):
            figures, columns = figures + 1, columns_of(table)
            for where, x, y in curves_of(drawing.figure):
                curves += 1
                if not is_rebuilt(x, y, columns):
                    lost += 1
                    print(f"{drawing.name}, {where}: {x.size} points are not in {table.name}")
    print(f"{figures} figures, {curves} curves, {lost} that their CSV does not rebuild")
    return 1 if lost or not curves else 0


if __name__ == "__main__":
    sys.exit(main())

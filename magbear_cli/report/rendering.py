"""A report as files in memory: every figure in three forms, the numbers behind it, and at last the page."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

from magbear_cli.report.canvas import house_style, rendered
from magbear_cli.report.drawing import csv_bytes
from magbear_cli.report.gallery import case_drawings, study_drawings
from magbear_cli.report.page import Plates, render_page
from magbear_cli.report.selection import MOST_CASES
from magbear_cli.report.series import Labels
from magbear_cli.report.svg import described
from magbear_cli.report.tables import case_columns
from magbear_cli.study.outcome import StudyResults

PAGE = "index.html"
FIGURES, TABLES = "figures", "tables"


def report_files(results: StudyResults) -> Iterator[tuple[str, bytes]]:
    """The files of a report, each by its path below the report's directory, one after the other; the page is last."""
    labels, plates = Labels(results.outcomes), Plates()
    with house_style():
        for drawing in chain(study_drawings(results, labels), case_drawings(results, labels)):
            svg = described(rendered(drawing.figure, "svg"), drawing.title, drawing.alt)
            plates.add(drawing, svg)
            yield f"{TABLES}/{drawing.name}.csv", csv_bytes(drawing.columns)
            yield f"{FIGURES}/{drawing.name}.pdf", rendered(drawing.figure, "pdf")
            yield f"{FIGURES}/{drawing.name}.png", rendered(drawing.figure, "png")
            yield f"{FIGURES}/{drawing.name}.svg", svg
    if len(results.outcomes) > MOST_CASES:
        yield f"{TABLES}/cases.csv", csv_bytes(case_columns(results.outcomes))
    yield PAGE, render_page(results, labels, plates).encode("utf-8")

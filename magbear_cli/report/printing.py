"""A figure as it leaves the report: its files as bytes, and the words around it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain

from magbear_cli.report.canvas import house_style, rendered
from magbear_cli.report.drawing import Drawing, csv_bytes
from magbear_cli.report.gallery import case_drawings, study_drawings
from magbear_cli.report.series import Labels
from magbear_cli.report.svg import described
from magbear_cli.study.outcome import StudyResults


@dataclass(frozen=True)
class Print:
    """A figure in three forms, the numbers behind it as CSV, and what a page says about it (as ``Drawing`` has it)."""

    name: str
    title: str
    caption: str
    alt: str
    case_id: str | None
    svg: bytes
    pdf: bytes
    png: bytes
    csv: bytes


def prints(results: StudyResults, part: int = 0, parts: int = 1) -> Iterator[Print]:
    """Every ``parts``-th figure of a study, from the one numbered ``part``, one after the other."""
    labels = Labels(results.outcomes)
    with house_style():
        for number, drawing in enumerate(chain(study_drawings(results, labels), case_drawings(results, labels))):
            if number % parts == part:
                yield _printed(drawing)


def _printed(drawing: Drawing) -> Print:
    svg = described(rendered(drawing.figure, "svg"), drawing.title, drawing.alt)
    pdf, png = rendered(drawing.figure, "pdf"), rendered(drawing.figure, "png")
    words = (drawing.name, drawing.title, drawing.caption, drawing.alt, drawing.case_id)
    return Print(*words, svg, pdf, png, csv_bytes(drawing.columns))

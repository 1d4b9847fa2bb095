"""From drawings to what leaves the report; whatever is imported from here brings matplotlib along."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

from magbear_cli.report.canvas import house_style, rendered
from magbear_cli.report.drawing import Drawing, csv_bytes
from magbear_cli.report.gallery import PER_CASE, case_drawings, study_drawings
from magbear_cli.report.series import Labels
from magbear_cli.report.sheet import Print
from magbear_cli.report.svg import described
from magbear_cli.study.outcome import CaseOutcome, StudyResults


def prints(results: StudyResults, part: int = 0, parts: int = 1) -> Iterator[Print]:
    """Every ``parts``-th figure of a study, from the one numbered ``part``, one after the other."""
    labels = Labels(results.outcomes)
    yield from _dealt(chain(study_drawings(results, labels), case_drawings(results, labels)), part, parts)


def prints_of_study(results: StudyResults, part: int, parts: int) -> tuple[Print, ...]:
    """The same of the figures about several cases alone."""
    return tuple(_dealt(study_drawings(results, Labels(results.outcomes)), part, parts))


def prints_of_case(
    kind: str, outcome: CaseOutcome, fellows: tuple[CaseOutcome, ...], labels: Labels
) -> tuple[Print, ...]:
    """The figures of a kind about one case; of its ``fellows`` only the names matter."""
    with house_style():
        return tuple(_printed(drawing) for drawing in PER_CASE[kind](outcome, fellows, labels))


def _dealt(drawings: Iterator[Drawing], part: int, parts: int) -> Iterator[Print]:
    with house_style():
        for number, drawing in enumerate(drawings):
            if number % parts == part:
                yield _printed(drawing)


def _printed(drawing: Drawing) -> Print:
    svg = described(rendered(drawing.figure, "svg"), drawing.title, drawing.alt)
    pdf, png = rendered(drawing.figure, "pdf"), rendered(drawing.figure, "png")
    words = (drawing.name, drawing.title, drawing.caption, drawing.alt, drawing.case_id)
    return Print(*words, svg, pdf, png, csv_bytes(drawing.columns))

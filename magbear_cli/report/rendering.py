"""A report as files in memory: every figure in three forms, the numbers behind it, and at last the page."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from magbear_cli.report.drawing import csv_bytes
from magbear_cli.report.page import Plates, render_page
from magbear_cli.report.press import printed
from magbear_cli.report.selection import MOST_CASES
from magbear_cli.report.series import Labels
from magbear_cli.report.sheet import Print
from magbear_cli.report.tables import case_columns
from magbear_cli.study.outcome import StudyResults

PAGE = "index.html"
FIGURES, TABLES = "figures", "tables"


def report_files(
    results: StudyResults, processes: int = 1, sheets: Iterable[Print] | None = None
) -> Iterator[tuple[str, bytes]]:
    """The files of a report, each by its path below the report's directory, one after the other; the page is last.

    The figures are ``sheets``, or drawn by so many processes.
    """
    labels, plates = Labels(results.outcomes), Plates()
    for sheet in printed(results, processes) if sheets is None else sheets:
        plates.add(sheet, sheet.svg)
        yield f"{TABLES}/{sheet.name}.csv", sheet.csv
        yield f"{FIGURES}/{sheet.name}.pdf", sheet.pdf
        yield f"{FIGURES}/{sheet.name}.png", sheet.png
        yield f"{FIGURES}/{sheet.name}.svg", sheet.svg
    if len(results.outcomes) > MOST_CASES:
        yield f"{TABLES}/cases.csv", csv_bytes(case_columns(results.outcomes))
    yield PAGE, render_page(results, labels, plates).encode("utf-8")

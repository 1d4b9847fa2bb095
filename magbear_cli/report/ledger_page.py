"""The page a reader of the thesis wants: what holds, what was a slip, what was a limit of the method; the figures."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from magbear_cli.claims.comparison import Comparison
from magbear_cli.claims.ledger import JudgedClaim, Verdict, tally
from magbear_cli.report.canvas import house_style, rendered
from magbear_cli.report.drawing import csv_bytes
from magbear_cli.report.page import Plates, page_template, resource
from magbear_cli.report.svg import described
from magbear_cli.report.thesis_figure import thesis_drawing
from magbear_cli.spec.thesis import FigureEntry
from magbear_cli.study.outcome import StudyResults

CHAPTERS = {"2": "Design examples", "3": "Limits of linear control", "4": "The nonlinear bearing and adaptive control"}


@dataclass(frozen=True)
class _Group:
    """Claims that share a verdict, under a heading that says what it means."""

    title: str
    explanation: str
    claims: Sequence[JudgedClaim]


_GROUPS = {
    Verdict.CONFIRMED: ("What holds", "Recomputed from the printed data, the printed figure comes out."),
    Verdict.ERRATUM: ("What was a slip", "The claim holds once a printed constant or formula is mended."),
    Verdict.SUPERSEDED: (
        "What was a limit of the method, not of linear control",
        "The claim holds for the procedure that was used; better controllers exist, and are proven here.",
    ),
    Verdict.NOT_REPRODUCED: (
        "What does not come out",
        "The printed figure does not follow from what is printed, as far as it can be read.",
    ),
    Verdict.NOT_EVALUATED: ("What could not be judged", "A case that the claim needs has no answer."),
}


def ledger_files(
    claims: Sequence[JudgedClaim],
    comparison: Comparison | None,
    figures: Sequence[FigureEntry],
    studies: Mapping[str, StudyResults],
) -> Iterator[tuple[str, bytes]]:
    """The files of the ledger, each by its path below the directory, one after the other; the page is last."""
    plates = Plates()
    with house_style():
        for entry in figures:
            drawing = thesis_drawing(entry, studies)
            if drawing is None:
                continue
            svg = described(rendered(drawing.figure, "svg"), drawing.title, drawing.alt)
            plates.add(drawing, svg)
            yield f"tables/{drawing.name}.csv", csv_bytes(drawing.columns)
            yield f"figures/{drawing.name}.pdf", rendered(drawing.figure, "pdf")
            yield f"figures/{drawing.name}.png", rendered(drawing.figure, "png")
            yield f"figures/{drawing.name}.svg", svg
    documents = [claim.document() for claim in claims]
    beside = {} if comparison is None else {"comparison": comparison.document()}
    yield (
        "ledger.json",
        (json.dumps({"claims": documents, **beside}, indent=2, ensure_ascii=False) + "\n").encode("utf-8"),
    )
    yield "ledger.csv", csv_bytes(_columns(claims))
    yield "index.html", _page(claims, comparison, plates).encode("utf-8")


def _columns(claims: Sequence[JudgedClaim]) -> Mapping[str, Sequence[object]]:
    keys = ("id", "place", "claim", "printed", "ours", "verdict", "why")
    documents = [claim.document() for claim in claims]
    return {key: [document[key] for document in documents] for key in keys}


def _page(claims: Sequence[JudgedClaim], comparison: Comparison | None, plates: Plates) -> str:
    return page_template("ledger.html.j2").render(
        style=Markup(resource("page.css")),  # noqa: S704 - a file of this package
        headline=f"{len(claims)} claims: {tally(claims)}.",
        letters=plates.letters,
        groups=_groups(claims),
        comparison=comparison,
        chapters=[
            (number, title, [plate for plate in plates.plates if plate.name.startswith(f"fig_{number}_")])
            for number, title in CHAPTERS.items()
            if any(plate.name.startswith(f"fig_{number}_") for plate in plates.plates)
        ],
    )


def _groups(claims: Sequence[JudgedClaim]) -> list[_Group]:
    groups = [
        _Group(title, explanation, [claim for claim in claims if claim.finding.verdict is verdict])
        for verdict, (title, explanation) in _GROUPS.items()
    ]
    return [group for group in groups if group.claims]

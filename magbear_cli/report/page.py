"""The page: verdict, limitation curves, tables, cases and provenance in one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib import resources

from jinja2 import Environment, StrictUndefined, Template
from markupsafe import Markup, escape

from magbear_cli.report import tables
from magbear_cli.report.drawing import Drawing
from magbear_cli.report.selection import omissions, shown
from magbear_cli.report.series import Labels
from magbear_cli.report.sheet import Print
from magbear_cli.report.svg import inlined
from magbear_cli.report.verdict import headline, remarks
from magbear_cli.study.outcome import CaseOutcome, StudyResults

MOST_UNFOLDED = 12  # figures of single cases; more are folded away
MOST_TRADE_OFFS = 3  # before the tables; more go to the controllers
MOST_CONTROLLERS = 4  # more are folded away


@dataclass(frozen=True)
class Plate:
    """A drawing as the page needs it: its picture as text, and what is said about it."""

    name: str
    title: str
    caption: str
    alt: str
    case_id: str | None
    picture: Markup


@dataclass
class Plates:
    """The pictures of a page, with the outlines of their letters kept once for all."""

    plates: list[Plate] = field(default_factory=list)
    glyphs: dict[str, str] = field(default_factory=dict)

    def add(self, drawing: Drawing | Print, svg: bytes) -> None:
        """Take in a drawing."""
        picture = Markup(inlined(svg, drawing.name, self.glyphs))  # noqa: S704 - made by matplotlib, names escaped
        self.plates.append(Plate(drawing.name, drawing.title, drawing.caption, drawing.alt, drawing.case_id, picture))

    @property
    def letters(self) -> Markup:
        """The definitions of all letters, by name."""
        return Markup("".join(self.glyphs[name] for name in sorted(self.glyphs)))  # noqa: S704 - matplotlib's


@dataclass(frozen=True)
class CaseSection:
    """What is folded under one case."""

    row: tables.CaseRow
    title: str
    verification: str
    figures: Sequence[tuple[str, str]]
    statistics: Sequence[tuple[str, str]]
    plates: Sequence[Plate]


def render_page(results: StudyResults, labels: Labels, plates: Plates) -> str:
    """The HTML of the page."""
    own = [plate for plate in plates.plates if plate.case_id is not None]
    overview, controllers = _shared(plates)
    whole, results = results, shown(results)
    return page_template("page.html.j2").render(
        name=results.name,
        style=Markup(resource("page.css")),  # noqa: S704 - a file of this package
        script=Markup(resource("page.js")),  # noqa: S704 - a file of this package
        headline=headline(whole.outcomes),
        remarks=[*remarks(whole, labels), *omissions(len(whole.outcomes), has_case_figures=bool(own))],
        letters=plates.letters,
        overview_title=_overview_title(overview),
        overview=overview,
        controllers=controllers,
        controllers_unfolded=len(controllers) <= MOST_CONTROLLERS,
        case_heads=tables.CASE_HEADS,
        case_rows=tables.case_rows(results, labels),
        step_heads=tables.STEP_HEADS,
        step_groups=tables.step_groups(results, labels),
        failures=tables.failures(results, labels),
        sections=_sections(results, labels, own),
        unfolded=len(own) <= MOST_UNFOLDED,
        provenance=tables.provenance_rows(results),
        study_text=results.study_text,
        study_file=tables.STUDY_FILE,
    )


def _shared(plates: Plates) -> tuple[list[Plate], list[Plate]]:
    """The figures about several cases: those that stand before the tables, and those about controllers."""
    shared = [plate for plate in plates.plates if plate.case_id is None]
    trade_offs = sum(plate.name.startswith("trade_off") for plate in shared)
    limits = ("limits", "limitation", "least_current", "orders")
    first = (*limits, "trade_off") if trade_offs <= MOST_TRADE_OFFS else limits
    before = [plate for plate in shared if plate.name.startswith(first)]
    return before, [plate for plate in shared if plate not in before]


def _overview_title(plates: Sequence[Plate]) -> str:
    limits = any(plate.name in {"limits", "limitation"} for plate in plates)
    return "Where linear control ends" if limits else "How simple the controller may be"


def _sections(results: StudyResults, labels: Labels, plates: Sequence[Plate]) -> list[CaseSection]:
    by_case: dict[str, list[Plate]] = {}
    for plate in plates:
        by_case.setdefault(plate.case_id or "", []).append(plate)
    rows = tables.case_rows(results, labels)
    return [
        _section(row, outcome, labels, by_case.pop(outcome.case_id, []))
        for row, outcome in zip(rows, results.outcomes, strict=True)
    ]


def _section(row: tables.CaseRow, outcome: CaseOutcome, labels: Labels, plates: Sequence[Plate]) -> CaseSection:
    return CaseSection(
        row=row,
        title=labels.case(outcome),
        verification=outcome.summary.verification_sentence,
        figures=tables.case_figures(outcome),
        statistics=tables.statistics(outcome),
        plates=plates,
    )


def page_template(name: str) -> Template:
    """A template of this package, with what every page uses."""
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters["with_indices"] = _with_indices
    return environment.from_string(resource(name))


def _with_indices(text: str) -> Markup:
    """The text, escaped, with ω_c as it is written by hand."""
    return Markup(str(escape(text)).replace("ω_c", "<i>ω</i><sub>c</sub>"))  # noqa: S704 - escaped the line above


def resource(name: str) -> str:
    """The text of a file of this package."""
    return resources.files("magbear_cli.report").joinpath(name).read_text(encoding="utf-8")

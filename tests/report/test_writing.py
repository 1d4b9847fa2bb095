"""What a report is on disk: complete, self-contained, the same every time."""

from __future__ import annotations

import csv
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from magbear_cli.errors import ResumableError, Status
from magbear_cli.report.writing import write_report
from magbear_cli.study.outcome import CaseOutcome, StudyResults

MakeCase = Callable[..., CaseOutcome]
MakeStudy = Callable[..., StudyResults]
VOID = {"meta", "link", "br", "img", "hr", "input", "use", "path", "rect"}


class Outline(HTMLParser):
    """The tags of a page with their attributes, and whether they are well nested."""

    def __init__(self) -> None:
        """Start with nothing open."""
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Remember a tag."""
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Remember a tag without content."""
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        """Close the tag that is open."""
        if tag not in VOID:
            assert self.open.pop() == tag


def outline(page: str) -> Outline:
    """The tags of a page."""
    parser = Outline()
    parser.feed(page)
    parser.close()
    return parser


def page_of(report: Path) -> str:
    """The text of a report's page."""
    return (report / "index.html").read_text(encoding="utf-8")


def test_every_case_stands_in_the_table_once(mixed_report: Path, mixed_study: StudyResults) -> None:
    """The table of cases holds each case of the study exactly once, whatever its ending."""
    found = [
        attributes["data-case"] for _, attributes in outline(page_of(mixed_report)).tags if "data-case" in attributes
    ]
    assert found == [outcome.case_id for outcome in mixed_study.outcomes]


def test_the_page_needs_nothing_but_itself(mixed_report: Path) -> None:
    """The page loads no style, picture or font, names no address in the network, and has its one script inside."""
    page = page_of(mixed_report)
    assert not re.search(r"https?://|//[a-z]|@import|url\((?!#)", page)
    tags = outline(page).tags
    assert not {"iframe", "img", "object", "embed"} & {tag for tag, _ in tags}
    assert [attributes for tag, attributes in tags if tag == "script"] == [{}]
    assert all(attributes.get("href", "") == "data:," for tag, attributes in tags if tag == "link")


def test_the_page_is_well_nested_with_unique_names(mixed_report: Path) -> None:
    """Every tag is closed in turn, every id is given once, and every reference leads somewhere."""
    parsed = outline(page_of(mixed_report))
    assert parsed.open == []
    names = [attributes["id"] for _, attributes in parsed.tags if attributes.get("id")]
    assert len(names) == len(set(names))
    targets = [attributes.get("href") or "" for tag, attributes in parsed.tags if tag in {"a", "use"}]
    inside = [target[1:] for target in targets if target.startswith("#")]
    assert set(inside) <= set(names)
    assert all((mixed_report / target).is_file() for target in targets if not target.startswith("#"))


def test_each_figure_speaks(mixed_report: Path) -> None:
    """Every figure of the page has a label for screen readers, and its SVG file a title and a description."""
    labels = [
        attributes.get("aria-label")
        for _, attributes in outline(page_of(mixed_report)).tags
        if attributes.get("role") == "img"
    ]
    files = sorted((mixed_report / "figures").glob("*.svg"))
    assert len(labels) == len(files) > 6
    assert all(label and len(label) > 40 for label in labels)
    for file in files:
        root = ET.fromstring(file.read_bytes())  # noqa: S314 - written by the function under test
        kinds = [child.tag.rpartition("}")[2] for child in root]
        assert kinds[:2] == ["title", "desc"]


def test_each_figure_comes_in_all_forms(mixed_report: Path) -> None:
    """Beside every SVG lie the PNG, the PDF and the CSV of the same name, and nothing else."""
    stems = {path.stem for path in (mixed_report / "figures").glob("*.svg")}
    for folder, suffix in (("figures", "png"), ("figures", "pdf"), ("tables", "csv")):
        assert {path.stem for path in (mixed_report / folder).glob(f"*.{suffix}")} == stems
    assert len(list((mixed_report / "figures").iterdir())) == 3 * len(stems)


def test_curves_are_rebuilt_from_their_tables(mixed_report: Path, mixed_study: StudyResults) -> None:
    """The CSV of mu and of the step hold the curves to the last bit."""
    case = mixed_study.outcomes[0]
    assert case.frequency is not None
    mu = _table(mixed_report / "tables" / f"mu-{case.case_id}.csv")
    np.testing.assert_array_equal(np.array(mu["mu_upper"], dtype=float), case.frequency.mu_upper)
    np.testing.assert_array_equal(np.array(mu["omega_rad_s"], dtype=float), case.frequency.omega_rad_s)
    step = _table(mixed_report / "tables" / f"step-{case.case_id}.csv")
    positions = np.concatenate([entry.position_m for entry in case.steps])
    np.testing.assert_array_equal(np.array(step["position_m"], dtype=float), positions)
    assert len(set(step["prefilter"])) == 2


def _table(path: Path) -> dict[str, list[str]]:
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    return {name: [row[place] for row in rows[1:]] for place, name in enumerate(rows[0])}


def test_the_same_study_gives_the_same_bytes(make_case: MakeCase, make_study: MakeStudy, tmp_path: Path) -> None:
    """Two reports of one study are the same file by file, byte by byte."""
    study = make_study(make_case(0), figures=("mu", "step"))
    first = write_report(study, tmp_path / "first").parent
    second = write_report(study, tmp_path / "second").parent
    files = sorted(path.relative_to(first) for path in first.rglob("*") if path.is_file())
    assert files == sorted(path.relative_to(second) for path in second.rglob("*") if path.is_file())
    assert len(files) == 9
    assert all((first / name).read_bytes() == (second / name).read_bytes() for name in files)


def test_hostile_names_stay_text(make_case: MakeCase, make_study: MakeStudy, tmp_path: Path) -> None:
    """Names, sentences and texts of a results file cannot become tags, formulas, paths or picture commands."""
    evil = "<script>alert(1)</script> $x_{$ --> ' \" &amp; 字"
    stored = {"method": "stored", "name": evil}
    case = replace(make_case(0, controller=stored, steps=False, sentence=evil), case_id="../../<b>")
    other = make_case(1, controller={"method": "stored", "name": "=1+1"}, status=Status.FAILED, sentence=evil)
    study = replace(
        make_study(case, other, figures=("controller_gain",)), name=evil, study_text=evil, provenance={evil: evil}
    )
    page = write_report(study, tmp_path / "report").read_text(encoding="utf-8")
    tags = [tag for tag, _ in outline(page).tags]
    assert tags.count("script") == page.count("<script") == 1
    assert "b" not in tags
    assert sorted(path.name for path in tmp_path.iterdir()) == ["report"]
    names = sorted(path.name for path in (tmp_path / "report" / "figures").glob("*.svg"))
    assert names == ["controller_gain-_______b_.svg", "trade_off-_______b_.svg"]
    assert all(b"<script" not in path.read_bytes() for path in (tmp_path / "report").rglob("*.svg"))


@pytest.mark.parametrize(
    "figures", [(), ("mu", "sensitivity", "nyquist", "controller_gain", "step", "poles", "limitation")]
)
def test_a_study_without_answers_has_a_report(
    make_case: MakeCase, make_study: MakeStudy, tmp_path: Path, figures: tuple[str, ...]
) -> None:
    """No case at all, and only failed cases, give a page that says so."""
    empty = write_report(make_study(figures=figures), tmp_path / "empty").read_text(encoding="utf-8")
    assert "no cases yet" in empty
    failed = make_case(0, status=Status.FAILED, sentence="the numbers were bad", curves=False)
    page = write_report(make_study(failed, figures=figures), tmp_path / "failed").read_text(encoding="utf-8")
    assert "the numbers were bad" in page
    assert f"--case {failed.case_id} --debug" in page
    assert not (tmp_path / "failed" / "figures").exists()


def test_numbers_that_are_none_are_drawn_as_gaps(make_case: MakeCase, make_study: MakeStudy, tmp_path: Path) -> None:
    """Curves with NaN and infinity, or of nothing else, still give figures and a page."""
    case = make_case(0)
    assert case.frequency is not None
    assert case.poles is not None
    nothing = np.full_like(case.frequency.mu_upper, np.nan)
    wild = case.frequency.worst_case.copy()
    wild[::7] = np.inf
    frequency = replace(
        case.frequency,
        mu_upper=nothing,
        mu_lower=nothing,
        worst_case=wild,
        sensitivity=case.frequency.sensitivity * np.nan,
        controller_a_per_m=case.frequency.controller_a_per_m * np.nan,
    )
    step = replace(case.steps[0], position_m=case.steps[0].position_m * np.nan, end="not_finite", settling_time_s=None)
    broken = replace(
        case, frequency=frequency, poles=replace(case.poles, poles_rad_s=case.poles.poles_rad_s * np.nan), steps=(step,)
    )
    study = make_study(broken, figures=("mu", "sensitivity", "nyquist", "controller_gain", "step", "poles"))
    page = write_report(study, tmp_path)
    assert "is not finite" in page.read_text(encoding="utf-8")
    assert len(list((tmp_path / "figures").glob("*.svg"))) == 5


def test_sixty_cases_fit_one_page(make_case: MakeCase, make_study: MakeStudy, tmp_path: Path) -> None:
    """A sweep of sixty cases lists every case, and the page stays far below ten megabytes."""
    cases = [
        make_case(10 * mass + limit, mass_kg=(3.0, 3.5 + mass), omega_c_rad_s=5000.0 * 1.3**limit, steps=False)
        for mass in range(6)
        for limit in range(10)
    ]
    page = write_report(make_study(*cases, figures=("limitation",)), tmp_path)
    assert page.read_text(encoding="utf-8").count("data-case=") == 60
    assert page.stat().st_size < 500_000


def test_a_figure_weighs_little_in_the_page(mixed_report: Path) -> None:
    """A figure takes so few bytes of the page that those of 24 cases stay below ten megabytes."""
    figures = len(list((mixed_report / "figures").glob("*.svg")))
    assert (mixed_report / "index.html").stat().st_size / figures < 10e6 / (24 * 4.5)


def test_figures_of_an_earlier_report_go_and_other_files_stay(
    make_case: MakeCase, make_study: MakeStudy, tmp_path: Path
) -> None:
    """A report in a used directory leaves no figure of the old one, and touches nothing it did not write."""
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "mu-0123.svg").write_text("old")
    (tmp_path / "figures" / "mine.svg").write_text("kept")
    told: list[str] = []
    write_report(make_study(make_case(0, steps=False), figures=("poles",)), tmp_path, progress=told.append)
    assert sorted(path.name for path in (tmp_path / "figures").glob("*.svg")) == ["mine.svg", f"{told[0]}.svg"]
    assert told == ["poles-0000000000000000"]


def test_a_refused_file_is_a_sentence(make_study: MakeStudy, tmp_path: Path) -> None:
    """Where the system refuses to write, the report ends with a sentence that names the place."""
    blocked = tmp_path / "blocked"
    blocked.write_text("a file")
    with pytest.raises(ResumableError, match=r"blocked.*could not be written"):
        write_report(make_study(), blocked)


def test_long_names_stay_inside_the_figures(make_case: MakeCase, make_study: MakeStudy, tmp_path: Path) -> None:
    """Names of any length are broken into lines; no curve's name leaves the picture."""
    names = ["a controller of a very long name " * 3, "x" * 200]
    cases = [
        make_case(index, controller={"method": "stored", "source": name}, omega_c_rad_s=limit, steps=False)
        for index, (name, limit) in enumerate((name, limit) for name in names for limit in (1e4, 2e4))
    ]
    page = write_report(make_study(*cases, figures=("limitation",)), tmp_path)
    assert page.is_file()
    assert len(list((tmp_path / "figures").glob("*.svg"))) == 3

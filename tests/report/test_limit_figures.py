"""The limitation page: brackets over whatever is swept, the thesis's points, current, and what few states lose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from magbear_cli.errors import Status
from magbear_cli.report.canvas import house_style
from magbear_cli.report.least_current_figure import least_current_drawing
from magbear_cli.report.limit_curves import brackets, limit_curves, thesis_points
from magbear_cli.report.limits_figure import limits_drawing
from magbear_cli.report.orders_figure import orders_drawing
from magbear_cli.report.series import Labels
from magbear_cli.report.verdict import remarks
from magbear_cli.report.writing import write_report
from magbear_cli.study.outcome import CaseOutcome, StudyResults

MakeCase = Callable[..., CaseOutcome]
MakeStudy = Callable[..., StudyResults]
Bracket = Callable[..., CaseOutcome]


@pytest.fixture
def bracket(make_case: MakeCase) -> Bracket:
    """A function from a mass range, both sides and further inputs to a bracketed limit."""

    def make(
        index: int, masses: tuple[float, float], sides: tuple[float | None, float | None], **more: dict[str, Any]
    ) -> CaseOutcome:
        case = make_case(index, mass_kg=masses, omega_c_rad_s=None, controller={"method": "limit"}, steps=False)
        inputs = dict(case.inputs)
        inputs["bearing"] = {**inputs["bearing"], "current_law": "full", **more.get("bearing", {})}
        inputs["performance"] = more.get("performance", inputs["performance"])
        inputs["operating_point"] = {"position_m": 0.0, "current_a": 0.0}
        low, high = sides
        summary = replace(case.summary, omega_c_infeasible_rad_s=low, omega_c_feasible_rad_s=high, order=14)
        return replace(case, inputs=inputs, summary=summary, frequency=None)

    return make


@pytest.fixture
def thesis_curve(bracket: Bracket) -> tuple[CaseOutcome, ...]:
    """One known mass and two ranges above it."""
    sides = [(4328.0, 4367.0), (4585.0, 4626.0), (5045.0, 5091.0)]
    masses = [(3.0, 3.0), (3.0, 3.5), (3.0, 4.5)]
    return tuple(bracket(index, *pair) for index, pair in enumerate(zip(masses, sides, strict=True)))


def test_the_mass_is_the_axis_where_it_alone_varies(thesis_curve: tuple[CaseOutcome, ...]) -> None:
    """Ranges above one lightest rotor are drawn over their width, others over the ratio of their ends."""
    curves = limit_curves(thesis_curve)
    assert curves.curves[0].values == (0.0, 0.5, 1.5)
    assert "m_Δ above 3 kg" in curves.axis


def test_other_keys_are_axes_and_labels(bracket: Bracket) -> None:
    """Where a corner of W1 is swept beside two mass ranges, it is the axis, and the ranges name the curves."""
    cases = [
        bracket(10 * number + index, masses, (4e3, 4.04e3), performance={"num": [10.0 * corner], "den": [1.0, corner]})
        for number, masses in enumerate([(3.0, 3.5), (2.2, 4.5)])
        for index, corner in enumerate([100.0, 200.0, 400.0])
    ]
    curves = limit_curves(cases)
    assert curves.quantity == "corner_rad_s"
    assert [curve.label for curve in curves.curves] == ["3–3.5 kg", "2.2–4.5 kg"]
    assert curves.curves[1].values == (100.0, 200.0, 400.0)
    mixed = limit_curves([case for case in cases if case.inputs["performance"]["den"][1] == 100.0])
    assert mixed.axis == "heaviest over lightest rotor of the range"


def test_the_thesis_stands_beside_its_own_bearing_only(bracket: Bracket) -> None:
    """Its four points are drawn for its constants and weight, and for no other gap or weight."""
    own = bracket(0, (3.0, 4.5), (5045.0, 5091.0))
    assert [(point.omega_c_rad_s, point.met) for point in thesis_points(own)] == [
        (7000.0, True),
        (10_000.0, True),
        (20_000.0, True),
        (10_000.0, False),
    ]
    assert thesis_points(bracket(1, (3.0, 4.5), (1.0, 2.0), bearing={"air_gap_m": 5e-4})) == []
    assert thesis_points(bracket(2, (3.0, 4.5), (1.0, 2.0), performance={"num": [1e3], "den": [1.0, 200.0]})) == []


def test_the_figure_holds_both_sides(thesis_curve: tuple[CaseOutcome, ...]) -> None:
    """Its numbers are those of the cases, its words name both sides, and a study without limits has none."""
    with house_style():
        drawing = limits_drawing(thesis_curve)
    assert drawing is not None
    assert drawing.columns["omega_c_infeasible_rad_s"] == [4328.0, 4585.0, 5045.0]
    assert drawing.columns["omega_c_feasible_rad_s"] == [4367.0, 4626.0, 5091.0]
    assert "3–4.5 kg: impossible up to 5045, met from 5091 rad/s" in drawing.alt
    assert "thesis" in drawing.caption
    assert limits_drawing(()) is None


@pytest.mark.parametrize("sides", [(None, 5091.0), (5045.0, None)])
def test_a_missing_side_is_left_out(bracket: Bracket, sides: tuple[float | None, float | None]) -> None:
    """One side alone is drawn and told as it is; no side at all is no bracket."""
    case = bracket(0, (3.0, 4.5), sides)
    assert brackets([case, bracket(1, (3.0, 4.0), (None, None))]) == [case]
    with house_style():
        drawing = limits_drawing((case,))
    assert drawing is not None
    assert "–" in drawing.alt


def test_the_page_says_what_is_proven(
    thesis_curve: tuple[CaseOutcome, ...], make_study: MakeStudy, tmp_path: Path
) -> None:
    """The verdict names both sides of each bracket; the figure is on the page in all its forms."""
    study = make_study(*thesis_curve, figures=("limits",))
    told = " ".join(remarks(study, Labels(study.outcomes)))
    assert (
        "3–4.5 kg: no linear controller meets ω_c = 5045 rad/s, and one with 14 states meets 5091 rad/s; proven."
        in told
    )
    page = write_report(study, tmp_path).read_text("utf-8")
    assert "Where linear control ends" in page
    assert "5045 … 5091" in page
    assert sorted(path.name for path in (tmp_path / "figures").iterdir()) == ["limits.pdf", "limits.png", "limits.svg"]


def test_least_current_is_drawn_over_the_mass(make_case: MakeCase) -> None:
    """Two ranges with the least peak of |K S| make a curve in A per 10 µm; one alone makes none."""
    wish = {"method": "fixed_order", "order": 3, "minimise": "ks_peak"}
    cases = []
    for index, (high, peak) in enumerate([(3.5, 5.4e5), (4.5, 7e5)]):
        case = make_case(index, mass_kg=(3.0, high), omega_c_rad_s=None, controller=wish, steps=False)
        inputs = {**case.inputs, "operating_point": {"position_m": 0.0, "current_a": 0.0}}
        cases.append(replace(case, inputs=inputs, summary=replace(case.summary, peak_ks_a_per_m=peak)))
    with house_style():
        drawing = least_current_drawing(tuple(cases))
    assert drawing is not None
    assert "5.40 A" in drawing.alt
    assert "7.00 A" in drawing.alt
    assert least_current_drawing((cases[0],)) is None
    lost = replace(cases[1], status=Status.NOT_ACHIEVED)
    assert least_current_drawing((cases[0], lost)) is None


def test_what_few_states_lose_is_told_against_the_bound(make_case: MakeCase) -> None:
    """Three orders on two problems with proven bounds: the excess over the bound, best case of each order."""
    cases = []
    for number, omega_c in enumerate([1e4, 2e4]):
        for order, level in ((1, 0.42), (2, 0.41), (8, 0.404)):
            case = make_case(10 * number + order, omega_c_rad_s=omega_c, order=order, steps=False)
            bound = 0.4 if order == 8 else None
            cases.append(replace(case, summary=replace(case.summary, worst_case=level, lower_bound=bound)))
    labels = Labels(cases)
    with house_style():
        drawing = orders_drawing(tuple(cases), labels)
    assert drawing is not None
    assert drawing.columns["excess_percent"] == pytest.approx([5.0, 2.5, 1.0] * 2)
    assert "5 % with 1 state" in drawing.alt
    assert orders_drawing(tuple(cases[:3]), labels) is None
    without = tuple(replace(case, summary=replace(case.summary, lower_bound=None)) for case in cases)
    assert orders_drawing(without, labels) is None

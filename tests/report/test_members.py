"""Figures and tables name the members of a family by what they differ in, and never by an equivalent mass alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from matplotlib.text import Text

from magbear_cli.report.control_sensitivity_figure import control_sensitivity_drawing
from magbear_cli.report.drawing import Drawing
from magbear_cli.report.members import Members
from magbear_cli.report.mu_figure import mu_drawing
from magbear_cli.report.nyquist_figure import nyquist_drawing
from magbear_cli.report.poles_figure import poles_drawing
from magbear_cli.report.sensitivity_figure import sensitivity_drawing
from magbear_cli.report.series import Labels
from magbear_cli.report.tables import case_figures
from magbear_cli.spec import read_study_text
from magbear_cli.study.members import members_of
from magbear_cli.study.outcome import CaseOutcome
from magbear_cli.study.pipeline import run_case

Draw = Callable[[CaseOutcome, tuple[CaseOutcome, ...], Labels], Drawing | None]
OVER_MEMBERS: tuple[Draw, ...] = (poles_drawing, nyquist_drawing, sensitivity_drawing, control_sensitivity_drawing)
LEAD = {"method": "stored", "source": "the test", "a": [[-2e5]], "b": [[1.0]], "c": [[1.5e12]], "d": [[-7.6e6]]}
BASE = """\
magbear: 1
name: family
bearing: thesis_thrust
performance: {dc_gain: 10, corner_rad_s: 200}
bandwidth: {omega_c_rad_s: 20000}
controller: {method: lqg}
"""
K_I, K_Z = 50.0, 62_500.0


def _case(family: str) -> CaseOutcome:
    """The lead controller, judged for a family."""
    inputs = {**read_study_text(f"{BASE}{family}\n", "study.yaml").case(0), "controller": LEAD}
    return run_case(inputs, "0" * 16, 0)


@pytest.fixture(scope="module")
def stiffness() -> CaseOutcome:
    """An uncertain negative stiffness."""
    return _case("mass_kg: 3.6\nuncertain: {parameter: negative_stiffness, factor: [0.4, 1.6]}")


def _texts(drawing: Drawing) -> str:
    """All that a reader sees."""
    seen = [artist.get_text() for artist in drawing.figure.findobj(Text)]
    return "\n".join([*seen, drawing.title, drawing.caption, drawing.alt])


@pytest.mark.parametrize("draw", OVER_MEMBERS)
def test_figures_over_the_stiffness_state_mass_and_stiffness(draw: Draw, stiffness: CaseOutcome) -> None:
    """Legends, titles and the numbers behind have the rotor's mass and the ends of k_z."""
    drawing = draw(stiffness, (stiffness,), Labels([stiffness]))
    assert drawing is not None
    assert set(drawing.columns["mass_kg"]) == {3.6}
    values = np.array(drawing.columns["negative_stiffness_n_per_m"])
    assert [values.min(), values.max()] == pytest.approx([0.4 * K_Z, 1.6 * K_Z])
    text = _texts(drawing).replace("\u202f", "")
    assert "k_z = 25000" in text
    assert "k_z = 100000 N/m" in text
    assert "masses" not in text
    equivalent = [3.6 / 0.4, 3.6 / 1.6]
    assert not any(f"{mass:g} kg" in text for mass in equivalent)


def test_poles_are_those_of_the_member_beside_them(stiffness: CaseOutcome) -> None:
    """Each pole of the table is a root of (m s² − k_z)(s + p) − k_i K's numerator, with the mass and k_z of its row."""
    drawing = poles_drawing(stiffness, (stiffness,), Labels([stiffness]))
    assert drawing is not None
    rows = zip(*(drawing.columns[name] for name in ("mass_kg", "negative_stiffness_n_per_m")), strict=True)
    poles = np.array(drawing.columns["real_rad_s"]) + 1j * np.array(drawing.columns["imag_rad_s"])
    for (mass, k_z), pole in zip(rows, poles, strict=True):
        plant = K_I / (mass * pole**2 - k_z)
        controller = -7.6e6 + 1.5e12 / (pole + 2e5)
        assert plant * controller == pytest.approx(1.0, rel=1e-6)


def test_the_worst_member_is_named(stiffness: CaseOutcome) -> None:
    """The table of a case and the legend of mu say at which stiffness the worst case is."""
    rows = {name: value.replace("\u202f", "") for name, value in case_figures(stiffness)}
    assert rows["worst negative stiffness"] in {"k_z = 25000 N/m", "k_z = 100000 N/m"}
    assert "worst mass" not in rows
    drawing = mu_drawing(stiffness, (stiffness,), Labels([stiffness]))
    assert drawing is not None
    text = _texts(drawing).replace("\u202f", "")
    assert "worst real negative stiffness of 3.6 kg, negative stiffness × 0.4 to 1.6" in text
    assert rows["worst negative stiffness"] in text


@pytest.mark.parametrize(
    ("family", "name", "span", "columns"),
    [
        ("mass_kg: [3.0, 4.5]", "3 kg", "3–4.5 kg", {"mass_kg": [3.0]}),
        (
            "mass_kg: 3.6\nuncertain: {parameter: force_constant, factor: [0.8, 1.2]}",
            "k₀ × 1.2",
            "k₀ × 0.8–1.2",
            {"mass_kg": [3.6], "force_constant_factor": [pytest.approx(1.2)]},
        ),
        (
            "mass_kg: 3.6\nuncertain: {current_stiffness: [0.8, 1.2]}",
            "k_i = 60 N/A",
            "k_i = 40–60 N/A",
            {"mass_kg": [3.6], "current_stiffness_n_per_a": [pytest.approx(60.0)]},
        ),
        (
            "mass_kg: [3.0, 4.5]\nuncertain: {current_stiffness: [0.8, 1.2]}",
            "3 kg, k_i = 60 N/A",
            "3 kg, k_i = 60 N/A to 4.5 kg, k_i = 40 N/A",
            {
                "mass_kg": [3.0],
                "negative_stiffness_n_per_m": [pytest.approx(62_500.0)],
                "current_stiffness_n_per_a": [pytest.approx(60.0)],
            },
        ),
    ],
)
def test_every_family_has_its_names(family: str, name: str, span: str, columns: dict[str, list[object]]) -> None:
    """The first member of each, the whole of it, and its columns."""
    outcome = _case(family)
    assert outcome.poles is not None
    plants, members = members_of(outcome.poles), Members(outcome)
    assert members.name(plants[0]) == name
    assert members.span(plants) == span
    assert members.columns(plants[0], 1) == columns

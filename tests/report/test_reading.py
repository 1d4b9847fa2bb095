"""What the page tells a script about the panels of its figures."""

from __future__ import annotations

import json
from collections.abc import Callable

import pytest

from magbear_cli.report.canvas import house_style, rendered
from magbear_cli.report.mu_figure import mu_drawing
from magbear_cli.report.poles_figure import poles_drawing
from magbear_cli.report.reading import panels_document
from magbear_cli.report.series import Labels
from magbear_cli.report.step_figure import step_drawings
from magbear_cli.study.outcome import CaseOutcome

MakeCase = Callable[..., CaseOutcome]


def test_panels_are_where_the_axes_are(make_case: MakeCase) -> None:
    """Each panel lies inside the figure, has the ends of its axes, and the label that stands at its row or column."""
    case = make_case(0)
    with house_style():
        drawing = mu_drawing(case, (case,), Labels((case,)))
        assert drawing is not None
        rendered(drawing.figure, "svg")
        ((left, bottom, right, top, *axes),) = json.loads(panels_document(drawing.figure))
        assert 0.0 < left < right < 1.0
        assert 0.0 < bottom < top < 1.0
        assert axes[:2] == pytest.approx(drawing.figure.axes[0].get_xlim())
        assert axes[2:4] == [1, "frequency ω (rad/s)"]
        assert axes[6] == 0
        (steps,) = step_drawings(case, (case,), Labels((case,)))
        rendered(steps.figure, "svg")
        panels = json.loads(panels_document(steps.figure))
        assert len(panels) == 4
        assert {panel[11] for panel in panels} == {"position (µm)", "control current (A)"}


def test_what_cannot_be_read_is_left_out(make_case: MakeCase) -> None:
    """The pole map is neither linear nor logarithmic, and its bar of colours is no panel."""
    case = make_case(0)
    with house_style():
        drawing = poles_drawing(case, (case,), Labels((case,)))
        assert drawing is not None
        rendered(drawing.figure, "svg")
        assert json.loads(panels_document(drawing.figure)) == []

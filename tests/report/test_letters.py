"""Fonts inside PDF files are complete for who looks at them, and no larger."""

from __future__ import annotations

import io
import re
import zlib

import pytest
from fontTools.subset import Options
from fontTools.ttLib import TTFont
from matplotlib.figure import Figure

from magbear_cli.report.canvas import house_style, new_figure, rendered
from magbear_cli.report.letters import LAYOUT_TABLES, plain_letters


def _labelled() -> Figure:
    figure = new_figure(1.0)
    figure.text(0.1, 0.5, "µ ≤ 1, |W₁S| ‖ $\\omega_c$ office")
    return figure


def test_a_pdf_embeds_outlines_and_widths_alone() -> None:
    """Every font of a PDF has its glyphs and none of the tables that lay text out."""
    with house_style():
        content = rendered(_labelled(), "pdf")
    fonts = [
        TTFont(io.BytesIO(zlib.decompress(stream)))
        for length, stream in re.findall(rb"/Length1 (\d+).*?stream\r?\n(.*?)\r?\nendstream", content, re.DOTALL)
        if length
    ]
    assert fonts
    for font in fonts:
        assert {"glyf", "hmtx", "loca"} <= set(font.keys())
        assert not set(LAYOUT_TABLES) & set(font.keys())


def test_the_defaults_of_font_tools_come_back() -> None:
    """Whoever cuts fonts beside us finds the defaults as they were, also after an error."""
    before = Options().drop_tables
    with plain_letters():
        assert set(LAYOUT_TABLES) <= set(Options().drop_tables)
    with pytest.raises(ZeroDivisionError), plain_letters():
        _ = 1 / 0
    assert Options().drop_tables == before


def test_a_version_without_those_defaults_draws_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where fontTools has no such list, the figure is drawn with whole fonts."""
    monkeypatch.setattr("magbear_cli.report.letters.DEFAULTS", "absent")
    with house_style():
        assert rendered(_labelled(), "pdf").startswith(b"%PDF")

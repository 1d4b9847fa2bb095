"""Fonts inside PDF files, without what lays letters out: matplotlib has laid them out already."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from fontTools.subset import Options

LAYOUT_TABLES = ("GSUB", "GPOS", "GDEF", "kern")
DEFAULTS = "_drop_tables_default"  # of fontTools, which has no official way to change them


@contextmanager
def plain_letters() -> Iterator[None]:
    """Embed outlines and widths alone.

    matplotlib cuts a font down for each PDF, with its tables for ligatures, kerning and marks, to which no reader of a
    PDF looks: it is told where every glyph goes. Cutting these tables takes a fifth of the time of a figure and makes
    the file larger. Where a version of fontTools has other defaults, drawing takes longer and is as right.
    """
    before = getattr(Options, DEFAULTS, None)
    if not isinstance(before, list):
        yield
        return
    setattr(Options, DEFAULTS, [*before, *LAYOUT_TABLES])
    try:
        yield
    finally:
        setattr(Options, DEFAULTS, before)

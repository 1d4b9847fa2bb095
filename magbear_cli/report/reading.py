"""Where the panels of a figure are and what their axes say, so that a reader can take a value off a curve."""

from __future__ import annotations

import json
import re

from matplotlib.axes import Axes
from matplotlib.figure import Figure

_SCALES = ("linear", "log")
_SAME = 1e-6  # of the figure: panels that begin here stand in one column, or in one row


def panels_document(figure: Figure) -> str:
    """The panels of a drawn figure as JSON, a list each.

    Left, bottom, right and top as parts of the figure; for x and y the two ends, whether it is logarithmic, and the
    label, which is empty for an axis of names. Panels with another scale, and the bars of colours, cannot be read and
    are left out.
    """
    panels = [axes for axes in figure.axes if axes.get_xscale() in _SCALES and axes.get_yscale() in _SCALES]
    readable = [axes for axes in panels if axes.get_label() != "<colorbar>"]
    return json.dumps([_panel(axes, readable) for axes in readable], ensure_ascii=False, separators=(",", ":"))


def _panel(axes: Axes, panels: list[Axes]) -> list[object]:
    box = axes.get_position()
    column = [other.get_xlabel() for other in panels if abs(other.get_position().x0 - box.x0) < _SAME]
    row = [other.get_ylabel() for other in panels if abs(other.get_position().y0 - box.y0) < _SAME]
    places = [round(float(part), 5) for part in (box.x0, box.y0, box.x1, box.y1)]
    ends = [[float(f"{float(end):.9g}") for end in limits] for limits in (axes.get_xlim(), axes.get_ylim())]
    return [
        *places,
        *ends[0], int(axes.get_xscale() == "log"), _plain(axes.get_xlabel() or next(filter(None, column), "")),
        *ends[1], int(axes.get_yscale() == "log"), _plain(axes.get_ylabel() or next(filter(None, row), "")),
    ]  # fmt: skip


def _plain(label: str) -> str:
    """A label without the marks of a formula."""
    return re.sub(r"[${}\\]", "", label).replace("omega", "ω").replace("Delta", "Δ").replace("\n", " ")

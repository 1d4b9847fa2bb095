"""The paper the figures are drawn on: size, type, colours and lines, and their bytes as SVG, PNG and PDF.

Nothing of the user's matplotlib settings, of the clock or of the fonts of the system enters: the same study gives the
same bytes. Colours are told apart without hue (tableau-colorblind10, reordered by lightness) and each has a line style.
"""

from __future__ import annotations

import io
import textwrap
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axes._secondary_axes import SecondaryAxis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.markers import TICKDOWN
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter
from numpy.typing import ArrayLike, NDArray

from magbear_cli.report.letters import plain_letters
from magbear_cli.report.numbers import SUPERSCRIPTS
from magbear_cli.report.reading import panels_document

Floats = NDArray[np.float64]

WIDTH_IN = 7.2  # two columns of a paper
PNG_DPI = 160
MOST_MARKED_DECADES = 7
INK, SOFT, FAINT = "#1f2328", "#57606a", "#d0d7de"
BLUE, RUST, GREY, SKY, PURPLE, BROWN = "#006ba4", "#c85200", "#595959", "#5f9ed1", "#832db6", "#8c564b"
COLOURS = (BLUE, RUST, GREY, PURPLE, SKY, BROWN)
DASHES: tuple[Any, ...] = ("-", (0, (5, 1.6)), (0, (4, 1.4, 1, 1.4)), (0, (1.2, 1.2)), (0, (7, 1.4, 1, 1.4, 1, 1.4)))
MARKERS = ("o", "s", "^", "D", "P", "v")
LEVEL: dict[str, Any] = {"color": INK, "linewidth": 0.9, "linestyle": (0, (1, 1.5))}
NOTE: dict[str, Any] = {"fontsize": 7.5, "color": INK}
PAPER: dict[str, Any] = {"boxstyle": "round,pad=0.25", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}

_STYLE: dict[str, object] = {
    "font.family": ["DejaVu Sans"],
    "font.size": 8.0,
    "axes.titlesize": 9.0,
    "axes.titlelocation": "left",
    "axes.titlepad": 6.0,
    "axes.labelsize": 8.0,
    "axes.edgecolor": SOFT,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e3e7eb",
    "grid.linewidth": 0.6,
    "text.color": INK,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "xtick.direction": "out",
    "ytick.direction": "out",
    "xtick.major.size": 3.0,
    "ytick.major.size": 3.0,
    "xtick.minor.size": 1.6,
    "ytick.minor.size": 1.6,
    "lines.linewidth": 1.5,
    "lines.solid_capstyle": "round",
    "legend.fontsize": 7.5,
    "legend.frameon": True,
    "legend.framealpha": 0.9,
    "legend.edgecolor": "none",
    "legend.borderpad": 0.3,
    "legend.handlelength": 2.4,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.fonttype": "path",
    "svg.hashsalt": "magbear",
    "pdf.fonttype": 42,
    "pdf.compression": 9,
    "path.simplify": True,
    "path.simplify_threshold": 0.2,
    "axes.unicode_minus": True,
}
_METADATA: dict[str, dict[str, None]] = {
    "svg": {"Date": None, "Creator": None, "Format": None, "Type": None},
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


@dataclass(frozen=True)
class Pen:
    """How one curve of several is told from the others, in colour and in grey."""

    color: str
    linestyle: Any  # a name or a pattern of matplotlib
    marker: str


def pen(index: int) -> Pen:
    """The pen of the curve with this place in its figure."""
    return Pen(COLOURS[index % len(COLOURS)], DASHES[index % len(DASHES)], MARKERS[index % len(MARKERS)])


@contextmanager
def house_style() -> Iterator[None]:
    """Draw with the settings of this module alone, and leave matplotlib as it was."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        yield


def new_figure(height_in: float, width_in: float = WIDTH_IN) -> Figure:
    """An empty figure with a canvas of its own."""
    figure = Figure(figsize=(width_in, height_in))
    FigureCanvasAgg(figure)
    return figure


def panels(figure: Figure, columns: int, *, rows: int = 1, hertz: bool = False, **spacing: float) -> list[list[Axes]]:
    """A grid of axes, with room for a title and, above it, for a second frequency axis; margins in inches."""
    width, height = (float(size) for size in figure.get_size_inches())
    top = (0.62 if hertz else 0.3) + spacing.get("above", 0.0)
    below = spacing.get("below", 0.0)
    grid = figure.add_gridspec(
        rows,
        columns,
        left=spacing.get("left", 0.68) / width,
        right=1.0 - spacing.get("right", 0.15) / width,
        bottom=(0.45 + below) / height,
        top=1.0 - top / height,
        wspace=spacing.get("wspace", 0.22),
        hspace=spacing.get("hspace", 0.18),
    )
    return [[figure.add_subplot(grid[row, column]) for column in range(columns)] for row in range(rows)]


def frequency_axis(axes: Axes, view: tuple[float, float], *, label: bool = True, hertz: bool = True) -> None:
    """A logarithmic axis in rad/s over this view, with Hz along the top."""
    axes.set_xscale("log")
    axes.set_xlim(*view)
    decades = int(np.ceil(np.log10(view[1] / view[0])))
    _decade_ticks(axes, decades)
    if decades <= MOST_MARKED_DECADES:
        _mark_within_decades(axes, view)
    if label:
        axes.set_xlabel("frequency ω (rad/s)")
    else:
        axes.tick_params(labelbottom=False)
    if hertz:
        top = axes.secondary_xaxis("top", functions=(hertz_of, rad_s_of))
        _decade_ticks(top, decades)
        top.set_xlabel("frequency (Hz)", color=SOFT, labelpad=3.0)
        top.tick_params(labelcolor=SOFT)


def power_of_ten(value: float, _: int | None = None) -> str:
    """The label of a decade, as in ``10⁵``; set in plain letters, which is many times quicker than as a formula."""
    if value == 0:
        return "0"
    sign = "−" if value < 0 else ""
    return f"{sign}10{str(round(float(np.log10(abs(value))))).translate(SUPERSCRIPTS)}"


def hertz_of(omega_rad_s: ArrayLike) -> ArrayLike:
    """A frequency in Hz."""
    return np.asarray(omega_rad_s, dtype=float) / (2.0 * np.pi)


def rad_s_of(frequency_hz: ArrayLike) -> ArrayLike:
    """A frequency in rad/s."""
    return np.asarray(frequency_hz, dtype=float) * (2.0 * np.pi)


def _decade_ticks(axes: Axes | SecondaryAxis, decades: int) -> None:
    axis = axes.xaxis
    axis.set_major_locator(LogLocator(10.0, numticks=max(3, min(decades + 2, 8))))
    axis.set_minor_locator(FixedLocator([]))
    axis.set_minor_formatter(NullFormatter())
    axis.set_major_formatter(FuncFormatter(power_of_ten))


def _mark_within_decades(axes: Axes, view: tuple[float, float]) -> None:
    """Minor ticks as one curve of marks: matplotlib's own are five objects each, and took a quarter of a figure."""
    first, last = (int(np.floor(np.log10(end))) for end in view)
    marks = np.array([digit * 10.0**decade for decade in range(first, last + 1) for digit in range(2, 10)])
    marks = marks[(marks >= view[0]) & (marks <= view[1])]
    axes.add_artist(
        Line2D(
            marks,
            np.zeros_like(marks),
            transform=axes.get_xaxis_transform(),
            linestyle="none",
            marker=TICKDOWN,
            markersize=mpl.rcParams["xtick.minor.size"],
            markeredgewidth=mpl.rcParams["xtick.minor.width"],
            color=mpl.rcParams["xtick.color"],
            clip_on=False,
            zorder=2.01,  # that of ticks
        )
    )


def panel_title(axes: Axes, text: str, *, hertz: bool = False) -> None:
    """The title of a panel, at its left, clear of the axis in Hz."""
    axes.set_title(text, y=1.0, pad=31.0 if hertz else 6.0)


def plain(text: str, width: int) -> str:
    """Text of a study for a figure: no formula in it but ω_c, and lines no longer than this."""
    return textwrap.fill(text, width).replace("$", r"\$").replace("ω_c", r"$\omega_c$")


def legend_below(figure: Figure, handles: Sequence[Artist], names: Sequence[str], columns: int | None = None) -> None:
    """A legend in one row, or in columns, at the foot of the figure, where no curve can be under it."""
    figure.legend(
        handles,
        names,
        loc="lower center",
        bbox_to_anchor=(0.5, 0.0),
        ncols=columns or max(1, len(names)),
        columnspacing=1.8,
    )


def note(axes: Axes, text: str, corner: str = "upper right") -> None:
    """A remark in a corner of a panel."""
    vertical, horizontal = corner.split()
    x, y = {"left": 0.02, "right": 0.98}[horizontal], {"upper": 0.97, "lower": 0.03}[vertical]
    vertical_anchor = {"upper": "top", "lower": "bottom"}[vertical]
    axes.text(x, y, text, transform=axes.transAxes, ha=horizontal, va=vertical_anchor, bbox=PAPER, zorder=6, **NOTE)


def point_label(axes: Axes, at: tuple[float, float], text: str, *, below: bool = False) -> None:
    """A ring around a point of a curve, and a remark that leans away from the nearer side of the panel."""
    axes.plot(*at, marker="o", markersize=4.5, markerfacecolor="white", markeredgecolor=INK, linestyle="none", zorder=5)
    across = axes.transAxes.inverted().transform(axes.transData.transform(at))[0]
    side = "left" if across < 0.35 else "right" if across > 0.65 else "center"
    shift = {"left": 4, "right": -4, "center": 0}[side]
    axes.annotate(
        text,
        at,
        xytext=(shift, -8 if below else 8),
        textcoords="offset points",
        ha=side,
        va="top" if below else "bottom",
        bbox=PAPER,
        zorder=6,
        **NOTE,
    )


def rendered(figure: Figure, kind: str) -> bytes:
    """The bytes of a figure as ``svg``, ``png`` or ``pdf``."""
    buffer = io.BytesIO()
    with warnings.catch_warnings(), plain_letters():
        # A name may hold letters that the font lacks: they become boxes, which is no reason to stop.
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        figure.savefig(buffer, format=kind, dpi=PNG_DPI if kind == "png" else 72, metadata=_METADATA[kind])
    content = buffer.getvalue()
    if kind == "svg":  # where the panels are goes with the picture, so that a page can tell values where the pointer is
        content = content.replace(b"<svg ", f'<svg data-panels="{escape(panels_document(figure))}" '.encode(), 1)
    return content


def decibel(magnitude: Floats) -> Floats:
    """20 log10 of a magnitude; NaN where it is zero or not finite."""
    sound = np.isfinite(magnitude) & (magnitude > 0)
    return 20.0 * np.log10(np.where(sound, magnitude, np.nan))

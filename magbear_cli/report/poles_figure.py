"""The closed-loop poles over the range of the mass, or of what else is uncertain, coloured by it."""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.ticker import FixedLocator, FuncFormatter
from numpy.typing import NDArray

from magbear_cli.report.canvas import INK, RUST, new_figure, panel_title, panels, power_of_ten
from magbear_cli.report.drawing import Drawing, stacked
from magbear_cli.report.members import Members
from magbear_cli.report.numbers import significant
from magbear_cli.report.series import Labels, file_stem
from magbear_cli.study.members import members_of
from magbear_cli.study.outcome import CaseOutcome, Complexes, PoleStudy

Floats = NDArray[np.float64]

_MOST_DECADES = 6
_TICKS = 7


def poles_drawing(outcome: CaseOutcome, outcomes: tuple[CaseOutcome, ...], labels: Labels) -> Drawing | None:
    """The pole map of one case; None when it has no poles."""
    study = outcome.poles
    if study is None or not np.isfinite(study.poles_rad_s).any():
        return None
    figure = new_figure(3.3)
    axes = panels(figure, 1, right=0.2)[0][0]
    upper = study.poles_rad_s.imag >= 0
    _scale(axes, study.poles_rad_s[upper])
    members = Members(outcome)
    _draw(axes, study, upper, members)
    axes.set_xlabel("real part (rad/s)")
    axes.set_ylabel("imaginary part (rad/s)")
    largest = float(np.nanmax(study.poles_rad_s.real))
    return Drawing(
        name=f"poles-{file_stem(outcome, outcomes)}",
        title=f"Closed-loop poles over the {members.noun} range",
        caption=f"Poles of the upper half-plane for {members.plural} across the range; both axes are linear near zero "
        "and logarithmic beyond. The hatched side is unstable.",
        alt=f"Pole map for {labels.case(outcome)}: {study.poles_rad_s.shape[1]} poles for each of "
        f"{study.masses_kg.size} {members.plural}, largest real part {significant(largest)} rad/s.",
        figure=figure,
        columns=_columns(study, members),
        case_id=outcome.case_id,
    )


def _scale(axes: Axes, poles: Complexes) -> None:
    """Symmetric logarithmic axes from the smallest part that matters to the largest."""
    finite = poles[np.isfinite(poles)]
    real, imaginary = np.abs(finite.real), finite.imag
    x_linear, x_decades = _linear_part(real)
    y_linear, y_decades = _linear_part(imaginary)
    axes.set_xscale("symlog", linthresh=x_linear, linscale=0.6)
    axes.set_yscale("symlog", linthresh=y_linear, linscale=0.6)
    unstable = bool((finite.real > 0).any())
    axes.set_xlim(-3.0 * 10.0 ** x_decades[-1], 3.0 * 10.0 ** x_decades[-1] if unstable else 0.5 * x_linear)
    axes.set_ylim(-0.25 * y_linear, 3.0 * 10.0 ** y_decades[-1])
    axes.xaxis.set_major_locator(FixedLocator(_ticks(x_decades, both=True)))
    axes.yaxis.set_major_locator(FixedLocator(_ticks(y_decades, both=False)))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(power_of_ten))
        axis.set_minor_locator(FixedLocator([]))


def _linear_part(sizes: Floats) -> tuple[float, list[int]]:
    """The size below which the axis is linear, and the decades beyond it."""
    positive = sizes[np.isfinite(sizes) & (sizes > 0)]
    if not positive.size:
        return 1.0, [0, 1]
    last = int(np.ceil(np.log10(float(positive.max()))))
    first = max(int(np.floor(np.log10(float(positive.min())))), last - _MOST_DECADES)
    first = min(first, last - 1)
    return 10.0**first, list(range(first, last + 1))


def _ticks(decades: list[int], *, both: bool) -> list[float]:
    stride = int(np.ceil(len(decades) / _TICKS))
    sizes = [10.0**power for power in decades[::-1][::stride]]
    return sorted([0.0, *sizes, *([-size for size in sizes] if both else [])])


def _draw(axes: Axes, study: PoleStudy, upper: NDArray[np.bool_], members: Members) -> None:
    axes.axvspan(0.0, 1e30, facecolor="#f3e3da", edgecolor=RUST, hatch="///", linewidth=0.0, alpha=0.6, zorder=0)
    axes.axvline(0.0, color=INK, linewidth=0.9)
    own = members.values(members_of(study))
    values = np.broadcast_to(own[:, None], study.poles_rad_s.shape)[upper]
    poles = study.poles_rad_s[upper]
    low, high = float(own.min()), float(own.max())
    ends = {float(value): members.name(one) for value, one in zip(own, members_of(study), strict=True)}
    colours = ListedColormap(colormaps["cividis"](np.linspace(0.0, 0.75, 256)))
    norm = Normalize(low, high if high > low else low + 1.0)
    scatter = axes.scatter(
        poles.real, poles.imag, c=values, cmap=colours, norm=norm, s=9, linewidths=0, zorder=3, clip_on=True
    )
    for value, marker in {low: "o", high: "^"}.items():
        at = values == value
        axes.scatter(
            poles.real[at],
            poles.imag[at],
            marker=marker,
            s=30,
            facecolors="white",
            zorder=4,
            linewidths=1.0,
            edgecolors=[colours(norm(value))],
            label=ends[value],
        )
    if high > low:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.1, columnspacing=1.2)
    if high > low:
        bar = axes.figure.colorbar(scatter, ax=axes, pad=0.015, fraction=0.05, aspect=28)
        bar.set_label(members.axis)
        bar.outline.set_linewidth(0.5)
    largest = float(np.nanmax(study.poles_rad_s.real))
    family = f"over {members.span(members_of(study))}" if high > low else f"at {ends[low]}"
    panel_title(axes, f"Largest real part {significant(largest)} rad/s {family}")


def _columns(study: PoleStudy, members: Members) -> dict[str, list[object]]:
    return stacked(
        [
            {
                **members.columns(member, row.size),
                "real_rad_s": row.real.tolist(),
                "imag_rad_s": row.imag.tolist(),
            }
            for member, row in zip(members_of(study), study.poles_rad_s, strict=True)
        ]
    )

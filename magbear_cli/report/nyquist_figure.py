"""The Nyquist curves of the loop gain for the masses, with the template of the uncertain mass at chosen frequencies."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from numpy.typing import NDArray

from magbear_cli.report.canvas import BLUE, FAINT, INK, RUST, SOFT, legend_below, new_figure, note, panels, pen
from magbear_cli.report.drawing import Drawing, stacked
from magbear_cli.report.members import Members
from magbear_cli.report.numbers import significant, with_unit
from magbear_cli.report.series import Labels, file_stem
from magbear_cli.study.members import members_of
from magbear_cli.study.outcome import CaseOutcome, Complexes, FrequencyStudy

Floats = NDArray[np.float64]

_VIEW = (-3.6, 1.4, -1.9, 1.9)  # left, right, bottom, top
_TEMPLATES = 9
_SIZES = (0.12, 3.0)  # of the loop gain where templates are drawn
_NAMED = 3  # every so many templates


def nyquist_drawing(outcome: CaseOutcome, outcomes: tuple[CaseOutcome, ...], labels: Labels) -> Drawing | None:
    """The Nyquist curves of one case; None when it has no loop."""
    study = outcome.frequency
    if study is None or not study.omega_rad_s.size:
        return None
    gain = loop_gain(study)
    if not np.isfinite(gain).any():
        return None
    figure = new_figure(4.6)
    axes = panels(figure, 1, left=0.62, below=0.3)[0][0]
    distance = float(np.nanmin(np.abs(1.0 + gain)))
    _draw_plane(axes, distance)
    members = Members(outcome)
    _draw_curves(axes, study, gain, members)
    count = _draw_templates(axes, study, gain, members)
    note(axes, f"no curve comes nearer to −1 than {significant(distance)}", "upper left")
    handles, names = axes.get_legend_handles_labels()
    legend_below(figure, handles, names)
    templates = (
        f" Short bars are templates: all loop gains that the {members.plural} of the range have at one frequency, "
        "part of a ray; the disc over each is what complex blocks take it for."
        if count
        else ""
    )
    return Drawing(
        name=f"nyquist-{file_stem(outcome, outcomes)}",
        title=f"Nyquist curves with the uncertainty of the {members.noun}",
        caption="The loop gain L = −K G for ω > 0 and, thin, its mirror image. The plant has one unstable pole, so "
        f"that the whole curve must go once around −1.{templates} The dashed circle about −1 is the largest that no "
        "curve enters; its radius is one over the peak of |S|.",
        alt=f"Nyquist curves for {labels.case(outcome)}: {gain.shape[0]} {members.plural}, {count} templates; no curve "
        f"comes nearer to the critical point than {significant(distance)}.",
        figure=figure,
        columns=_columns(study, gain, members),
        case_id=outcome.case_id,
    )


def loop_gain(study: FrequencyStudy) -> Complexes:
    """L = −K G = T/S for masses (rows) and frequencies (columns); NaN where S is zero."""
    sound = np.abs(study.sensitivity) > 0.0
    return np.where(sound, study.complementary_sensitivity / np.where(sound, study.sensitivity, 1.0), np.nan)


def _draw_plane(axes: Axes, distance: float) -> None:
    left, right, bottom, top = _VIEW
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel("real part")
    axes.set_ylabel("imaginary part")
    axes.axhline(0.0, color=SOFT, linewidth=0.6)
    axes.axvline(0.0, color=SOFT, linewidth=0.6)
    axes.add_patch(Circle((0.0, 0.0), 1.0, fill=False, edgecolor=FAINT, linewidth=0.9))
    if 0.0 < distance < 1.0 + 1e-9:
        edge = {"edgecolor": RUST, "linewidth": 0.9, "linestyle": (0, (5, 2))}
        axes.add_patch(Circle((-1.0, 0.0), distance, facecolor="#f9ede5", zorder=0.4, **edge))
    axes.plot(-1.0, 0.0, "+", color=INK, markersize=9, markeredgewidth=1.4, zorder=6)


def _draw_curves(axes: Axes, study: FrequencyStudy, gain: Complexes, members: Members) -> None:
    left, right, bottom, top = _VIEW
    for index, (member, row) in enumerate(zip(members_of(study), gain, strict=True)):
        near = (row.real > 2 * left) & (row.real < 2 * right) & (row.imag > 2 * bottom) & (row.imag < 2 * top)
        curve, style = np.where(near, row, np.nan), pen(index)
        axes.plot(curve.real, curve.imag, color=style.color, linestyle=style.linestyle, label=members.name(member))
        axes.plot(curve.real, -curve.imag, color=style.color, linewidth=0.5, alpha=0.6)


def _draw_templates(axes: Axes, study: FrequencyStudy, gain: Complexes, members: Members) -> int:
    """Bars from one end of the family to the other, the discs over them, and how many there are."""
    if study.masses_kg.size < 2:
        return 0
    low, high = gain[0], gain[-1]
    middle = 0.5 * (np.abs(low) + np.abs(high))
    # from where |L| is largest in the view on: below, the curve comes back to its value at rest
    rising = np.arange(middle.size) >= int(np.nanargmax(np.where(np.isfinite(middle), middle, -1.0)))
    usable = np.flatnonzero(rising & np.isfinite(middle) & (middle > _SIZES[0]) & (middle < _SIZES[1]))
    if not usable.size:
        return 0
    wanted = np.geomspace(middle[usable].max(), middle[usable].min(), _TEMPLATES)
    places = list(dict.fromkeys(int(usable[np.abs(middle[usable] - size).argmin()]) for size in wanted))
    for number, place in enumerate(places):
        ends = np.array([low[place], high[place]])
        centre, radius = ends.mean(), 0.5 * abs(ends[1] - ends[0])
        axes.add_patch(
            Circle((centre.real, centre.imag), radius, facecolor=BLUE, alpha=0.16, edgecolor="none", zorder=1.5)
        )
        label = f"template of the {members.noun}" if number == 0 else None
        axes.plot(ends.real, ends.imag, color=INK, linewidth=1.6, solid_capstyle="butt", label=label, zorder=4)
        if number % _NAMED == 0:
            outer = ends[int(np.abs(ends).argmax())]
            axes.annotate(
                with_unit(float(study.omega_rad_s[place]), "rad/s"),
                (outer.real, outer.imag),
                xytext=(-5, -5),
                textcoords="offset points",
                ha="right",
                va="top",
                fontsize=6.5,
                color=SOFT,
            )
    return len(places)


def _columns(study: FrequencyStudy, gain: Complexes, members: Members) -> dict[str, list[object]]:
    return stacked(
        [
            {
                **members.columns(member, row.size),
                "omega_rad_s": study.omega_rad_s.tolist(),
                "real_loop_gain": row.real.tolist(),
                "imag_loop_gain": row.imag.tolist(),
            }
            for member, row in zip(members_of(study), gain, strict=True)
        ]
    )

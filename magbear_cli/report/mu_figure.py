"""Both bounds of mu over frequency, with the worst real mass beside them and level 1 above."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from magbear_cli.report.canvas import (
    BLUE,
    LEVEL,
    RUST,
    frequency_axis,
    legend_below,
    new_figure,
    note,
    panels,
    point_label,
)
from magbear_cli.report.drawing import Drawing
from magbear_cli.report.members import Members
from magbear_cli.report.numbers import significant, with_unit
from magbear_cli.report.series import Labels, file_stem, frequency_view
from magbear_cli.report.thinning import thinned
from magbear_cli.study.members import worst_member
from magbear_cli.study.outcome import CaseOutcome, FrequencyStudy

Floats = NDArray[np.float64]

_LARGEST_LINEAR = 4.0  # beyond this the level 1 would be a line at the foot of the panel
_LARGEST_DRAWN, _SMALLEST_DRAWN = 1e4, 1e-3


def mu_drawing(outcome: CaseOutcome, outcomes: tuple[CaseOutcome, ...], labels: Labels) -> Drawing | None:
    """The figure of mu of one case; None when it has no curves."""
    study = outcome.frequency
    if study is None or not study.omega_rad_s.size:
        return None
    figure = new_figure(3.1)
    axes = panels(figure, 1, hertz=True, above=-0.17, below=0.24)[0][0]
    view = frequency_view(study)
    shown = (study.omega_rad_s >= view[0]) & (study.omega_rad_s <= view[1])
    _draw_curves(axes, study, shown, _worst_text(outcome))
    frequency_axis(axes, view)
    _set_height(axes, np.concatenate([study.mu_upper[shown], study.worst_case[shown]]))
    axes.axhline(1.0, **LEVEL)
    axes.set_ylabel("level (1 meets the specification)")
    _tell_peak(axes, outcome, study, shown)
    handles, names = axes.get_legend_handles_labels()
    legend_below(figure, handles, names)
    summary, members = outcome.summary, Members(outcome)
    return Drawing(
        name=f"mu-{file_stem(outcome, outcomes)}",
        title="Structured singular value over frequency",
        caption="The shaded band lies between the lower and the upper bound of µ, taken with complex blocks; where it "
        f"is too narrow to see, µ is known. Dashed: the exact worst case |W₁S| + |W₃T| over the real {members.plural}. "
        "The dotted line is level 1, below which the specification is met.",
        alt=f"Bounds of mu over frequency for {labels.case(outcome)}: peak upper bound {significant(summary.peak_mu)}, "
        f"peak lower bound {significant(summary.peak_mu_lower)}, exact worst case over the {members.noun} range "
        f"{significant(summary.worst_case)}.",
        figure=figure,
        columns={
            "omega_rad_s": study.omega_rad_s.tolist(),
            "mu_upper": study.mu_upper.tolist(),
            "mu_lower": study.mu_lower.tolist(),
            "worst_case": study.worst_case.tolist(),
        },
        case_id=outcome.case_id,
    )


def _draw_curves(axes: Axes, study: FrequencyStudy, shown: NDArray[np.bool_], worst_text: str) -> None:
    omega = study.omega_rad_s[shown]
    curves = [np.where(np.isfinite(curve[shown]), curve[shown], np.nan) for curve in _curves(study)]
    kept = thinned(np.log10(omega), *curves) if omega.size else np.arange(0)
    upper, lower, worst = (curve[kept] for curve in curves)
    axes.fill_between(omega[kept], lower, upper, color=BLUE, alpha=0.25, linewidth=0)
    axes.plot(omega[kept], upper, color=BLUE, label="µ, upper bound")
    axes.plot(omega[kept], lower, color=BLUE, linewidth=0.7, linestyle=(0, (1, 1)), label="µ, lower bound")
    axes.plot(omega[kept], worst, color=RUST, linestyle=(0, (5, 1.6)), label=worst_text)


def _curves(study: FrequencyStudy) -> tuple[Floats, Floats, Floats]:
    return study.mu_upper, study.mu_lower, study.worst_case


def _set_height(axes: Axes, levels: Floats) -> None:
    finite = levels[np.isfinite(levels)]
    top = float(finite.max()) if finite.size else 1.0
    if top <= _LARGEST_LINEAR:
        axes.set_ylim(0.0, 1.2 * max(1.0, top))
        return
    axes.set_yscale("log")
    positive = finite[finite > 0]
    bottom = max(_SMALLEST_DRAWN, min(0.1, float(positive.min())))
    axes.set_ylim(bottom / 3.0, min(_LARGEST_DRAWN, 3.0 * top))


def _tell_peak(axes: Axes, outcome: CaseOutcome, study: FrequencyStudy, shown: NDArray[np.bool_]) -> None:
    summary = outcome.summary
    upper = np.where(shown & np.isfinite(study.mu_upper), study.mu_upper, -np.inf)
    if summary.peak_mu is None or not np.isfinite(upper.max()):
        note(axes, "µ has no meaning here")
        return
    at = int(upper.argmax())
    text = f"peak µ {significant(summary.peak_mu)} (lower bound {significant(summary.peak_mu_lower)})"
    height = float(upper[at])
    bottom, top = axes.get_ylim()
    if bottom < height < top:
        point_label(axes, (float(study.omega_rad_s[at]), height), text, below=0.78 <= height < 1.0)


def _worst_text(outcome: CaseOutcome) -> str:
    """The exact worst case with the place where it is, for the legend."""
    summary, members = outcome.summary, Members(outcome)
    if summary.worst_case is None or not np.isfinite(summary.worst_case):
        return f"worst real {members.noun}"
    worst = worst_member(summary)
    where = [] if worst is None else [members.name(worst)]
    omega = summary.worst_omega_rad_s
    if omega is not None and np.isfinite(omega) and omega > 0:
        where.append(with_unit(omega, "rad/s"))
    place = f" ({', '.join(where)})" if where else ""
    return f"worst real {members.noun} of {members.family}: {significant(summary.worst_case)}{place}"

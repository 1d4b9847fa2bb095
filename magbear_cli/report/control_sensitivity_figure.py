"""K S of the masses: what current a position disturbance, or noise of the sensor, asks for."""

from __future__ import annotations

import numpy as np

from magbear_cli.report.canvas import INK, decibel, frequency_axis, new_figure, note, panels, pen
from magbear_cli.report.drawing import Drawing, stacked
from magbear_cli.report.members import Members
from magbear_cli.report.numbers import significant
from magbear_cli.report.series import Labels, file_stem, frequency_view
from magbear_cli.report.thinning import thinned
from magbear_cli.study.members import members_of
from magbear_cli.study.outcome import CaseOutcome, Complexes, Floats, FrequencyStudy

_PER_MICROMETRE = 1e-6


def control_sensitivity_drawing(
    outcome: CaseOutcome, outcomes: tuple[CaseOutcome, ...], labels: Labels
) -> Drawing | None:
    """|K S| and its phase for the masses of one case; None when it has no curves."""
    study = outcome.frequency
    if study is None or not study.omega_rad_s.size:
        return None
    size = np.abs(study.control_sensitivity_a_per_m)
    if not (np.isfinite(size) & (size > 0.0)).any():
        return None
    figure = new_figure(3.9)
    grid = panels(figure, 1, rows=2, hertz=True, above=-0.17)
    view = frequency_view(study)
    shown = (study.omega_rad_s >= view[0]) & (study.omega_rad_s <= view[1])
    omega = study.omega_rad_s[shown]
    upper, lower = grid[0][0], grid[1][0]
    members = Members(outcome)
    for index, (one, row) in enumerate(zip(members_of(study), study.control_sensitivity_a_per_m, strict=True)):
        style = pen(index)
        for axes, whole in ((upper, decibel(np.abs(row))), (lower, _phase_deg(row))):
            curve = whole[shown]
            kept = thinned(np.log10(omega), curve) if omega.size else np.arange(0)
            axes.plot(
                omega[kept],
                curve[kept],
                color=style.color,
                linestyle=style.linestyle,
                label=members.name(one),
            )
    frequency_axis(upper, view, label=False)
    frequency_axis(lower, view, hertz=False)
    upper.set_ylabel("|K S| (dB re 1 A/m)")
    lower.set_ylabel("phase of −K S (deg)")
    lower.legend(loc="upper right")
    row, column = np.unravel_index(int(np.nanargmax(np.where(np.isfinite(size), size, -1.0))), size.shape)
    peak, worst = float(size[row, column]), members.name(members_of(study)[int(row)])
    if view[0] <= study.omega_rad_s[column] <= view[1]:
        height = float(decibel(size[row, column : column + 1])[0])
        upper.plot(float(study.omega_rad_s[column]), height, "o", markersize=4.5, markerfacecolor="white", color=INK)
    note(upper, f"largest {significant(peak * _PER_MICROMETRE)} A/µm, at {worst}", "lower right")
    return Drawing(
        name=f"control_sensitivity-{file_stem(outcome, outcomes)}",
        title="Control sensitivity: current for a disturbance of the position",
        caption="K S from the disturbance of the measured position to the control current: magnitude in dB re 1 A/m "
        "(120 dB is 1 A/µm) and the phase of −K S.",
        alt=f"Magnitude and phase of K S for {labels.case(outcome)}: the largest magnitude is "
        f"{significant(peak * _PER_MICROMETRE)} A per micrometre, at {worst}.",
        figure=figure,
        columns=_columns(study, members),
        case_id=outcome.case_id,
    )


def _phase_deg(row: Complexes) -> Floats:
    """The phase of −K S over frequency: without jumps, and within ±180 at the highest, where there are numbers."""
    phase = np.degrees(np.angle(-row))
    if not np.isfinite(phase).all():
        return phase
    whole = np.unwrap(phase, period=360.0)
    return np.asarray(whole - 360.0 * np.round(whole[-1] / 360.0))


def _columns(study: FrequencyStudy, members: Members) -> dict[str, list[object]]:
    return stacked(
        [
            {
                **members.columns(one, row.size),
                "omega_rad_s": study.omega_rad_s.tolist(),
                "abs_ks_a_per_m": np.abs(row).tolist(),
                "phase_of_minus_ks_deg": _phase_deg(row).tolist(),
            }
            for one, row in zip(members_of(study), study.control_sensitivity_a_per_m, strict=True)
        ]
    )

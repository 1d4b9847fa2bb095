"""S and T of the masses against the bounds 1/W1 and 1/W3, with the verdict written in."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from magbear_cli.report.canvas import INK, decibel, frequency_axis, new_figure, note, panel_title, panels, pen
from magbear_cli.report.drawing import Drawing, stacked
from magbear_cli.report.members import Members
from magbear_cli.report.numbers import significant
from magbear_cli.report.series import Labels, file_stem, frequency_view
from magbear_cli.report.thinning import thinned
from magbear_cli.study.members import members_of
from magbear_cli.study.outcome import CaseOutcome, Complexes, FrequencyStudy

Floats = NDArray[np.float64]

_DEPTH_DB = 80.0  # below the highest curve: what lies deeper says nothing
_HEADROOM_DB = 22.0


def sensitivity_drawing(outcome: CaseOutcome, outcomes: tuple[CaseOutcome, ...], labels: Labels) -> Drawing | None:
    """The figure of S and T of one case; None when it has no curves."""
    study = outcome.frequency
    if study is None or not study.omega_rad_s.size:
        return None
    figure = new_figure(3.25)
    left, right = panels(figure, 2, hertz=True)[0]
    members = Members(outcome)
    verdicts = (
        _panel(left, (study, members), study.sensitivity, study.performance_bound, ("S", "W₁", "Sensitivity |S|")),
        _panel(
            right,
            (study, members),
            study.complementary_sensitivity,
            study.bandwidth_bound,
            ("T", "W₃", "Complementary sensitivity |T|"),
        ),
    )
    left.set_ylabel("magnitude (dB)")
    return Drawing(
        name=f"sensitivity-{file_stem(outcome, outcomes)}",
        title="Sensitivity functions against their bounds",
        caption=f"Each {members.noun} keeps below the dotted bound when |W₁S| and |W₃T| stay below 1; the "
        f"specification asks for more, their sum at most 1 for every {members.noun} of the range.",
        alt=f"Magnitudes of S and T in dB for {labels.case(outcome)}: {verdicts[0]}; {verdicts[1]}.",
        figure=figure,
        columns=_columns(study, members),
        case_id=outcome.case_id,
    )


def _panel(
    axes: Axes,
    shown_case: tuple[FrequencyStudy, Members],
    response: Complexes,
    bound: Floats,
    words: tuple[str, str, str],
) -> str:
    (study, members), (symbol, weight, title) = shown_case, words
    view = frequency_view(study)
    shown = (study.omega_rad_s >= view[0]) & (study.omega_rad_s <= view[1])
    omega = study.omega_rad_s[shown]
    curves = [decibel(np.abs(row[shown])) for row in response]
    for index, (one, curve) in enumerate(zip(members_of(study), curves, strict=True)):
        kept, style = thinned(np.log10(omega), curve), pen(index)
        axes.plot(omega[kept], curve[kept], color=style.color, linestyle=style.linestyle, label=members.name(one))
    limit = -decibel(bound[shown])
    bounded = bool(np.isfinite(limit).any())
    if bounded:
        kept = thinned(np.log10(omega), limit)
        axes.plot(omega[kept], limit[kept], color=INK, linewidth=1.1, linestyle=(0, (1, 1.5)), label=f"1/|{weight}|")
    _set_height(axes, curves)
    frequency_axis(axes, view)
    panel_title(axes, title, hertz=True)
    spoken, drawn = _verdict((study, members), np.abs(response) * bound, symbol, weight, bounded=bounded)
    falls = symbol == "T"
    note(axes, drawn, "upper right" if falls else "upper left")
    axes.legend(loc="lower left" if falls else "lower right")
    return spoken


def _set_height(axes: Axes, curves: list[Floats]) -> None:
    finite = np.concatenate([curve[np.isfinite(curve)] for curve in curves]) if curves else np.empty(0)
    if not finite.size:
        return
    top = float(finite.max())
    bottom = max(float(finite.min()), top - _DEPTH_DB)
    axes.set_ylim(bottom - 4.0, top + _HEADROOM_DB)


def _verdict(
    shown_case: tuple[FrequencyStudy, Members], weighted: Floats, symbol: str, weight: str, *, bounded: bool
) -> tuple[str, str]:
    """What the panel shows in plain words, and the same for the panel itself."""
    if not bounded:
        return f"there is no bound on {symbol}", f"no bound on {symbol}"
    if not np.isfinite(weighted).any():
        return f"{symbol} has no finite values", "no finite values"
    row, column = np.unravel_index(int(np.nanargmax(np.where(np.isfinite(weighted), weighted, -1.0))), weighted.shape)
    study, members = shown_case
    worst, member = float(weighted[row, column]), members.name(members_of(study)[int(row)])
    place = "below" if worst <= 1.0 else "above"
    return (
        f"{symbol} is {place} its bound, the largest |{weight}{symbol}| is {significant(worst)} at {member}",
        f"{place} the bound: largest |{weight}{symbol}| is {significant(worst)}, at {member}",
    )


def _columns(study: FrequencyStudy, members: Members) -> dict[str, list[object]]:
    tables = [
        {
            **members.columns(one, study.omega_rad_s.size),
            "omega_rad_s": study.omega_rad_s.tolist(),
            "abs_sensitivity": np.abs(study.sensitivity[row]).tolist(),
            "abs_complementary_sensitivity": np.abs(study.complementary_sensitivity[row]).tolist(),
            "abs_w1": study.performance_bound.tolist(),
            "abs_w3": study.bandwidth_bound.tolist(),
        }
        for row, one in enumerate(members_of(study))
    ]
    return stacked(tables)

"""|K| and its phase for a group of controllers: of one problem, or of one mass range with several limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from magbear_cli.report.canvas import decibel, frequency_axis, new_figure, panel_title, panels, pen, plain, point_label
from magbear_cli.report.drawing import Drawing, stacked
from magbear_cli.report.numbers import count_text, mass_text, omega_text, significant
from magbear_cli.report.series import Labels, controller_key, file_stem, frequency_view, problem_key
from magbear_cli.report.thinning import thinned
from magbear_cli.study.outcome import CaseOutcome, FrequencyStudy

Floats = NDArray[np.float64]

MOST_CURVES = 6
_DEPTH_DB = 80.0
_LEGEND_WIDTH = 44


def controller_gain_drawings(outcomes: tuple[CaseOutcome, ...], labels: Labels) -> list[Drawing]:
    """A figure a group of cases that have a controller, at most six curves each."""
    cases = [outcome for outcome in outcomes if outcome.frequency is not None and outcome.frequency.omega_rad_s.size]
    several = len({controller_key(case) for case in cases}) > 1
    groups: dict[str, list[CaseOutcome]] = {}
    for case in cases:
        key = problem_key(case) if several else problem_key(case, without="bandwidth")
        groups.setdefault(key, []).append(case)
    drawings = []
    for group in groups.values():
        for start in range(0, len(group), MOST_CURVES):
            part = group[start : start + MOST_CURVES]
            drawings.append(_drawing(part, outcomes, labels, several=several))
    return drawings


def _drawing(
    group: Sequence[CaseOutcome], outcomes: tuple[CaseOutcome, ...], labels: Labels, *, several: bool
) -> Drawing:
    figure = new_figure(4.3)
    (top,), (bottom,) = panels(figure, 1, rows=2, hertz=True)
    studies = [case.frequency for case in group if case.frequency is not None]
    names = [labels.controller(case) if several else f"ω_c = {omega_text(case.omega_c_rad_s)}" for case in group]
    views = [frequency_view(study) for study in studies]
    view = (min(low for low, _ in views), max(high for _, high in views))
    for index, (study, name) in enumerate(zip(studies, names, strict=True)):
        _draw(top, bottom, study, index, plain(name, _LEGEND_WIDTH))
    _finish(top, bottom, view)
    _tell_peak(top, group, view)
    first = group[0]
    what = mass_text(first.mass_kg)
    if several and first.omega_c_rad_s is not None:
        what += f", ω_c = {omega_text(first.omega_c_rad_s)}"
    panel_title(top, f"Controllers for {plain(what, 80)}", hertz=True)
    peaks = "; ".join(f"{name}: {_current_text(case)}" for name, case in zip(names, group, strict=True))
    return Drawing(
        name=f"controller_gain-{file_stem(first, outcomes)}",
        title=f"Controller gain, {what}",
        caption="The controller K from position to current: magnitude in dB re 1 A/m (120 dB is 1 A/µm) and phase. The "
        "phase is that of −K, the gain of the loop as it is usually drawn, so that a lead is above zero.",
        alt=f"Bode diagram of {count_text(len(group), 'controller')} for {what}; largest gains: {peaks}.",
        figure=figure,
        columns=_columns(group, names),
    )


def _draw(top: Axes, bottom: Axes, study: FrequencyStudy, index: int, name: str) -> None:
    positive = study.omega_rad_s > 0
    omega = study.omega_rad_s[positive]
    gain = decibel(np.abs(study.controller_a_per_m[positive]))
    phase = _phase_deg(study)[positive]
    kept, style = thinned(np.log10(omega), gain, phase), pen(index)
    for axes, curve in ((top, gain), (bottom, phase)):
        axes.plot(omega[kept], curve[kept], color=style.color, linestyle=style.linestyle, label=name)


def _phase_deg(study: FrequencyStudy) -> Floats:
    """The unwrapped phase of −K in degrees, within ±180 at the lowest frequency."""
    response = -study.controller_a_per_m
    sound = np.isfinite(response) & (response != 0)
    phase: Floats = np.full(response.shape, np.nan)
    phase[sound] = np.degrees(np.unwrap(np.angle(response[sound])))
    return phase


def _finish(top: Axes, bottom: Axes, view: tuple[float, float]) -> None:
    frequency_axis(top, view, label=False)
    frequency_axis(bottom, view, hertz=False)
    top.set_ylabel("|K| (dB re 1 A/m)")
    bottom.set_ylabel("phase of −K (deg)")
    low, high = top.get_ylim()
    top.set_ylim(max(low, high - _DEPTH_DB), high + 0.12 * (high - max(low, high - _DEPTH_DB)))
    span = np.ptp(bottom.get_ylim())
    bottom.yaxis.set_major_locator(MultipleLocator(45 if span <= 400 else 180))
    bottom.axhline(0.0, color="#8c959f", linewidth=0.7, zorder=1)
    bottom.legend(loc="best")


def _tell_peak(axes: Axes, group: Sequence[CaseOutcome], view: tuple[float, float]) -> None:
    """Mark the largest gain of all that is in view."""
    best: tuple[float, float] | None = None
    for case in group:
        study = case.frequency
        if study is None:
            continue
        shown = (study.omega_rad_s >= view[0]) & (study.omega_rad_s <= view[1])
        magnitude = np.where(shown & np.isfinite(study.controller_a_per_m), np.abs(study.controller_a_per_m), 0.0)
        at = int(magnitude.argmax())
        if magnitude[at] > 0 and (best is None or magnitude[at] > best[1]):
            best = float(study.omega_rad_s[at]), float(magnitude[at])
    if best is not None:
        text = f"largest |K| {significant(best[1] * 1e-6)} A/µm"
        point_label(axes, (best[0], 20.0 * float(np.log10(best[1]))), text, below=True)


def _current_text(case: CaseOutcome) -> str:
    peak = case.summary.peak_gain_a_per_m
    return "unknown" if peak is None else f"{significant(peak * 1e-6)} A per µm"


def _columns(group: Sequence[CaseOutcome], names: Sequence[str]) -> dict[str, list[object]]:
    tables = []
    for case, name in zip(group, names, strict=True):
        study = case.frequency
        if study is None:
            continue
        count = study.omega_rad_s.size
        tables.append(
            {
                "case_id": [case.case_id] * count,
                "controller": [name] * count,
                "omega_rad_s": study.omega_rad_s.tolist(),
                "real_a_per_m": study.controller_a_per_m.real.tolist(),
                "imag_a_per_m": study.controller_a_per_m.imag.tolist(),
                "abs_a_per_m": np.abs(study.controller_a_per_m).tolist(),
                "phase_of_minus_k_deg": _phase_deg(study).tolist(),
            }
        )
    return stacked(tables)

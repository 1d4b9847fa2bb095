"""The curves of a thesis figure: what a quantity is of a case, in the units and on the scales that the thesis drew."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magbear_cli.claims.evidence import is_like
from magbear_cli.model.table import Table
from magbear_cli.report.canvas import decibel
from magbear_cli.report.numbers import MICROMETRES, MILLISECONDS, kilograms, shortest
from magbear_cli.report.series import mass_ends_kg
from magbear_cli.spec.thesis import FigureEntry, Panel
from magbear_cli.study.outcome import CaseOutcome, FrequencyStudy, StepOutcome, StudyResults

Floats = NDArray[np.float64]

_TEN_MICROMETRES_M = 1e-5
_SLOT = re.compile(r"\{([A-Za-z0-9_.]+)\}")


@dataclass(frozen=True, eq=False)
class Line:
    """One curve: its name, its points, and whether it is a bound that the others must stay below."""

    name: str
    x: Floats
    y: Floats
    is_bound: bool = False


@dataclass(frozen=True)
class Scale:
    """The axes of a quantity."""

    x_label: str
    y_label: str
    x_name: str
    y_name: str
    level: float | None = None

    @property
    def is_frequency(self) -> bool:
        """Whether the abscissa is a frequency, drawn on a logarithmic axis."""
        return self.x_name == "omega_rad_s"


FREQUENCY_LABEL, TIME_LABEL = "frequency ω (rad/s)", "time (ms)"
SCALES: Mapping[str, Scale] = {
    "mu": Scale(FREQUENCY_LABEL, "µ, upper bound (dB)", "omega_rad_s", "mu_db", 0.0),
    "sensitivity": Scale(FREQUENCY_LABEL, "|S| (dB)", "omega_rad_s", "sensitivity_db"),
    "complementary_sensitivity": Scale(FREQUENCY_LABEL, "|T| (dB)", "omega_rad_s", "complementary_db"),
    "controller_gain": Scale(FREQUENCY_LABEL, "|K| (dB re 1 A/m)", "omega_rad_s", "controller_gain_db"),
    "position": Scale(TIME_LABEL, "position (µm)", "time_ms", "position_um"),
    "current": Scale(TIME_LABEL, "control current (A)", "time_ms", "current_a"),
    "singular_value": Scale(FREQUENCY_LABEL, "largest singular value (dB)", "omega_rad_s", "singular_value_db", 0.0),
    "reference": Scale(TIME_LABEL, "command (µm)", "time_ms", "reference_um"),
    "peak_gain": Scale("width of the mass range (kg)", "largest |K| (dB re 1 A/m)", "width_kg", "peak_gain_db"),
    "peak_control_sensitivity": Scale(
        "width of the mass range (kg)", "largest |K S| (A per 10 µm)", "width_kg", "peak_control_sensitivity_a"
    ),
    "error": Scale(TIME_LABEL, "error (µm)", "time_ms", "error_um"),
}


def lines_of(quantity: str, entry: FigureEntry, panel: Panel, studies: Mapping[str, StudyResults]) -> list[Line]:
    """The curves of one panel, in the order of the cases asked for; a bound that several share stands once."""
    if quantity in _OVER_CASES:
        return _over_cases(quantity, panel, studies)
    found: dict[tuple[bool, str, bytes], Line] = {}
    for outcome in chosen_cases(panel, studies):
        for line in _of_case(quantity, entry, panel, outcome):
            found.setdefault((line.is_bound, "" if line.is_bound else line.name, line.y.tobytes()), line)
    return list(found.values())


def chosen_cases(panel: Panel, studies: Mapping[str, StudyResults]) -> Iterator[CaseOutcome]:
    """The cases of a panel, as its selections find them."""
    for where in panel.cases:
        wanted = {key: value for key, value in where.items() if key != "study"}
        for outcome in studies[str(where["study"])].outcomes:
            if is_like(outcome.inputs, wanted):
                yield outcome


def _of_case(quantity: str, entry: FigureEntry, panel: Panel, outcome: CaseOutcome) -> Iterator[Line]:
    if quantity == "table":
        yield from _of_table(entry, panel, outcome)
    elif not SCALES[quantity].is_frequency:
        for step in outcome.steps:
            if step.time_s.size > 1 and is_like(step.scenario, panel.steps):
                yield from _OVER_TIME[quantity](
                    filled(panel.label or "{mass_kg} kg", step.scenario, outcome.inputs), step
                )
    elif outcome.frequency is not None:
        yield from _OVER_FREQUENCY[quantity](panel, outcome, outcome.frequency)


def _of_table(entry: FigureEntry, panel: Panel, outcome: CaseOutcome) -> Iterator[Line]:
    table = outcome.tables.get(entry.table or "")
    if table is None:
        return
    across = entry.across or table.columns[0].name
    if entry.by is not None:
        yield from _split(entry, table, across)
        return
    name = filled(panel.label, {}, outcome.inputs)
    shown = [column for column in table.columns if column.name in entry.curves]
    for column in shown or [column for column in table.columns if column.name != across]:
        if column.name != across:
            own = column.long_name if len(shown) != 1 else ""
            yield Line(", ".join(part for part in (name, own) if part), table[across], column.values)


def _split(entry: FigureEntry, table: Table, across: str) -> Iterator[Line]:
    """A table in long form: a curve for each of at most five values of one column, evenly spaced among them."""
    key = next(column for column in table.columns if column.name == entry.by)
    values = np.unique(key.values)
    for value in values[np.unique(np.linspace(0, values.size - 1, 5).round().astype(int))]:
        rows = key.values == value
        scale, unit = (MICROMETRES, "µm") if key.unit == "m" else (1.0, key.unit)
        name = f"{key.long_name} {shortest(float(f'{scale * value:.6g}'))} {unit}"
        yield Line(name, table[across][rows], table[entry.curves[0]][rows])


def _over_cases(quantity: str, panel: Panel, studies: Mapping[str, StudyResults]) -> list[Line]:
    """One point a case, one curve a name; cases without the figure are left out."""
    points: dict[str, list[tuple[float, float]]] = {}
    for outcome in chosen_cases(panel, studies):
        value = _OVER_CASES[quantity](outcome)
        low, high = mass_ends_kg(outcome)
        if value is not None and np.isfinite(value):
            points.setdefault(filled(panel.label, {}, outcome.inputs), []).append((high - low, value))
    return [Line(name, *np.array(sorted(found)).T) for name, found in points.items()]


def _peak_gain(outcome: CaseOutcome) -> float | None:
    gain = outcome.summary.peak_gain_a_per_m
    return None if gain is None else float(decibel(np.array([gain]))[0])


def _peak_control_sensitivity(outcome: CaseOutcome) -> float | None:
    peak = outcome.summary.peak_ks_a_per_m
    return None if peak is None else _TEN_MICROMETRES_M * peak


def _mu(panel: Panel, outcome: CaseOutcome, study: FrequencyStudy) -> Iterator[Line]:
    yield Line(filled(panel.label, {}, outcome.inputs), study.omega_rad_s, decibel(study.mu_upper))


def _controller_gain(panel: Panel, outcome: CaseOutcome, study: FrequencyStudy) -> Iterator[Line]:
    gain = np.abs(study.controller_a_per_m)
    yield Line(filled(panel.label, {}, outcome.inputs), study.omega_rad_s, decibel(gain))


def _of_loop(
    panel: Panel, outcome: CaseOutcome, study: FrequencyStudy, loops: NDArray[np.complex128], bound: tuple[str, Floats]
) -> Iterator[Line]:
    for mass, values in zip(study.masses_kg, loops, strict=True):
        if panel.masses_kg is None or any(abs(mass - wanted) < 1e-6 * mass for wanted in panel.masses_kg):
            name = filled(panel.label or "{mass_kg} kg", {"mass_kg": float(mass)}, outcome.inputs)
            yield Line(name, study.omega_rad_s, decibel(np.abs(values)))
    name, weight = bound
    if (weight > 0).any():
        with np.errstate(divide="ignore"):
            yield Line(name, study.omega_rad_s, decibel(1.0 / weight), is_bound=True)


def _sensitivity(panel: Panel, outcome: CaseOutcome, study: FrequencyStudy) -> Iterator[Line]:
    yield from _of_loop(panel, outcome, study, study.sensitivity, ("bound 1/|W₁|", study.performance_bound))


def _complementary(panel: Panel, outcome: CaseOutcome, study: FrequencyStudy) -> Iterator[Line]:
    bound = ("bound 1/|W₃|", study.bandwidth_bound)
    yield from _of_loop(panel, outcome, study, study.complementary_sensitivity, bound)


def _position(name: str, step: StepOutcome) -> Iterator[Line]:
    time = MILLISECONDS * step.time_s
    yield Line(name, time, MICROMETRES * step.position_m)
    if np.ptp(step.reference_m) > 0.0:
        yield Line("reference", time, MICROMETRES * step.reference_m, is_bound=True)


def _current(name: str, step: StepOutcome) -> Iterator[Line]:
    yield Line(name, MILLISECONDS * step.time_s, step.current_a)


def _error(name: str, step: StepOutcome) -> Iterator[Line]:
    yield Line(name, MILLISECONDS * step.time_s, MICROMETRES * (step.reference_m - step.position_m))


def _singular_value(panel: Panel, outcome: CaseOutcome, study: FrequencyStudy) -> Iterator[Line]:
    """Of [W1 S; W3 T], for the first mass."""
    performance = study.performance_bound * np.abs(study.sensitivity[0])
    bandwidth = study.bandwidth_bound * np.abs(study.complementary_sensitivity[0])
    yield Line(filled(panel.label, {}, outcome.inputs), study.omega_rad_s, decibel(np.hypot(performance, bandwidth)))


def _reference(name: str, step: StepOutcome) -> Iterator[Line]:
    yield Line(name, MILLISECONDS * step.time_s, MICROMETRES * step.reference_m)


_OVER_FREQUENCY: Mapping[str, Callable[[Panel, CaseOutcome, FrequencyStudy], Iterator[Line]]] = {
    "mu": _mu,
    "singular_value": _singular_value,
    "controller_gain": _controller_gain,
    "sensitivity": _sensitivity,
    "complementary_sensitivity": _complementary,
}
_OVER_TIME: Mapping[str, Callable[[str, StepOutcome], Iterator[Line]]] = {
    "position": _position,
    "current": _current,
    "error": _error,
    "reference": _reference,
}
_OVER_CASES: Mapping[str, Callable[[CaseOutcome], float | None]] = {
    "peak_gain": _peak_gain,
    "peak_control_sensitivity": _peak_control_sensitivity,
}


def filled(template: str, *sources: Mapping[str, Any]) -> str:
    """The template with each {dotted.key} replaced by what the first source that knows it says."""
    return _SLOT.sub(lambda slot: _told(slot[1], sources), template)


def _told(key: str, sources: Sequence[Mapping[str, Any]]) -> str:
    for source in sources:
        value: Any = source
        for part in key.split("."):
            value = value.get(part) if isinstance(value, Mapping) else None
        if isinstance(value, list):
            return " to ".join(_word(key, item) for item in value)
        if value is not None:
            return _word(key, value)
    return "none"


def _word(key: str, value: object) -> str:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value).replace("_", " ")
    number = float(value)
    if key.endswith("step_m"):
        return shortest(number * MICROMETRES)
    return kilograms(number) if key.endswith("_kg") else shortest(number)

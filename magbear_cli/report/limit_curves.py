"""The brackets of a study as curves: over the mass, or over whatever else varies most."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

from magbear_cli.model.bearing import Bearing, CurrentLaw, linearization
from magbear_cli.report.numbers import kilograms, mass_text, shortest
from magbear_cli.report.series import mass_ends_kg
from magbear_cli.study.outcome import CaseOutcome

LIMIT = "limit"
MASS = "mass"
WORDS = {
    "dc_gain": "gain of W₁ at rest",
    "corner_rad_s": "corner of W₁ (rad/s)",
    "air_gap_m": "air gap (m)",
    "force_constant_n_m2_per_a2": "force constant (N m²/A²)",
    "bias_current_a": "bias current (A)",
    "position_m": "operating position (m)",
    "current_a": "operating current (A)",
    "low_factor": "least factor on the magnets",
    "high_factor": "largest factor on the magnets",
}


@dataclass(frozen=True)
class LimitCurve:
    """Cases along one quantity, by ascending value of it."""

    label: str
    values: tuple[float, ...]
    cases: tuple[CaseOutcome, ...]


@dataclass(frozen=True)
class LimitCurves:
    """All curves over one quantity: its name, its label, and how a value is told."""

    quantity: str
    axis: str
    curves: tuple[LimitCurve, ...]


def brackets(outcomes: Sequence[CaseOutcome]) -> list[CaseOutcome]:
    """The cases that sought a limit and found at least one side of it."""
    found = [outcome for outcome in outcomes if outcome.method == LIMIT]
    return [
        outcome
        for outcome in found
        if outcome.summary.omega_c_feasible_rad_s is not None or outcome.summary.omega_c_infeasible_rad_s is not None
    ]


def limit_curves(cases: Sequence[CaseOutcome], tell: Callable[[CaseOutcome], str] = lambda _: "") -> LimitCurves:
    """The cases as curves; ``tell`` names what else sets cases apart, such as their controller."""
    known = [_quantities(case) for case in cases]
    varying = [name for name in known[0] if len({row.get(name) for row in known}) > 1] or [MASS]
    quantity = max(varying, key=lambda name: (len({row.get(name) for row in known}), name == MASS))
    values, axis = _along(quantity, cases, known)
    groups: dict[str, list[tuple[float, CaseOutcome]]] = {}
    for value, case, row in zip(values, cases, known, strict=True):
        rest = [_told(name, row[name], case) for name in varying if name != quantity and name in row]
        label = ", ".join(part for part in (tell(case), *rest) if part)
        groups.setdefault(label, []).append((value, case))
    curves = []
    for label, points in groups.items():
        points.sort(key=lambda point: point[0])
        curves.append(LimitCurve(label, tuple(x for x, _ in points), tuple(case for _, case in points)))
    return LimitCurves(quantity, axis, tuple(curves))


def _quantities(case: CaseOutcome) -> dict[str, Any]:
    """What a user may sweep, as numbers; the mass as its two ends."""
    inputs = case.inputs
    num, den = inputs["performance"]["num"], inputs["performance"]["den"]
    found: dict[str, Any] = {MASS: mass_ends_kg(case)}
    if len(num) == 1 and len(den) == 2:
        found |= {"dc_gain": round(num[0] / den[1], 12), "corner_rad_s": den[1] / den[0]}
    else:
        found["performance"] = json.dumps(inputs["performance"])
    found |= {key: value for key, value in inputs["bearing"].items() if key != "current_law"}
    found |= inputs["operating_point"]
    uncertain = inputs.get("uncertain")
    for name, (low, high) in (uncertain or {}).items():
        found |= {f"{name}_low_factor": low, f"{name}_high_factor": high}
    return found


def _along(quantity: str, cases: Sequence[CaseOutcome], known: Sequence[dict[str, Any]]) -> tuple[list[float], str]:
    """The value of each case on the axis, and the axis's label."""
    if quantity != MASS:
        if any(isinstance(row.get(quantity), str) for row in known):
            return [float(index) for index in range(len(cases))], "case"
        return [float(row.get(quantity, float("nan"))) for row in known], WORDS.get(quantity, quantity)
    ends = [mass_ends_kg(case) for case in cases]
    lowest = {low for low, _ in ends}
    if len(lowest) == 1:
        return [
            high - low for low, high in ends
        ], f"width of the mass range m_Δ above {kilograms(lowest.pop())} kg (kg)"
    if all(low == high for low, high in ends):
        return [low for low, _ in ends], "mass (kg)"
    return [high / low for low, high in ends], "heaviest over lightest rotor of the range"


def _told(name: str, value: Any, case: CaseOutcome) -> str:  # noqa: ANN401 - any input
    if name == MASS:
        return mass_text(case.mass_kg)
    if isinstance(value, str):
        return ""
    words, _, unit = WORDS.get(name, name).partition(" (")
    return f"{words} {shortest(value)} {unit.removesuffix(')')}".rstrip()


@dataclass(frozen=True)
class ThesisPoint:
    """A bandwidth limit that the thesis reports for a mass range, and whether it was met there."""

    mass_kg: tuple[float, float]
    omega_c_rad_s: float
    met: bool


def thesis_points(case: CaseOutcome) -> list[ThesisPoint]:
    """The thesis's own points, where the case has the thesis's bearing and weight; none otherwise."""
    printed = _printed()
    performance, expected = case.inputs["performance"], printed["performance"]
    bearing = {**case.inputs["bearing"], "current_law": CurrentLaw(case.inputs["bearing"]["current_law"])}
    linear = linearization(Bearing(**bearing), **case.inputs["operating_point"])
    same = (
        all(abs(getattr(linear, name) / value - 1.0) < 1e-9 for name, value in printed["bearing"].items())
        and performance == expected
    )
    if not same or case.inputs.get("uncertain") is not None:
        return []
    return [
        ThesisPoint((row["mass_kg"][0], row["mass_kg"][1]), row["omega_c_rad_s"], bool(row["met"]))
        for row in printed["bandwidth"]
    ]


@cache
def _printed() -> dict[str, Any]:
    text = resources.files("magbear_cli.report").joinpath("thesis_points.json").read_text("utf-8")
    document: dict[str, Any] = json.loads(text)
    return document

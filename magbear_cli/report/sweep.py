"""A study as curves: the quantity that is swept, the cases along it, and where a level of 1 is crossed."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

from magbear_cli.errors import Status
from magbear_cli.report.numbers import mass_text, omega_text, shortest, significant
from magbear_cli.report.series import Labels, controller_key, mass_ends_kg, problem_key
from magbear_cli.study.outcome import CaseOutcome

Measure = Callable[[CaseOutcome], float | None]


class Axis(StrEnum):
    """What a sweep runs along."""

    OMEGA_C = "omega_c_rad_s"
    HIGHEST_MASS = "highest_mass_kg"
    MASS_DEVIATION = "mass_deviation_kg"
    MASS = "mass_kg"


AXIS_WORDS = {
    Axis.OMEGA_C: "bandwidth limit ω_c (rad/s)",
    Axis.HIGHEST_MASS: "heaviest rotor of the range (kg)",
    Axis.MASS_DEVIATION: "half-width of the mass range (kg)",
    Axis.MASS: "mass (kg)",
}


@dataclass(frozen=True)
class Curve:
    """Cases that differ in the swept quantity alone, by ascending value of it."""

    label: str
    controller: int  # which of the study's controllers, from 0
    family: int  # which of the study's problems without the swept quantity, from 0
    values: tuple[float, ...]
    cases: tuple[CaseOutcome, ...]


@dataclass(frozen=True)
class Crossing:
    """Where level 1 lies between two neighbouring cases: interpolated, or next to a case proven impossible."""

    low: float
    high: float
    value: float | None  # None where one side has no level to interpolate
    impossible: float | None = None  # the side that is proven impossible

    def text(self, axis: Axis) -> str:
        """The place in words: interpolated figures are called so."""
        unit = " rad/s" if axis == Axis.OMEGA_C else " kg"
        if self.value is not None:
            return f"near {significant(self.value)}{unit} (interpolated)"
        ends = [
            f"{shortest(end)}{unit}{' (proven impossible)' if end == self.impossible else ''}"
            for end in (self.low, self.high)
        ]
        return f"between {ends[0]} and {ends[1]}"


@dataclass(frozen=True)
class Sweep:
    """All curves of a study over one quantity."""

    axis: Axis
    curves: tuple[Curve, ...]


def peak_mu(outcome: CaseOutcome) -> float | None:
    """The peak of the upper bound of mu, where it is a number and the loop is stable."""
    return _level(outcome, outcome.summary.peak_mu)


def worst_case(outcome: CaseOutcome) -> float | None:
    """The exact worst case over the real masses, likewise."""
    return _level(outcome, outcome.summary.worst_case)


def _level(outcome: CaseOutcome, level: float | None) -> float | None:
    if level is None or not math.isfinite(level) or level <= 0 or outcome.status == Status.UNSTABLE:
        return None
    return level


def find_sweep(outcomes: Sequence[CaseOutcome], labels: Labels) -> Sweep | None:
    """The curves of a study; None when no quantity is swept."""
    axis = _swept(outcomes)
    if axis is None:
        return None
    without = "bandwidth" if axis == Axis.OMEGA_C else "mass_kg"
    groups: dict[tuple[str, str], list[tuple[float, CaseOutcome]]] = {}
    for outcome in outcomes:
        value = _value(outcome, axis)
        if value is not None:
            groups.setdefault((controller_key(outcome), problem_key(outcome, without)), []).append((value, outcome))
    controllers = list(dict.fromkeys(controller for controller, _ in groups))
    problems = list(dict.fromkeys(problem for _, problem in groups))
    curves = []
    for (controller, problem), points in groups.items():
        points.sort(key=lambda point: point[0])
        first = points[0][1]
        told = _told(first, axis, labels, several=(len(controllers) > 1, len(problems) > 1))
        curves.append(
            Curve(
                told,
                controllers.index(controller),
                problems.index(problem),
                tuple(value for value, _ in points),
                tuple(case for _, case in points),
            )
        )
    return Sweep(axis, _with_different_labels(curves))


def crossings(curve: Curve, measure: Measure, axis: Axis) -> list[Crossing]:
    """Each change from meeting level 1 to not meeting it along a curve."""
    found = []
    for (low, first), (high, last) in pairwise(zip(curve.values, curve.cases, strict=True)):
        before, after = measure(first), measure(last)
        if before is not None and after is not None:
            if (before <= 1.0) != (after <= 1.0):
                found.append(Crossing(low, high, _interpolated((low, before), (high, after), axis)))
        elif {first.status, last.status} == {Status.OK, Status.INFEASIBLE}:
            found.append(Crossing(low, high, None, low if first.status == Status.INFEASIBLE else high))
    return found


def _interpolated(first: tuple[float, float], last: tuple[float, float], axis: Axis) -> float:
    """Where the logarithm of the level is zero on a straight line between two points."""
    to_line, from_line = (math.log, math.exp) if axis == Axis.OMEGA_C else (float, float)
    share = math.log(first[1]) / (math.log(first[1]) - math.log(last[1]))
    return from_line(to_line(first[0]) + share * (to_line(last[0]) - to_line(first[0])))


def _swept(outcomes: Sequence[CaseOutcome]) -> Axis | None:
    if len({outcome.omega_c_rad_s for outcome in outcomes} - {None}) > 1:
        return Axis.OMEGA_C
    ends = {mass_ends_kg(outcome) for outcome in outcomes}
    if len(ends) < 2:
        return None
    if all(low == high for low, high in ends):
        return Axis.MASS
    return Axis.HIGHEST_MASS if len({low for low, _ in ends}) == 1 else Axis.MASS_DEVIATION


def _value(outcome: CaseOutcome, axis: Axis) -> float | None:
    low, high = mass_ends_kg(outcome)
    return {
        Axis.OMEGA_C: outcome.omega_c_rad_s,
        Axis.HIGHEST_MASS: high,
        Axis.MASS: high,
        Axis.MASS_DEVIATION: (high - low) / 2.0,
    }[axis]


def _told(outcome: CaseOutcome, axis: Axis, labels: Labels, several: tuple[bool, bool]) -> str:
    """What tells a curve from the others."""
    controllers, problems = several
    told = []
    if problems or not controllers:
        if axis == Axis.OMEGA_C:
            told.append(mass_text(outcome.mass_kg))
        elif outcome.omega_c_rad_s is not None:
            told.append(f"ω_c = {omega_text(outcome.omega_c_rad_s)}")
    if controllers or not told:
        told.append(labels.controller(outcome))
    return ", ".join(told)


def _with_different_labels(curves: Sequence[Curve]) -> tuple[Curve, ...]:
    """Where W1, the bearing or the operating point differ, the label alone would not tell: number the problems."""
    names = [curve.label for curve in curves]
    return tuple(
        curve if names.count(curve.label) == 1 else Curve(f"{curve.label}, problem {curve.family + 1}", *_rest(curve))
        for curve in curves
    )


def _rest(curve: Curve) -> tuple[int, int, tuple[float, ...], tuple[CaseOutcome, ...]]:
    return curve.controller, curve.family, curve.values, curve.cases

"""Limitation curves as plain documents, and whether they are where a baseline has them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from magbear_cli.errors import InputError, Status
from magbear_cli.study.outcome import CaseOutcome
from magbear_cli.study.summary import plain_number

SIDES = ("omega_c_infeasible", "omega_c_feasible")


def curve_document(outcome: CaseOutcome, over: Mapping[str, Any]) -> dict[str, Any]:
    """One bracket: the first five keys are a public interface; ``over`` holds what else is swept."""
    summary = outcome.summary
    return {
        "mass_kg": outcome.mass_kg,
        "omega_c_feasible": plain_number(summary.omega_c_feasible_rad_s),
        "omega_c_infeasible": plain_number(summary.omega_c_infeasible_rad_s),
        "controller_order": summary.order,
        "verified": bool(summary.verified),
        "certified": outcome.impossibility is not None,
        "over": dict(over),
        "status": outcome.status.value,
        "sentence": outcome.sentence,
    }


def curve_line(curve: Mapping[str, Any]) -> str:
    """One bracket in a sentence."""
    low, high = (curve[side] for side in SIDES)
    if curve["status"] == Status.INFEASIBLE:
        return f"{curve_name(curve)}: infeasible at every bandwidth limit ({curve['sentence']})"
    impossible = "no proof of impossibility" if low is None else f"proven impossible up to {low:.1f} rad/s"
    order = curve["controller_order"]
    met = "not met" if high is None else f"met from {high:.1f} rad/s by a controller of order {order}"
    why = f" ({curve['sentence']})" if curve["sentence"] else ""
    return f"{curve_name(curve)}: {impossible}, {met}{why}"


def curve_name(curve: Mapping[str, Any]) -> str:
    """Which bracket it is: its masses, and what else is swept."""
    mass = curve["mass_kg"]
    told = "-".join(f"{bound:g}" for bound in mass) if isinstance(mass, list) else f"{mass:g}"
    return ", ".join([f"{told} kg", *(f"{key} = {_spoken(value)}" for key, value in curve["over"].items())])


@dataclass(frozen=True)
class Comparison:
    """Limitation curves beside those of a baseline: a row each, and a sentence for whatever moved."""

    rows: tuple[tuple[str, Mapping[str, Any] | None, Mapping[str, Any] | None, tuple[str, ...]], ...]
    tolerance: float

    @property
    def moved(self) -> list[str]:
        """What moved: the curve's name, and how."""
        return [f"{name}: {text}" for name, _, _, texts in self.rows for text in texts]

    def markdown(self, baseline: str) -> str:
        """The comparison as a section of a page in Markdown: the verdict, then a table with what moved in bold."""
        count = sum(bool(texts) for *_, texts in self.rows)
        verdict = f"**{count} of {len(self.rows)} moved**" if count else f"all {len(self.rows)} where they were"
        lines = [
            "## Limitation curves", "",
            f"Against `{baseline}`, within {100.0 * self.tolerance:g} %: {verdict}.", "",
            "| curve | impossible up to (rad/s), before → now | met from (rad/s), before → now | |",
            "| --- | --- | --- | --- |",
        ]  # fmt: skip
        for name, old, now, texts in self.rows:
            sides = [
                " → ".join(
                    "–" if curve is None or curve[side] is None else f"{curve[side]:.1f}" for curve in (old, now)
                )
                for side in SIDES
            ]
            found = f"**{'; '.join(texts)}**" if texts else "as before"
            lines.append(f"| {name} | {sides[0]} | {sides[1]} | {found} |")
        return "\n".join([*lines, "", ""])


def compare_curves(
    now: Sequence[Mapping[str, Any]], baseline: object, tolerance: float, *, is_part: bool = False
) -> Comparison:
    """Curves against a baseline: a side has moved by more than the tolerance, or a proof or a curve is lost.

    Parameters
    ----------
    is_part : whether only some curves of the baseline were asked for, so that none is missed

    Raises
    ------
    InputError
        when the baseline does not hold curves.
    """
    known = {curve_name(curve): curve for curve in _curves_of(baseline)}
    rows: list[tuple[str, Mapping[str, Any] | None, Mapping[str, Any] | None, tuple[str, ...]]] = []
    for curve in now:
        name = curve_name(curve)
        old = known.pop(name, None)
        if old is None:
            rows.append((name, None, curve, ("not in the baseline",)))
            continue
        texts = [text for side in SIDES if (text := _moved(side, old[side], curve[side], tolerance))]
        if old["verified"] and not curve["verified"]:
            texts.append("the controller is no longer verified")
        rows.append((name, old, curve, tuple(texts)))
    if not is_part:
        rows += [(name, old, None, ("in the baseline only",)) for name, old in known.items()]
    return Comparison(tuple(rows), tolerance)


def _moved(side: str, before: float | None, now: float | None, tolerance: float) -> str:
    """What happened to one side; empty when nothing did."""
    if before is None or now is None:
        return "" if before == now else f"{side} was {_rad_s(before)} and is {_rad_s(now)}"
    if abs(now - before) <= tolerance * before:
        return ""
    return f"{side} moved from {_rad_s(before)} to {_rad_s(now)}, by {100.0 * (now / before - 1.0):+.2f} %"


def _curves_of(document: object) -> list[Mapping[str, Any]]:
    curves = document.get("curves") if isinstance(document, dict) else None
    if not isinstance(curves, list) or not all(_is_curve(curve) for curve in curves):
        raise InputError('it does not hold "curves" as magbear limits --json prints them')
    return curves


def _is_curve(curve: object) -> bool:
    if not isinstance(curve, dict) or not isinstance(curve.get("over"), dict) or "verified" not in curve:
        return False
    mass = curve.get("mass_kg")
    return all(_is_number(value) for value in (mass if isinstance(mass, list) else [mass])) and all(
        side in curve and (curve[side] is None or (_is_number(curve[side]) and curve[side] > 0)) for side in SIDES
    )


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _rad_s(value: float | None) -> str:
    return "none" if value is None else f"{value:.1f} rad/s"


def _spoken(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)

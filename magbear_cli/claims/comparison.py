"""When is adaptive control needed? Linear and adaptive controllers over all that chapter 4 asks, in one table."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from magbear_cli.claims.evidence import Case, Evidence, Run, Where
from magbear_cli.claims.ledger import Listing
from magbear_cli.claims.words import told
from magbear_cli.study.naming import controller_name
from magbear_cli.study.outcome import StudyResults

STEPS_M = (1e-5, 1e-4, 2e-4)
ADAPTIVE = "adaptive_lfe"


@dataclass(frozen=True)
class Comparison:
    """The answer in a sentence, the table it rests on, and the datasets."""

    sentence: str
    listing: Listing
    evidence: tuple[str, ...]

    def document(self) -> dict[str, object]:
        """The comparison as plain values."""
        rows = [dict(zip(self.listing.heads, row, strict=True)) for row in self.listing.rows]
        return {"sentence": self.sentence, "table": rows, "evidence": list(self.evidence)}


@dataclass(frozen=True)
class _Design:
    """A controller with its largest tracking error for each rotor and step, as a part of it; infinite if lost."""

    name: str
    states: str
    is_adaptive: bool
    errors: Mapping[tuple[str, float], float]
    peak_current_a: float


def compare(where: Iterable[Where], studies: Mapping[str, StudyResults]) -> Comparison | None:
    """The comparison, if all of its studies are at hand.

    An error is the largest distance from the reference model over masses, gravity and time.
    """
    chosen = list(where)
    if not chosen or not all(str(entry["study"]) in studies for entry in chosen):
        return None
    evidence = Evidence(studies, {str(number): entry for number, entry in enumerate(chosen)})
    designs = [_design(case) for name in evidence.cases for case in evidence.all(name)]
    rotors = list(dict.fromkeys(rotor for design in designs for rotor, _ in design.errors))
    heads = ["design", "states", "peak current (A)"]
    heads += [f"{rotor}, {told(1e6 * step)} µm (%)" for rotor in rotors for step in STEPS_M]
    rows = tuple(_row(design, rotors) for design in designs)
    return Comparison(_sentence(designs, rotors), Listing(tuple(heads), rows), tuple(evidence.read))


def _design(case: Case) -> _Design:
    options = case.outcome.inputs["controller"]
    groups: dict[tuple[str, float], list[Run]] = {}
    for run in case.steps():
        groups.setdefault((_rotor(run), run.step.step_m), []).append(run)
    errors = {key: max(_error(run) for run in runs) for key, runs in groups.items()}
    currents = [run.figure("peak_current_a") for runs in groups.values() for run in runs if run.ended_well]
    order = case.outcome.summary.order
    is_adaptive = options["method"] == ADAPTIVE
    return _Design(
        _name(case), "–" if order is None else str(order), is_adaptive, errors, max(currents, default=float("inf"))
    )


def _name(case: Case) -> str:
    options = case.outcome.inputs["controller"]
    if options["method"] == ADAPTIVE:
        rate = "" if options.get("adaptation_input_gain_m_per_s2_a") is None else ", no b in the rate"
        return f"adaptive, γ = {told(options['gamma'])}, trigger on {options['trigger']}{rate}"
    limit = case.outcome.omega_c_rad_s
    asked = [weight_text(case)] + ([] if limit is None else [f"ω_c = {told(limit, 6)}"])
    return ", ".join([controller_name(options), *asked])


def weight_text(case: Case) -> str:
    """W1 of a case; in full where it is a lag."""
    num, den = (case.outcome.inputs["performance"][part] for part in ("num", "den"))
    if len(num) == 1 and len(den) == 2:
        return f"W1 = {told(num[0] / den[0])}/(s + {told(den[1] / den[0])})"
    return "W1 of higher order"


def _rotor(run: Run) -> str:
    rotor = run.step.scenario.get("rotor")
    return "rigid" if not rotor else f"c1 = {told(float(rotor['damping_n_s_per_m']))}"


def _error(run: Run) -> float:
    return run.largest_error_m() / abs(run.step.step_m) if run.is_stable else float("inf")


def _row(design: _Design, rotors: Sequence[str]) -> tuple[str, ...]:
    cells = (design.errors.get((rotor, step), np.nan) for rotor in rotors for step in STEPS_M)
    shown = ("lost" if np.isinf(value) else _percent(value) for value in cells)
    return design.name, design.states, told(design.peak_current_a, 3), *shown


def _percent(value: float) -> str:
    """Two digits of it, and no power of ten."""
    return f"{float(f'{100.0 * value:.2g}'):g}"


def _sentence(designs: Sequence[_Design], rotors: Sequence[str]) -> str:
    """Who holds the reference best on each rotor, by the largest error over all steps."""
    parts = []
    for rotor in rotors:
        best = {
            kind: min((design for design in designs if design.is_adaptive is kind), key=lambda one: _worst(one, rotor))
            for kind in (False, True)
            if any(design.is_adaptive is kind for design in designs)
        }
        told_best = []
        for kind, design in best.items():
            worst = _worst(design, rotor)
            name = "adaptive" if kind else f"linear ({design.name}, {design.states} states)"
            told_best.append(f"{name} " + ("loses the rotor" if np.isinf(worst) else f"within {_percent(worst)} %"))
        parts.append(f"{rotor}: {'; '.join(told_best)}")
    return "Largest distance from the reference model over all steps, masses and gravity. " + ". ".join(parts) + "."


def _worst(design: _Design, rotor: str) -> float:
    return max(value for (own, _), value in design.errors.items() if own == rotor)

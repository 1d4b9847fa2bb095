"""The rows of the report's tables: numbers as a reader wants them, and words where a number would mislead."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from magbear_cli.errors import Status
from magbear_cli.report.members import Members
from magbear_cli.report.numbers import (
    MICROMETRES,
    MILLISECONDS,
    MISSING,
    at_least,
    at_most,
    kilograms,
    mass_text,
    shortest,
    significant,
)
from magbear_cli.report.series import Labels, file_stem, mass_ends_kg
from magbear_cli.report.step_words import prefilter_text, step_text
from magbear_cli.report.verdict import STATUS_MARKS, STATUS_WORDS
from magbear_cli.study.members import worst_member
from magbear_cli.study.outcome import CaseOutcome, StepOutcome, StudyResults, Summary
from magbear_cli.study.summary import repro_line

STUDY_FILE = "study.yaml"
_PER_MICROMETRE = 1e-6


@dataclass(frozen=True)
class CaseRow:
    """One case, once."""

    anchor: str
    case_id: str
    status: Status
    mark: str
    words: str
    sentence: str
    controller: str
    cells: tuple[str, ...]
    verified: str


@dataclass(frozen=True)
class StepRow:
    """One step response."""

    mass: str
    cells: tuple[str, ...]
    end: str  # how the run ended, in words


@dataclass(frozen=True)
class StepGroup:
    """The step responses of one kind that belong to one case."""

    anchor: str
    case: str
    what: str
    rows: tuple[StepRow, ...]


@dataclass(frozen=True)
class Failure:
    """A case that did not meet the specification or was not computed, with what to do about it."""

    anchor: str
    case_id: str
    what: str
    words: str
    sentence: str
    repro: str


CASE_HEADS = (
    ("mass", "kg"),
    ("ω_c", "rad/s"),
    ("worst case", "real mass"),
    ("no controller below", "proven"),
    ("peak µ", "[lower, upper]"),
    ("order", "states"),
    ("peak |K|", "A/µm"),
    ("peak |KS|", "A/µm"),
    ("gain margin", "factors"),
    ("phase margin", "deg"),
    ("peak |S|", "ISO zone"),
)
STEP_HEADS = (
    ("prefilter", ""),
    ("settling", "ms"),
    ("overshoot", "%"),
    ("rise", "ms"),
    ("peak current", "A"),
    ("final error", "µm"),
)


def case_rows(results: StudyResults, labels: Labels) -> list[CaseRow]:
    """A row a case, in the order of the study."""
    return [
        CaseRow(
            anchor=f"case-{file_stem(outcome, results.outcomes)}",
            case_id=outcome.case_id,
            status=outcome.status,
            mark=STATUS_MARKS[outcome.status],
            words=STATUS_WORDS[outcome.status],
            sentence=outcome.sentence,
            controller=labels.controller(outcome),
            cells=_case_cells(outcome),
            verified="yes" if outcome.summary.verified else "no",
        )
        for outcome in results.outcomes
    ]


def case_columns(outcomes: Sequence[CaseOutcome]) -> dict[str, list[object]]:
    """Every case of a study whose page does not show them all, a list a column."""
    figures = ("level", "peak_mu", "worst_case", "lower_bound", "order", "peak_gain_a_per_m", "peak_ks_a_per_m")
    masses = [mass_ends_kg(outcome) for outcome in outcomes]
    return {
        "case_id": [outcome.case_id for outcome in outcomes],
        "status": [outcome.status.value for outcome in outcomes],
        "method": [outcome.method for outcome in outcomes],
        "mass_low_kg": [low for low, _ in masses],
        "mass_high_kg": [high for _, high in masses],
        "omega_c_rad_s": [outcome.omega_c_rad_s for outcome in outcomes],
        **{name: [getattr(outcome.summary, name) for outcome in outcomes] for name in figures},
        "verified": [int(outcome.summary.verified) for outcome in outcomes],
        "sentence": [outcome.sentence for outcome in outcomes],
    }


def _case_cells(outcome: CaseOutcome) -> tuple[str, ...]:
    summary = outcome.summary
    mu = MISSING
    if summary.peak_mu is not None:
        mu = f"[{significant(summary.peak_mu_lower)}, {significant(summary.peak_mu)}]"
    return (
        mass_text(outcome.mass_kg).removesuffix(" kg"),
        _limit_text(outcome),
        significant(summary.worst_case),
        at_least(summary.lower_bound),
        mu,
        MISSING if summary.order is None else str(summary.order),
        _scaled(summary.peak_gain_a_per_m, _PER_MICROMETRE),
        _scaled(summary.peak_ks_a_per_m, _PER_MICROMETRE),
        _margin(summary.gain_margin_low, summary.gain_margin_high),
        significant(summary.phase_margin_deg),
        _peak_and_zone(summary),
    )


def _limit_text(outcome: CaseOutcome) -> str:
    """The bandwidth limit that was given, or the bracket of the one that was sought."""
    low, high = outcome.summary.omega_c_infeasible_rad_s, outcome.summary.omega_c_feasible_rad_s
    if low is not None or high is not None:
        return f"{significant(low, 4)} … {significant(high, 4)}"
    return "none" if outcome.omega_c_rad_s is None else shortest(outcome.omega_c_rad_s)


def _peak_and_zone(summary: Summary) -> str:
    if summary.peak_sensitivity is None:
        return MISSING
    return f"{significant(summary.peak_sensitivity)}{'' if summary.iso_zone is None else f' · {summary.iso_zone}'}"


def _margin(low: float | None, high: float | None) -> str:
    return MISSING if low is None and high is None else f"{significant(low)} … {significant(high)}"


def _scaled(value: float | None, factor: float, digits: int = 3) -> str:
    return significant(None if value is None else value * factor, digits)


def step_groups(results: StudyResults, labels: Labels) -> list[StepGroup]:
    """The step responses, by case and kind, in the order of the study."""
    groups: dict[tuple[str, str, str], list[StepRow]] = {}
    for outcome in results.outcomes:
        anchor = f"case-{file_stem(outcome, results.outcomes)}"
        for step in outcome.steps:
            row = StepRow(f"{kilograms(step.mass_kg)} kg", _step_cells(step), _end(step))
            groups.setdefault((anchor, labels.case(outcome), step_text(step)), []).append(row)
    return [StepGroup(*key, tuple(rows)) for key, rows in groups.items()]


def _step_cells(step: StepOutcome) -> tuple[str, ...]:
    return (
        "none" if not step.scenario.get("prefilter") else prefilter_text(step).removeprefix("prefilter "),
        _scaled(step.settling_time_s, MILLISECONDS),
        _scaled(step.overshoot, 100.0, 2),
        _scaled(step.rise_time_s, MILLISECONDS),
        significant(step.peak_current_a),
        _scaled(step.final_error_m, MICROMETRES, 2),
    )


def _end(step: StepOutcome) -> str:
    """How a run without a settling time ended, in words."""
    last = f"after {significant(float(step.time_s[-1]) * MILLISECONDS)} ms" if step.time_s.size else ""
    words = {"touched_down": f"touches down {last}", "not_finite": "is not finite", "diverged": f"diverges {last}"}
    words["not_begun"] = f"cannot begin: {step.sentence}"
    if step.end in words:
        return words[step.end].strip()
    return "not settled at the end" if step.settling_time_s is None else "settled"


def failures(results: StudyResults, labels: Labels) -> list[Failure]:
    """Every case that is not ``ok``, with its reason and the line that repeats it."""
    return [
        Failure(
            anchor=f"case-{file_stem(outcome, results.outcomes)}",
            case_id=outcome.case_id,
            what=labels.case(outcome),
            words=STATUS_WORDS[outcome.status],
            sentence=outcome.sentence or "no reason was given",
            repro=repro_line(STUDY_FILE, outcome.case_id),
        )
        for outcome in results.outcomes
        if outcome.status != Status.OK
    ]


def case_figures(outcome: CaseOutcome) -> list[tuple[str, str]]:
    """What the tables leave out, as pairs of words and figures."""
    summary, members = outcome.summary, Members(outcome)
    pairs = [
        ("level by the method's own account", significant(summary.level)),
        ("worst case proven below", at_most(summary.worst_case_proven)),
        (f"worst {members.noun}", _worst_member(summary, members)),
        ("worst frequency", _unit(summary.worst_omega_rad_s, "rad/s")),
        ("flatness of µ, 10 … 10⁵ rad/s", significant(summary.mu_flatness, 2)),
        ("gain margin, factors", _margin(summary.gain_margin_low, summary.gain_margin_high)),
        ("phase margin", _unit(summary.phase_margin_deg, "deg")),
        ("disk margin", significant(summary.disk_margin)),
        ("peak |S|, with its zone of ISO 14839-3", _peak_and_zone(summary)),
        ("largest real part of a pole", _unit(summary.max_pole_real_rad_s, "rad/s")),
    ]
    return [(name, text) for name, text in pairs if text != MISSING]


def statistics(outcome: CaseOutcome) -> list[tuple[str, str]]:
    """What the method and the check count, by name."""
    return [(name.replace("_", " "), _count(float(value))) for name, value in sorted(outcome.statistics.items())]


def _count(value: float) -> str:
    return shortest(value) if value.is_integer() else significant(value, 4)


def _worst_member(summary: Summary, members: Members) -> str:
    worst = worst_member(summary)
    return MISSING if worst is None else members.name(worst)


def _unit(value: float | None, unit: str) -> str:
    if value is None or math.isnan(value):
        return MISSING
    return f"{significant(value)} {unit}"


def provenance_rows(results: StudyResults) -> Sequence[tuple[str, str]]:
    """Where the numbers come from, in the order given."""
    return [(str(name).replace("_", " "), str(value)) for name, value in results.provenance.items()]

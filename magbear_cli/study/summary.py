"""The JSON documents of a study: the public keys of each case and of the whole, plain and finite.

The keys are a public interface. Figures without a meaning are null, and so are NaN and infinity, which JSON does not
know. Keys beyond the first thirteen were added later, at the end.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from magbear_cli.study.outcome import CaseOutcome, StepOutcome, StudyResults

STEP_FIGURES = ("settling_time_s", "overshoot", "peak_current_a")
FIRST_FIGURES = ("peak_mu", "worst_case", "order", "peak_gain_a_per_m", "peak_ks_a_per_m")
LATER_FIGURES = (
    "level",
    "peak_mu_lower",
    "worst_mass_kg",
    "worst_negative_stiffness_n_per_m",
    "worst_current_stiffness_n_per_a",
    "worst_omega_rad_s",
    "peak_sensitivity",
    "gain_margin_low",
    "gain_margin_high",
    "phase_margin_deg",
    "disk_margin",
    "max_pole_real_rad_s",
    "mu_flatness",
    "worst_case_proven",
    "lower_bound",
    "omega_c_feasible_rad_s",
    "omega_c_infeasible_rad_s",
)


def case_document(outcome: CaseOutcome, study: str = "study.yaml") -> dict[str, Any]:
    """The document of one case; ``study`` is the file named in the line that repeats a case without an answer."""
    summary = outcome.summary
    return {
        "id": outcome.case_id,
        "status": outcome.status.value,
        "method": outcome.method,
        "mass_kg": outcome.mass_kg,
        "omega_c_rad_s": outcome.omega_c_rad_s,
        **_figures(summary, FIRST_FIGURES),
        "verified": bool(summary.verified),
        "sentence": outcome.sentence,
        "steps": [step_document(step) for step in outcome.steps],
        "index": outcome.index,
        **_figures(summary, LATER_FIGURES),
        "iso_zone": summary.iso_zone,
        "verification": summary.verification_sentence,
        "repro": None if outcome.status.is_answer else repro_line(study, outcome.case_id),
    }


def step_document(step: StepOutcome) -> dict[str, Any]:
    """The document of one step response, without its samples."""
    return {
        "mass_kg": plain_number(step.mass_kg),
        "step_m": plain_number(step.step_m),
        "model": step.model,
        "controller": step.controller,
        **_figures(step, STEP_FIGURES),
        "touched_down": step.touched_down,
        "end": step.end,
        "sentence": step.sentence,
        **_figures(step, ("rise_time_s", "final_error_m")),
        "prefilter": step.scenario.get("prefilter") is not None,
    }


def study_document(results: StudyResults, results_path: PurePath, report_path: PurePath | None) -> dict[str, Any]:
    """The document of a run: the study's name, where its files are, and every case in order."""
    study = str(results_path.parent / "study.yaml")
    return {
        "study": results.name,
        "results": str(results_path),
        "report": None if report_path is None else str(report_path),
        "cases": [case_document(outcome, study) for outcome in results.outcomes],
    }


def repro_line(study: str, case_id: str) -> str:
    """The command that repeats one case alone and shows what happens."""
    return f"magbear run {shlex.quote(study)} --case {case_id} --debug"


def plain_number(value: object) -> float | int | None:
    """A number as JSON knows it; None for NaN, infinity and what is missing."""
    if value is None:
        return None
    number = float(value)  # type: ignore[arg-type]
    if not math.isfinite(number):
        return None
    return int(number) if hasattr(value, "__index__") else number


def _figures(source: object, names: Iterable[str]) -> dict[str, float | int | None]:
    return {name: plain_number(getattr(source, name)) for name in names}

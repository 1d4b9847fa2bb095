"""Where two studies say different things about the same cases."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from magbear_cli.study.outcome import CaseOutcome, StudyResults
from magbear_cli.study.plan import canonical_json
from magbear_cli.study.summary import case_document

NOT_COMPARED = frozenset({"id", "index", "sentence", "repro", "verification", "steps"})
WHERE_NOT_WHAT = frozenset(
    {"worst_mass_kg", "worst_negative_stiffness_n_per_m", "worst_current_stiffness_n_per_a", "worst_omega_rad_s"}
)  # the place of a flat maximum is arbitrary
FRACTIONS = frozenset({"mu_flatness", "overshoot"})  # differ by what they add to one: near zero all is rounding


@dataclass(frozen=True)
class Difference:
    """One figure of one case that differs; a case that only one study has differs in ``case``."""

    case: str
    figure: str
    first: Any
    second: Any

    def __str__(self) -> str:
        """One line for the user."""
        return f"{self.case}: {self.figure}: {_told(self.first)} != {_told(self.second)}"

    def document(self) -> dict[str, Any]:
        """The difference as a plain JSON value."""
        return {"case": self.case, "figure": self.figure, "first": self.first, "second": self.second}


def compare_studies(first: StudyResults, second: StudyResults, rtol: float) -> list[Difference]:
    """All differences beyond the relative tolerance, in the order of the first study.

    Cases are matched by method and options, mass and bandwidth limit, so that a changed weight or bearing shows as
    changed figures and not as other cases; equal ones are matched in their order.
    """
    one, two = _labelled(first), _labelled(second)
    found = [
        difference
        for label, outcome in one.items()
        if label in two
        for difference in _case_differences(label, outcome, two[label], rtol)
    ]
    found += [Difference(label, "case", "present", "missing") for label in one if label not in two]
    found += [Difference(label, "case", "missing", "present") for label in two if label not in one]
    return found


def _labelled(study: StudyResults) -> dict[str, CaseOutcome]:
    seen: Counter[str] = Counter()
    labelled = {}
    for outcome in study.outcomes:
        options = {key: value for key, value in outcome.inputs["controller"].items() if key not in {"method", *"abcd"}}
        mass = outcome.mass_kg
        label = " ".join(
            [
                outcome.method,
                *(f"{key}={value}" for key, value in sorted(options.items())),
                f"m={canonical_json(mass)} kg",
                "no bandwidth limit" if outcome.omega_c_rad_s is None else f"omega_c={outcome.omega_c_rad_s:g} rad/s",
            ]
        )
        seen[label] += 1
        labelled[label if seen[label] == 1 else f"{label} (#{seen[label]})"] = outcome
    return labelled


def _case_differences(label: str, first: CaseOutcome, second: CaseOutcome, rtol: float) -> Iterator[Difference]:
    one, two = case_document(first), case_document(second)
    for figure in one:
        if figure in NOT_COMPARED | WHERE_NOT_WHAT:
            continue
        if not _agree(one[figure], two[figure], rtol, float(figure in FRACTIONS)):
            yield Difference(label, figure, one[figure], two[figure])
    if len(first.steps) != len(second.steps):
        yield Difference(label, "steps", len(first.steps), len(second.steps))
        return
    for number, (step, other) in enumerate(zip(one["steps"], two["steps"], strict=True), start=1):
        for figure in step:
            scale = abs(first.steps[number - 1].step_m) if figure == "final_error_m" else float(figure in FRACTIONS)
            if figure != "sentence" and not _agree(step[figure], other[figure], rtol, scale):
                yield Difference(label, f"step {number} {figure}", step[figure], other[figure])


def _agree(first: object, second: object, rtol: float, scale: float) -> bool:
    """Whether two values are the same within the tolerance of themselves, or of the scale on which they count."""
    both_numbers = all(isinstance(x, int | float) and not isinstance(x, bool) for x in (first, second))
    if both_numbers:
        return math.isclose(float(first), float(second), rel_tol=rtol, abs_tol=max(rtol * scale, 1e-15))  # type: ignore[arg-type]
    return first == second


def _told(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)

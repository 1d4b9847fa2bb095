"""The verdict of a study in sentences, computed from its cases; proven and not found are kept apart."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from magbear_cli.errors import Status
from magbear_cli.report.limit_curves import LIMIT, brackets
from magbear_cli.report.numbers import count_text, mass_text, omega_text, significant
from magbear_cli.report.selection import MOST_SWEPT
from magbear_cli.report.series import Labels, problem_key
from magbear_cli.report.sweep import crossings, find_sweep, worst_case
from magbear_cli.study.outcome import CaseOutcome, StudyResults

STATUS_WORDS = {
    Status.OK: "achieved",
    Status.INFEASIBLE: "proven impossible",
    Status.NOT_ACHIEVED: "not achieved",
    Status.UNVERIFIED: "not verified",
    Status.UNSTABLE: "unstable",
    Status.TIMEOUT: "stopped: too slow",
    Status.CRASHED: "crashed",
    Status.FAILED: "failed",
}
STATUS_MARKS = {
    Status.OK: "●",
    Status.INFEASIBLE: "×",
    Status.NOT_ACHIEVED: "▽",
    Status.UNVERIFIED: "?",
    Status.UNSTABLE: "!",
    Status.TIMEOUT: "–",
    Status.CRASHED: "–",
    Status.FAILED: "–",
}
_ONE = {
    Status.INFEASIBLE: "is proven impossible: no linear controller meets its specification",
    Status.NOT_ACHIEVED: "was not achieved: its method found no controller that meets the specification, which does "
    "not prove that there is none",
    Status.UNVERIFIED: "looks good to its method but did not pass the independent check",
    Status.UNSTABLE: "is unstable for some mass of its range",
    Status.TIMEOUT: "was stopped at its time limit",
    Status.CRASHED: "crashed",
    Status.FAILED: "could not be computed",
}
_MANY = {
    Status.INFEASIBLE: "are proven impossible: no linear controller meets their specification",
    Status.NOT_ACHIEVED: "were not achieved: their methods found no controller that meets the specification, which "
    "does not prove that there is none",
    Status.UNVERIFIED: "look good to their methods but did not pass the independent check",
    Status.UNSTABLE: "are unstable for some mass of their range",
    Status.TIMEOUT: "were stopped at their time limit",
    Status.CRASHED: "crashed",
    Status.FAILED: "could not be computed",
}
_MOST_PROBLEMS, _MOST_CURVES, _MOST_BRACKETS = 3, 4, 12


def headline(outcomes: Sequence[CaseOutcome]) -> str:
    """How many cases meet their specification, and whether an independent check says so too."""
    if not outcomes:
        return "The study has no cases yet."
    met = [outcome for outcome in outcomes if outcome.status == Status.OK]
    verified = sum(outcome.summary.verified for outcome in met)
    if not met:
        some = "The case does not meet" if len(outcomes) == 1 else f"None of {len(outcomes)} cases meets"
        return f"{some} the specification."
    verb = "meets" if len(met) == 1 else "meet"
    who = "The case" if len(outcomes) == 1 else f"{len(met)} of {len(outcomes)} cases"
    if len(met) == len(outcomes) > 1:
        who = f"All {len(met)} cases"
    if verified == len(met):
        how = "proven for every mass and frequency"
    elif verified:
        how = f"{verified} of them proven for every mass and frequency"
    else:
        how = "by the design's own account; none is verified"
    return f"{who} {verb} the specification, {how}."


def remarks(results: StudyResults, labels: Labels) -> list[str]:
    """What else there is to say: the other endings, the simplest controllers, the limits, the step responses."""
    outcomes = results.outcomes
    told = []
    for status, number in sorted(Counter(outcome.status for outcome in outcomes).items(), key=_by_status):
        if status != Status.OK:
            predicate = _ONE[status] if number == 1 else _MANY[status]
            told.append(f"{count_text(number, 'case')} {predicate}.")
    told += _brackets(outcomes, labels)
    told += _simplest(outcomes, labels)
    told += _limits(results, labels)
    return told + _steps(outcomes)


def _by_status(item: tuple[Status, int]) -> int:
    return list(Status).index(item[0])


def _simplest(outcomes: Sequence[CaseOutcome], labels: Labels) -> list[str]:
    """For each problem that several controllers meet: the one with the fewest states, beside the best."""
    groups: dict[str, list[CaseOutcome]] = {}
    for outcome in outcomes:
        known = outcome.method != LIMIT and outcome.summary.order is not None and worst_case(outcome) is not None
        if outcome.status == Status.OK and outcome.summary.verified and known:
            groups.setdefault(problem_key(outcome), []).append(outcome)
    several = [group for group in groups.values() if len(group) > 1]
    if len(several) > _MOST_PROBLEMS:
        fewest = [min(case.summary.order or 0 for case in group) for group in several]
        states = str(min(fewest)) if min(fewest) == max(fewest) else f"{min(fewest)} to {max(fewest)}"
        noun = "state" if states == "1" else "states"
        return [f"{len(several)} problems have several verified controllers; the simplest of each has {states} {noun}."]
    told = []
    for group in several:
        simple = min(group, key=lambda case: (case.summary.order or 0, worst_case(case) or 0.0))
        best = min(group, key=lambda case: worst_case(case) or 0.0)
        limit = f" at ω_c = {omega_text(simple.omega_c_rad_s)}" if simple.omega_c_rad_s is not None else ""
        text = (
            f"For {mass_text(simple.mass_kg)}{limit} the simplest verified controller is {labels.controller(simple)} "
            f"with {count_text(simple.summary.order or 0, 'state')}: worst case {significant(worst_case(simple))}"
        )
        if best is simple:
            told.append(f"{text}, and no other case of the study does better.")
        else:
            told.append(
                f"{text}; the best of the study is {labels.controller(best)} with "
                f"{count_text(best.summary.order or 0, 'state')}: {significant(worst_case(best))}."
            )
    return told


def _brackets(outcomes: Sequence[CaseOutcome], labels: Labels) -> list[str]:
    """Both proven sides of every limit that was sought."""
    told = []
    for outcome in brackets(outcomes):
        low, high = outcome.summary.omega_c_infeasible_rad_s, outcome.summary.omega_c_feasible_rad_s
        impossible = "" if low is None else f"no linear controller meets ω_c = {significant(low, 4)} rad/s"
        order = count_text(outcome.summary.order or 0, "state")
        met = "" if high is None else f"one with {order} meets {significant(high, 4)} rad/s"
        what = labels.problem(outcome)
        told.append(f"{what}: {', and '.join(part for part in (impossible, met) if part)}; proven.")
    if len(told) > _MOST_BRACKETS:
        return [f"{len(told)} limits of linear control are bracketed; the figure and the table have them."]
    return told


def _limits(results: StudyResults, labels: Labels) -> list[str]:
    """Where the exact worst case crosses level 1 along a sweep."""
    sweep = find_sweep(results.outcomes, labels) if len(results.outcomes) <= MOST_SWEPT else None
    if sweep is None:
        return []
    told = []
    for curve in sweep.curves:
        places = [crossing.text(sweep.axis) for crossing in crossings(curve, worst_case, sweep.axis)]
        if places:
            told.append(f"{curve.label}: the worst case reaches 1 {' and '.join(places)}.")
    if len(told) > _MOST_CURVES:
        return [f"{len(told)} curves reach level 1 within the sweep; the limitation curves say where."]
    return told


def _steps(outcomes: Sequence[CaseOutcome]) -> list[str]:
    steps = [step for outcome in outcomes for step in outcome.steps]
    if not steps:
        return []
    settled = sum(step.settling_time_s is not None for step in steps)
    fallen = sum(step.touched_down for step in steps)
    broken = sum(step.end in {"not_finite", "diverged"} for step in steps)
    never = sum(step.end == "not_begun" for step in steps)
    rest = len(steps) - settled - fallen - broken - never
    parts = [f"{settled} settled"]
    parts += [f"{fallen} touched down"] if fallen else []
    parts += [f"{broken} diverged"] if broken else []
    parts += [f"{never} could not begin"] if never else []
    parts += [f"{rest} had not settled at the end"] if rest else []
    return [f"Of {count_text(len(steps), 'step response')}, {', '.join(parts)}."]

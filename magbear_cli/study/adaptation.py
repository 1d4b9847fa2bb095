"""The adaptive controller as a case: its runs are simulated, and how far its gain may go is found by bisection.

There is no linear controller in it: no mu, no worst case, no frequency study, and nothing is proven. What can be said
is whether the runs that were asked for stay bounded. A run does when it goes to its end inside the gap and its error
does not grow: where the largest error of its last quarter is outside the sphere, it is no larger than that of the
quarter before, to a twentieth. The same is asked of the speed, which shows a fast oscillation that is still small.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from magbear_cli.errors import Status
from magbear_cli.model.adaptive_law import AdaptiveLaw
from magbear_cli.model.bearing import Bearing
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.table import Column, Table
from magbear_cli.simulation.adaptive import simulate_adaptive_step
from magbear_cli.simulation.scenario import StepScenario
from magbear_cli.simulation.step import StepResponse
from magbear_cli.study.outcome import CaseOutcome, StepOutcome
from magbear_cli.study.simulating import Simulated, one_by_one, simulated
from magbear_cli.synthesis.adaptive_lfe import AdaptiveDesign, AdaptiveLfeOptions, design_adaptive_lfe

GROWTH = 1.05  # of the error from one quarter to the next: more is growing
ROOM = 1.02  # of rho + sigma: an error up to this is one within the sphere, whose border the switch lags behind
PER_DECADE = 2  # gains of the first scan
PROVEN_OF_NOTHING = "a nonlinear controller: its responses are simulated, nothing is proven of it"

Inputs = Mapping[str, Any]


def adaptive_case(outcome: CaseOutcome, problem: ControlProblem) -> CaseOutcome:
    """The case of an adaptive law: ``unstable`` when a run is not bounded, else ``unverified``.

    ``statistics`` holds those of the law, the largest tracking error over the second halves of the runs, and for each
    run, as ``step_01_…``, its errors, its switchings, its final estimate, and whether it stays bounded.
    """
    design = build_design(problem, outcome.inputs["controller"])
    runs = _runs(outcome.inputs, design.law)
    wrong = [sentence for sentence in (unbounded(design.law, run) for run in runs) if sentence]
    statistics = dict(design.statistics) | _of_steps(design.law, runs)
    steps = tuple(step for step, _ in runs)
    if any(step.end == "not_begun" for step in steps):
        return replace(outcome, sentence=wrong[0], steps=steps, statistics=statistics)
    if wrong:
        return replace(outcome, status=Status.UNSTABLE, sentence=wrong[0], steps=steps, statistics=statistics)
    sentence = PROVEN_OF_NOTHING if runs else "a nonlinear controller, and no run was asked for: nothing is known of it"
    return replace(outcome, status=Status.UNVERIFIED, sentence=sentence, steps=steps, statistics=statistics)


def build_design(problem: ControlProblem, controller: Inputs) -> AdaptiveDesign:
    """The law that the options of a case ask for; those of the search for a gain have no say in it."""
    known = {key: value for key, value in controller.items() if key not in {"method", "low", "high", "tolerance"}}
    gain = known["gain"]
    return design_adaptive_lfe(
        problem, AdaptiveLfeOptions(**{**known, "gain": None if gain is None else (gain[0], gain[1])})
    )


def _runs(inputs: Inputs, law: AdaptiveLaw) -> tuple[Simulated, ...]:
    return simulated(inputs, one_by_one(partial(_step, law)))


def _step(law: AdaptiveLaw, bearing: Bearing, scenario: StepScenario) -> StepResponse:
    return simulate_adaptive_step(bearing, law, scenario)


def unbounded(law: AdaptiveLaw, run: Simulated) -> str:
    """Why a run is not bounded; empty when it is."""
    step, figures = run
    name = f"{step.mass_kg:.3g} kg, {1e6 * step.step_m:.4g} µm"
    if step.end != "finished":
        return f"{name}: {step.sentence}"
    for what, border in (("error_m", law.outer_m), ("speed_error_m_per_s", law.omega_rad_s * law.outer_m)):
        before, last = figures[f"third_quarter_{what}"], figures[f"fourth_quarter_{what}"]
        if last > max(GROWTH * before, border):
            growth = 100.0 * (last / before - 1.0)
            return f"{name}: the error still grows at the end, by {growth:.2g} % from one quarter to the next"
    return ""


def _of_steps(law: AdaptiveLaw, runs: Sequence[Simulated]) -> dict[str, float]:
    """The statistics of the runs under the numbers of their steps."""
    found: dict[str, float] = {}
    for number, run in enumerate(runs, 1):
        name = f"step_{number:02d}"
        found |= {f"{name}_{key}": float(value) for key, value in run[1].items()}
        found[f"{name}_bounded"] = float(not unbounded(law, run))
    if runs:
        found["tracking_error_m"] = _error(law, runs)
    return found


def _error(law: AdaptiveLaw, runs: Sequence[Simulated]) -> float:
    """The largest tracking error over the second halves of the runs; infinite when one is not bounded."""
    if any(unbounded(law, run) for run in runs):
        return float("inf")
    return max((figures["tracking_error_m"] for _, figures in runs), default=float("nan"))


@dataclass(frozen=True)
class _Trial:
    """The runs with one gain."""

    gamma: float
    error_m: float
    steps: tuple[StepOutcome, ...]

    @property
    def stable(self) -> bool:
        return bool(np.isfinite(self.error_m))


class _Trials:
    """The runs of a case with the gains that were tried."""

    def __init__(self, inputs: Inputs, law: AdaptiveLaw) -> None:
        self.inputs, self.law = inputs, law
        self.done: list[_Trial] = []

    def at(self, gamma: float) -> _Trial:
        """The runs with one gain, kept."""
        law = replace(self.law, gamma=gamma)
        runs = _runs(self.inputs, law)
        self.done.append(_Trial(gamma, _error(law, runs), tuple(step for step, _ in runs)))
        return self.done[-1]

    def table(self) -> Table:
        """Gain, error and whether the runs stay bounded, by rising gain."""
        trials = sorted(self.done, key=lambda trial: trial.gamma)
        return Table(
            (
                Column("gamma", np.array([trial.gamma for trial in trials]), "1", "adaptation gain"),
                Column(
                    "tracking_error_m",
                    np.array([trial.error_m if trial.stable else np.nan for trial in trials]),
                    "m",
                    "largest tracking error in the second halves of the runs; empty when unbounded",
                ),
                Column(
                    "stable", np.array([float(trial.stable) for trial in trials]), "1", "1 when every run is bounded"
                ),
            ),
            "the adaptation gains that were tried",
        )


def adaptive_limit_case(outcome: CaseOutcome, problem: ControlProblem) -> CaseOutcome:
    """The largest gain below the first at which a run is not bounded, by a scan and a bisection in its logarithm.

    ``statistics``: ``gamma_stable`` and ``gamma_unstable``, the ends of the bracket, ``gamma_within_sphere``, the
    largest gain below it whose error stays within rho + sigma, ``tracking_error_m`` at the stable end, and
    ``stable_again`` when the scan found a larger gain that is stable. The steps are those of the stable end.
    """
    options = outcome.inputs["controller"]
    design = build_design(problem, options)
    low, high = options["low"], options["high"]
    trials = _Trials(outcome.inputs, design.law)
    count = max(2, 1 + round(PER_DECADE * np.log10(high / low)))
    scan = [trials.at(float(gamma)) for gamma in np.geomspace(low, high, count)]
    first = next((place for place, trial in enumerate(scan) if not trial.stable), len(scan))
    stable, unstable = scan[first - 1] if first else None, scan[first] if first < len(scan) else None
    while stable is not None and unstable is not None and unstable.gamma > stable.gamma * (1.0 + options["tolerance"]):
        middle = trials.at(float(np.sqrt(stable.gamma * unstable.gamma)))
        stable, unstable = (middle, unstable) if middle.stable else (stable, middle)
    again = sum(trial.stable for trial in scan[first:])
    statistics = {
        **design.statistics,
        "gamma": stable.gamma if stable else np.nan,
        "gamma_stable": stable.gamma if stable else np.nan,
        "gamma_unstable": unstable.gamma if unstable else np.nan,
        "tracking_error_m": stable.error_m if stable else np.nan,
        "gamma_within_sphere": _within_sphere(trials, stable),
        "stable_again": float(again),
    }
    status, sentence = _answer(stable, unstable, again)
    steps = (stable or scan[0]).steps
    return replace(
        outcome, status=status, sentence=sentence, steps=steps, statistics=statistics, tables={"gains": trials.table()}
    )


def _within_sphere(trials: _Trials, stable: _Trial | None) -> float:
    """The largest gain tried, up to the limit, whose error stays within the sphere; NaN when there is none."""
    border = ROOM * trials.law.outer_m
    inside = [t.gamma for t in trials.done if stable and t.gamma <= stable.gamma and t.error_m <= border]
    return max(inside, default=float("nan"))


def _answer(stable: _Trial | None, unstable: _Trial | None, again: int) -> tuple[Status, str]:
    if stable is None:
        return Status.NOT_ACHIEVED, "a run is not bounded with the smallest gain already"
    if unstable is None:
        return Status.NOT_ACHIEVED, f"every run is still bounded with the largest gain, {stable.gamma:.3g}"
    if again:
        return Status.OK, f"the limit is the first that is met: {again} larger gains of the scan are stable again"
    return Status.OK, ""

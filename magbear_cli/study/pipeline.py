"""How one case is computed: build the problem, design, judge, verify, simulate, gather. The page to read first."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from magbear_cli.errors import NumericsError, Status
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.bearing import Bearing
from magbear_cli.model.problem import ControlProblem
from magbear_cli.simulation.scenario import StepScenario
from magbear_cli.simulation.step import StepResponse, simulate_steps
from magbear_cli.study.adaptation import adaptive_case, adaptive_limit_case
from magbear_cli.study.building import (
    build_bearing,
    build_limit_options,
    build_problem,
    design_controller,
)
from magbear_cli.study.judging import judge_loop, verdict, without_levels
from magbear_cli.study.limits import bracket_limit
from magbear_cli.study.operating_map import map_operating_range
from magbear_cli.study.outcome import CaseOutcome, Summary
from magbear_cli.study.proving import SPECIFIED, prove_impossible, prove_lower_bound, verify_controller
from magbear_cli.study.reduction import reduce_design
from magbear_cli.study.rotor_identification import identify_rotor_case
from magbear_cli.study.simulating import simulated
from magbear_cli.synthesis.design import Design


def run_case(inputs: Mapping[str, Any], case_id: str, index: int) -> CaseOutcome:
    """The outcome of a case from its resolved inputs; what cannot be computed is a status with a sentence."""
    outcome = CaseOutcome(case_id, index, inputs, Status.FAILED)
    try:
        with np.errstate(all="ignore"):  # numbers near the ends of double overflow here; what matters is looked at
            return _computed(outcome)
    except NumericsError as error:
        return replace(outcome, sentence=str(error))
    except (np.linalg.LinAlgError, ArithmeticError) as error:
        return replace(outcome, sentence=f"its numbers are beyond what double precision can hold: {error}")


def _computed(outcome: CaseOutcome) -> CaseOutcome:
    inputs = outcome.inputs
    problem = build_problem(inputs)
    question = QUESTIONS.get(inputs["controller"]["method"])
    if question is not None:
        return question(outcome, problem)
    design = design_controller(problem, inputs["controller"])
    if inputs.get("reduction") is not None:
        design = reduce_design(problem, design, inputs["reduction"])
    return _with_impossibility(_judged(outcome, problem, design), problem, design)


def _bracketed(outcome: CaseOutcome, problem: ControlProblem) -> CaseOutcome:
    """The limit of the problem: its controller judged where it is met, and the certificate of what is impossible."""
    bracket = bracket_limit(problem, build_limit_options(outcome.inputs["controller"]))
    judged = _judged(outcome, bracket.met_problem, bracket.met_design())
    found = replace(
        judged.summary,
        omega_c_feasible_rad_s=bracket.omega_c_feasible_rad_s if judged.summary.verified else None,
        omega_c_infeasible_rad_s=bracket.omega_c_infeasible_rad_s,
    )
    known = replace(judged, summary=found, impossibility=bracket.impossibility)
    if judged.status is Status.OK and bracket.sentence:
        return replace(known, status=Status.NOT_ACHIEVED, sentence=bracket.sentence)
    return known


def _judged(outcome: CaseOutcome, problem: ControlProblem, design: Design) -> CaseOutcome:
    """What is true of the controller of a design, or that there is none."""
    inputs = outcome.inputs
    statistics = dict(design.statistics)
    if design.controller is None:
        given_up = replace(outcome, status=design.status, sentence=design.sentence, summary=Summary(level=design.level))
        return replace(given_up, statistics=statistics, tables=design.tables)
    controller = design.controller
    summary, frequency, poles = judge_loop(problem, controller)
    verification = verify_controller(problem, controller, summary.worst_case)
    status, sentence = verdict(design, summary, verification)
    if status is Status.UNSTABLE:
        summary = without_levels(summary)
    return replace(
        outcome,
        status=status,
        sentence=sentence,
        summary=replace(
            summary,
            level=design.level,
            worst_case_proven=verification.statistics.get("level") if verification.verified else None,
            verified=verification.verified,
            verification_sentence=verification.sentence,
        ),
        controller=controller,
        frequency=frequency,
        poles=poles,
        steps=tuple(step for step, _ in simulated(inputs, partial(_steps, controller))),
        statistics=statistics | {f"verification_{key}": value for key, value in verification.statistics.items()},
        tables=design.tables,
    )


def _with_impossibility(outcome: CaseOutcome, problem: ControlProblem, design: Design) -> CaseOutcome:
    """The outcome with a proof of what no linear controller reaches, where there is reason to look for one.

    That is below a design which claims that no other is better, and at the specification where it was not met.
    """
    if outcome.status not in {Status.OK, Status.NOT_ACHIEVED}:
        return outcome
    proof = None
    if design.claims_optimum:
        proof = prove_lower_bound(problem, outcome.summary.worst_case or np.nan)
    if outcome.status is Status.NOT_ACHIEVED and (proof is None or proof.level < SPECIFIED):
        proof = prove_impossible(problem) or proof
    if proof is None:
        return outcome
    proven = replace(outcome, impossibility=proof, summary=replace(outcome.summary, lower_bound=proof.level))
    if proof.level < SPECIFIED:
        return proven
    reached = "" if outcome.summary.worst_case is None else f"; this one reaches {outcome.summary.worst_case:.4g}"
    sentence = f"proven: every linear controller's worst case is above {proof.level:.4g}{reached}"
    return replace(proven, status=Status.INFEASIBLE, sentence=sentence)


def _steps(
    controller: StateSpace, bearing: Bearing, scenarios: Sequence[StepScenario]
) -> Sequence[StepResponse | NumericsError]:
    return simulate_steps(bearing, controller, scenarios)


def _mapped(outcome: CaseOutcome, _: ControlProblem) -> CaseOutcome:
    """What an operating range does to the bearing; there is no controller in it."""
    statistics, tables = map_operating_range(build_bearing(outcome.inputs), outcome.inputs["controller"])
    return replace(outcome, status=Status.OK, statistics=statistics, tables=tables)


QUESTIONS: Mapping[str, Callable[[CaseOutcome, ControlProblem], CaseOutcome]] = {  # answered without a linear design
    "limit": _bracketed,
    "operating_range": _mapped,
    "adaptive_lfe": adaptive_case,
    "adaptive_limit": adaptive_limit_case,
    "rotor_identification": identify_rotor_case,
}

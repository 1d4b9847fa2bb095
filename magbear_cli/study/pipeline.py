"""How one case is computed: build the problem, design, judge, verify, simulate, gather. The page to read first."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from magbear_cli.errors import NumericsError, Status
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.simulation.scenario import StepScenario
from magbear_cli.simulation.step import simulate_step
from magbear_cli.study.building import build_bearing, build_problem, build_scenarios, design_controller
from magbear_cli.study.judging import judge_loop, verdict, verify_controller, without_levels
from magbear_cli.study.outcome import CaseOutcome, StepOutcome, Summary


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
    design = design_controller(problem, inputs["controller"])
    statistics = dict(design.statistics)
    if design.controller is None:
        summary = Summary(level=design.level)
        return replace(outcome, status=design.status, sentence=design.sentence, summary=summary, statistics=statistics)
    controller = design.controller
    summary, frequency, poles = judge_loop(problem, controller)
    verification = verify_controller(problem, controller)
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
            verified=verification.verified,
            verification_sentence=verification.sentence,
        ),
        controller=controller,
        frequency=frequency,
        poles=poles,
        steps=_simulated(inputs, controller),
        statistics=statistics | {f"verification_{key}": value for key, value in verification.statistics.items()},
    )


def _simulated(inputs: Mapping[str, Any], controller: StateSpace) -> tuple[StepOutcome, ...]:
    bearing = build_bearing(inputs)
    method = str(inputs["controller"]["method"])
    steps = []
    for scenario, entry in build_scenarios(inputs):
        response = simulate_step(bearing, controller, scenario)
        steps.append(
            StepOutcome(
                mass_kg=scenario.mass_kg,
                step_m=scenario.step_m,
                model=scenario.model,
                controller=method,
                scenario=_entry_of_mass(entry, scenario),
                end=str(response.end),
                sentence=response.sentence,
                settling_time_s=response.metrics.settling_time_s,
                overshoot=response.metrics.overshoot,
                rise_time_s=response.metrics.rise_time_s,
                peak_current_a=response.metrics.peak_current_a,
                final_error_m=response.metrics.final_error_m,
                time_s=response.time_s,
                position_m=response.position_m,
                current_a=response.current_a,
                reference_m=response.reference_m,
                linear_position_m=response.linear_position_m,
                linear_current_a=response.linear_current_a,
            )
        )
    return tuple(steps)


def _entry_of_mass(entry: Mapping[str, Any], scenario: StepScenario) -> dict[str, Any]:
    return {**{key: value for key, value in entry.items() if key != "masses_kg"}, "mass_kg": scenario.mass_kg}

"""The simulated runs of a case, whatever closes the loop: one outcome a run, with what the simulation says of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from magbear_cli.errors import NumericsError
from magbear_cli.model.bearing import Bearing
from magbear_cli.simulation.scenario import StepScenario
from magbear_cli.simulation.step import StepResponse
from magbear_cli.study.building import build_bearing, build_scenario, scenario_entries
from magbear_cli.study.outcome import StepOutcome

Answers = Sequence[StepResponse | NumericsError]
Simulation = Callable[[Bearing, Sequence[StepScenario]], Answers]
Simulated = tuple[StepOutcome, Mapping[str, float]]


def simulated(inputs: Mapping[str, Any], simulate: Simulation) -> tuple[Simulated, ...]:
    """Every run of the case; one that cannot begin says why, has no statistics, and stops none of the others."""
    bearing = build_bearing(inputs)
    method = str(inputs["controller"]["method"])
    entries = list(scenario_entries(inputs))
    answers = _answers(bearing, [_scenario(entry, inputs) for entry in entries], simulate)
    return tuple(_told(entry, method, answer) for entry, answer in zip(entries, answers, strict=True))


def one_by_one(simulate: Callable[[Bearing, StepScenario], StepResponse]) -> Simulation:
    """The simulation of many scenarios by that of one."""

    def each(bearing: Bearing, scenarios: Sequence[StepScenario]) -> Answers:
        answers: list[StepResponse | NumericsError] = []
        for scenario in scenarios:
            try:
                answers.append(simulate(bearing, scenario))
            except NumericsError as error:
                answers.append(error)
        return answers

    return each


def _scenario(entry: Mapping[str, Any], inputs: Mapping[str, Any]) -> StepScenario | NumericsError:
    try:
        return build_scenario(entry, inputs["operating_point"])
    except NumericsError as error:
        return error


def _answers(
    bearing: Bearing, scenarios: Sequence[StepScenario | NumericsError], simulate: Simulation
) -> Iterator[StepResponse | NumericsError]:
    """What became of each scenario, in order."""
    answers = iter(simulate(bearing, [one for one in scenarios if isinstance(one, StepScenario)]))
    for scenario in scenarios:
        yield next(answers) if isinstance(scenario, StepScenario) else scenario


def _told(entry: Mapping[str, Any], method: str, answer: StepResponse | NumericsError) -> Simulated:
    if isinstance(answer, NumericsError):
        return _not_begun(entry, method, str(answer)), {}
    return _ended(entry, method, answer), answer.statistics


def _ended(entry: Mapping[str, Any], method: str, response: StepResponse) -> StepOutcome:
    return StepOutcome(
        mass_kg=entry["mass_kg"],
        step_m=entry["step_m"],
        model=entry["model"],
        controller=method,
        scenario=entry,
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


def _not_begun(entry: Mapping[str, Any], method: str, sentence: str) -> StepOutcome:
    nothing = np.empty(0)
    return StepOutcome(
        mass_kg=entry["mass_kg"],
        step_m=entry["step_m"],
        model=entry["model"],
        controller=method,
        scenario=entry,
        end="not_begun",
        sentence=sentence,
        settling_time_s=None,
        overshoot=None,
        rise_time_s=None,
        peak_current_a=None,
        final_error_m=None,
        time_s=nothing,
        position_m=nothing,
        current_a=nothing,
        reference_m=nothing,
        linear_position_m=nothing,
        linear_current_a=nothing,
    )

"""The simulated runs of a case, whatever closes the loop: one outcome a run, with what the simulation says of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from magbear_cli.errors import NumericsError
from magbear_cli.model.bearing import Bearing
from magbear_cli.simulation.scenario import StepScenario
from magbear_cli.simulation.step import StepResponse
from magbear_cli.study.building import build_bearing, build_scenario, scenario_entries
from magbear_cli.study.outcome import StepOutcome

Simulation = Callable[[Bearing, StepScenario], StepResponse]
Simulated = tuple[StepOutcome, Mapping[str, float]]


def simulated(inputs: Mapping[str, Any], simulate: Simulation) -> tuple[Simulated, ...]:
    """Every run of the case; one that cannot begin says why, has no statistics, and stops none of the others."""
    bearing = build_bearing(inputs)
    method = str(inputs["controller"]["method"])
    runs: list[Simulated] = []
    for entry in scenario_entries(inputs):
        try:
            response = simulate(bearing, build_scenario(entry, inputs["operating_point"]))
        except NumericsError as error:
            runs.append((_not_begun(entry, method, str(error)), {}))
        else:
            runs.append((_ended(entry, method, response), response.statistics))
    return tuple(runs)


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

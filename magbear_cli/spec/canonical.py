"""A case as plain JSON with every default filled in: the form that is hashed, computed and stored."""

from __future__ import annotations

from typing import Any

from magbear_cli.spec.models import Case
from magbear_cli.spec.scenario import Scenario
from magbear_cli.spec.weights import LowPassWeight, RationalWeight, trimmed


def canonical(case: Case) -> dict[str, Any]:
    """The resolved inputs of a case: two cases that mean the same give the same inputs."""
    point, bandwidth, uncertain = case.operating_point, case.bandwidth, case.uncertain
    return {
        "bearing": case.bearing.model_dump(),
        "operating_point": {"position_m": 0.0, "current_a": 0.0} if point is None else point.model_dump(),
        "mass_kg": list(case.mass_kg) if isinstance(case.mass_kg, list) else case.mass_kg,
        "uncertain": None if uncertain is None else uncertain.ranges(),
        "performance": _rational(case.performance),
        "bandwidth": None if bandwidth is None else bandwidth.model_dump(),
        "controller": case.controller.model_dump(),
        "reduction": None if case.reduction is None else case.reduction.model_dump(),
        "simulate": [_scenario(scenario, case.mass_kg) for scenario in case.simulate or ()],
    }


def _rational(weight: LowPassWeight | RationalWeight) -> dict[str, list[float]]:
    """A weight as numerator and denominator without leading zeros."""
    if isinstance(weight, LowPassWeight):
        return {"num": [weight.dc_gain * weight.corner_rad_s], "den": [1.0, weight.corner_rad_s]}
    return {"num": trimmed(weight.num), "den": trimmed(weight.den)}


def _scenario(scenario: Scenario, mass_kg: float | list[float]) -> dict[str, Any]:
    """A simulation with its masses and no step left open."""
    resolved = scenario.model_dump()
    resolved["step_m"] = 0.0 if scenario.step_m is None else scenario.step_m
    if scenario.masses_kg is None:
        resolved["masses_kg"] = usual_masses(mass_kg)
    return resolved


def usual_masses(mass_kg: float | list[float]) -> list[float]:
    """The lowest, the nominal (middle of 1/m) and the highest mass; of a known mass, that one."""
    if not isinstance(mass_kg, list):
        return [mass_kg]
    low, high = mass_kg
    return [low, 2.0 * low * high / (low + high), high]

"""Values that are legal alone and contradict each other within one case."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from magbear_cli.spec.adaptation import AdaptiveLaw, AdaptiveLfe, AdaptiveLimit
from magbear_cli.spec.methods import FixedOrder, Limit, MuConvex, OperatingRange
from magbear_cli.spec.models import Bearing, Case, OperatingPoint
from magbear_cli.spec.nodes import Path
from magbear_cli.spec.scenario import Scenario

LARGEST_STEP_GAPS = 10  # a step this far beyond the gap is a mistake of the unit, not a question
MASS_FACTOR = 10  # a simulated mass may lie this far outside of the range designed for


@dataclass(frozen=True)
class Contradiction:
    """A value that another value of the case rules out."""

    path: Path
    sentence: str
    remedy: str


def contradictions(case: Case) -> Iterator[Contradiction]:
    """Everything in a case that cannot hold together."""
    gap, point = case.bearing.air_gap_m, case.operating_point
    if point is not None and abs(point.position_m) >= gap:
        yield Contradiction(
            ("operating_point", "position_m"),
            f"operating_point.position_m is {point.position_m:g} m, beyond the air gap of {gap:g} m",
            "linearise inside of the gap",
        )
    elif point is not None:
        yield from _of_control(case.bearing, point)
    controller = case.controller
    if (
        isinstance(controller, MuConvex)
        and controller.step_prefilter is not None
        and controller.minimise != "step_current"
    ):
        yield Contradiction(
            ("controller",),  # where the prefilter stands may be a part's own file
            f"controller.step_prefilter belongs to the current of a step, and controller.minimise is "
            f"{controller.minimise}",
            "write minimise: step_current, or remove step_prefilter",
        )
    if isinstance(controller, FixedOrder) and controller.order != "auto" and "max_order" in controller.model_fields_set:
        yield Contradiction(
            ("controller", "max_order"),
            f"controller.max_order belongs to order: auto, and controller.order is {controller.order}",
            "write order: auto, or remove max_order",
        )
    if isinstance(controller, Limit) and case.bandwidth is not None:
        yield Contradiction(
            ("bandwidth",),
            "controller.method limit seeks bandwidth.omega_c_rad_s itself, and the case gives one",
            "write bandwidth: null, or leave it out",
        )
    yield from _of_a_question(case)
    masses = case.mass_kg if isinstance(case.mass_kg, list) else [case.mass_kg]
    for index, scenario in enumerate(case.simulate or ()):
        yield from _of_scenario(("simulate", str(index)), scenario, gap, masses)


def _of_control(bearing: Bearing, point: OperatingPoint) -> Iterator[Contradiction]:
    """An operating point at which more current does not pull more.

    k_i = 2 k0 ((i0 + u)/(z0 − z)² + (i0 − u)/(z0 + z)²) of the full law is positive on one side of the current
    −i0 ((z0 + z)² + (z0 − z)²)/((z0 + z)² − (z0 − z)²) alone. In the half law a coil is switched off before its slope
    changes its sign, so that k_i is positive everywhere.
    """
    gap, bias, position, current = bearing.air_gap_m, bearing.bias_current_a, point.position_m, point.current_a
    if bearing.current_law != "full":
        return
    above, below = (gap - position) ** 2, (gap + position) ** 2
    k_i = 2.0 * bearing.force_constant_n_m2_per_a2 * ((bias + current) / above + (bias - current) / below)
    if k_i > 0.0:
        return
    limit = -bias * (below + above) / (below - above)
    side = "above" if position > 0.0 else "below"
    yield Contradiction(
        ("operating_point", "current_a"),
        f"operating_point has the current stiffness k_i = {k_i:.3g} N/A at {position:g} m and {current:g} A: "
        "more current must pull more, k_i > 0",
        f"give a current_a {side} {limit:.4g} A, or current_law: half_switched",
    )


def _of_a_question(case: Case) -> Iterator[Contradiction]:
    """What has no meaning where no controller is designed."""
    method, gap = case.controller.method, case.bearing.air_gap_m
    if isinstance(case.controller, OperatingRange):
        if max(abs(position) for position in case.controller.position_m) >= gap:
            yield Contradiction(
                ("controller", "position_m"),
                f"controller.position_m reaches beyond the air gap of {gap:g} m",
                "the unit is m: 200 µm is 200.0e-6",
            )
        if case.simulate:
            yield Contradiction(
                ("simulate",), f"controller.method {method} gives no controller to simulate with", "leave simulate out"
            )
    yield from _of_adaptation(case)
    if case.reduction is not None and isinstance(case.controller, OperatingRange | Limit | AdaptiveLaw):
        yield Contradiction(
            ("reduction",), f"controller.method {method} gives no controller to reduce", "leave reduction out"
        )


def _of_adaptation(case: Case) -> Iterator[Contradiction]:
    """What no adaptive law can have, and no search for its gain."""
    law = case.controller
    if not isinstance(law, AdaptiveLfe | AdaptiveLimit):
        return
    if law.sigma_m > law.rho_m:
        yield Contradiction(
            ("controller", "sigma_m"),
            f"controller.sigma_m is {law.sigma_m:g} m, more than controller.rho_m, {law.rho_m:g} m",
            "the adaptation ends at rho - sigma",
        )
    if isinstance(law, AdaptiveLimit) and not law.low < law.high:
        yield Contradiction(
            ("controller", "high"), "controller.high is not above controller.low", "give the search room"
        )
    if isinstance(law, AdaptiveLimit) and not case.simulate:
        yield Contradiction(
            ("controller", "method"),
            "controller.method adaptive_limit looks at simulated runs, and the case has none",
            "add an entry to simulate",
        )


def _of_scenario(path: Path, scenario: Scenario, gap: float, masses: list[float]) -> Iterator[Contradiction]:
    """What in a simulation contradicts the bearing or the masses."""
    name = ".".join(path)
    if scenario.step_m is not None and abs(scenario.step_m) > LARGEST_STEP_GAPS * gap:
        yield Contradiction(
            (*path, "step_m"),
            f"{name}.step_m is {scenario.step_m:g} m, more than {LARGEST_STEP_GAPS} air gaps of {gap:g} m",
            "the unit is m: 10 µm is 10.0e-6",
        )
    low, high = min(masses) / MASS_FACTOR, max(masses) * MASS_FACTOR
    for index, mass in enumerate(scenario.masses_kg or ()):
        if not low <= mass <= high:
            yield Contradiction(
                (*path, "masses_kg", str(index)),
                f"{name}.masses_kg holds {mass:g} kg, far outside of mass_kg: it may lie in {low:g} to {high:g} kg",
                "the unit is kg",
            )
    lightest = min(scenario.masses_kg or masses)
    if scenario.rotor is not None and scenario.rotor.sensor_mass_kg >= lightest:
        yield Contradiction(
            (*path, "rotor", "sensor_mass_kg"),
            f"{name}.rotor.sensor_mass_kg is {scenario.rotor.sensor_mass_kg:g} kg, all of the lightest rotor "
            f"of {lightest:g} kg",
            "it is a part of the rotor's mass",
        )

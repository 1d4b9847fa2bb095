"""From the resolved inputs of a case to the objects of the numerics: bearing, problem, design and scenarios."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from magbear_cli.errors import NumericsError, Status
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.bearing import Bearing, CurrentLaw, linearization
from magbear_cli.model.family import Plant, PlantFamily
from magbear_cli.model.filters import Prefilter, SensorDynamics
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.model.rotor import FlexibleRotor
from magbear_cli.simulation.scenario import Disturbance, StepScenario
from magbear_cli.study.limits import LimitOptions
from magbear_cli.synthesis.design import Design
from magbear_cli.synthesis.fixed_order import FixedOrderOptions, design_fixed_order
from magbear_cli.synthesis.hinf import HinfOptions, design_hinf
from magbear_cli.synthesis.lowest_order import design_lowest_order
from magbear_cli.synthesis.lqg import LqgOptions, design_lqg
from magbear_cli.synthesis.lqg_ltr import LqgLtrOptions, design_lqg_ltr
from magbear_cli.synthesis.mu_convex import MuConvexOptions, design_mu_convex
from magbear_cli.synthesis.mu_dk import MuDkOptions, design_mu_dk
from magbear_cli.synthesis.state_feedback import (
    EigenstructureOptions,
    LqrOptions,
    PolePlacementOptions,
    design_eigenstructure,
    design_lqr,
    design_pole_placement,
)

Inputs = Mapping[str, Any]


def build_bearing(inputs: Inputs) -> Bearing:
    """The magnets of a case."""
    fields = dict(inputs["bearing"])
    return Bearing(**{**fields, "current_law": CurrentLaw(fields["current_law"])})


def build_problem(inputs: Inputs) -> ControlProblem:
    """The bearing linearised at the operating point, with what is uncertain of it and the bounds."""
    weight, bandwidth = inputs["performance"], inputs["bandwidth"]
    return ControlProblem(
        build_family(inputs),
        RationalWeight(tuple(weight["num"]), tuple(weight["den"])),
        None if bandwidth is None else bandwidth["omega_c_rad_s"],
    )


def build_family(inputs: Inputs) -> PlantFamily:
    """All plants of a case: the linearised bearing times the factors of what is uncertain, with the range of the mass.

    The force constant f scales both stiffnesses, so ρ = (m ω² + f k_z)/(f k_i) falls with it: it is at its largest
    where ρ is least. For the speed of the unstable pole the box is wider than its two ends.
    """
    point, uncertain = inputs["operating_point"], inputs.get("uncertain") or {}
    linear = linearization(build_bearing(inputs), point["position_m"], point["current_a"])
    light, heavy = mass_ends_kg(inputs)
    known = (1.0, 1.0)
    f, z, i = (uncertain.get(name, known) for name in ("force_constant", "negative_stiffness", "current_stiffness"))
    k_z, k_i = linear.negative_stiffness_n_per_m, linear.current_stiffness_n_per_a
    return PlantFamily(
        Plant(light, f[1] * z[0] * k_z, f[1] * i[1] * k_i),
        Plant(heavy, f[0] * z[1] * k_z, f[0] * i[0] * k_i),
        (f[0] * z[0] * k_z / heavy, f[1] * z[1] * k_z / light),
    )


def mass_ends_kg(inputs: Inputs) -> tuple[float, float]:
    """The lightest and the heaviest rotor."""
    mass = inputs["mass_kg"]
    return (float(mass[0]), float(mass[-1])) if isinstance(mass, list) else (float(mass), float(mass))


def _tupled(options: Inputs) -> dict[str, Any]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in options.items()}


def _eigenstructure(problem: ControlProblem, options: dict[str, Any]) -> Design:
    pairs: dict[str, Any] = {
        key: tuple(map(tuple, value)) if isinstance(value, list) else value for key, value in options.items()
    }
    return design_eigenstructure(problem, EigenstructureOptions(**pairs))


def _mu_convex(problem: ControlProblem, options: dict[str, Any]) -> Design:
    prefilter = options.pop("step_prefilter", None)
    step_prefilter = None if prefilter is None else Prefilter(**prefilter)
    return design_mu_convex(problem, MuConvexOptions(**options, step_prefilter=step_prefilter))


def _stored(_: ControlProblem, options: Inputs) -> Design:
    try:
        controller = StateSpace.of(options["a"], options["b"], options["c"], options["d"])
    except (NumericsError, TypeError, ValueError) as error:
        raise NumericsError(f"the matrices of {options['source']} are not those of a controller: {error}") from error
    if (controller.inputs, controller.outputs) != (1, 1):
        raise NumericsError(f"the controller of {options['source']} does not map one position to one current")
    return Design(controller, Status.OK)


def _fixed_order(problem: ControlProblem, options: dict[str, Any]) -> Design:
    known = {key: value for key, value in options.items() if key not in {"order", "max_order"}}
    if options["order"] == "auto":
        return design_lowest_order(problem, FixedOrderOptions(**known), options["max_order"])
    return design_fixed_order(problem, FixedOrderOptions(options["order"], **known))


METHODS: Mapping[str, Callable[[ControlProblem, dict[str, Any]], Design]] = {
    "mu_convex": _mu_convex,
    "fixed_order": _fixed_order,
    "hinf": lambda problem, options: design_hinf(problem, HinfOptions(**options)),
    "mu_dk": lambda problem, options: design_mu_dk(problem, MuDkOptions(**_tupled(options))),
    "lqg": lambda problem, options: design_lqg(problem, LqgOptions(**_tupled(options))),
    "lqg_ltr": lambda problem, options: design_lqg_ltr(problem, LqgLtrOptions(**_tupled(options))),
    "pole_placement": lambda problem, options: design_pole_placement(problem, PolePlacementOptions(**options)),
    "eigenstructure": _eigenstructure,
    "lqr": lambda problem, options: design_lqr(problem, LqrOptions(**_tupled(options))),
    "stored": _stored,
}


def design_controller(problem: ControlProblem, controller: Inputs) -> Design:
    """The answer of the method that the case names."""
    options = {key: value for key, value in controller.items() if key != "method"}
    return METHODS[controller["method"]](problem, options)


def build_limit_options(controller: Inputs) -> LimitOptions:
    """The options of the method ``limit``."""
    return LimitOptions(tolerance=controller["tolerance"], max_order=controller["max_order"])


def scenario_entries(inputs: Inputs) -> list[dict[str, Any]]:
    """The entries of ``simulate``, one for each of their masses, with ``mass_kg`` in place of the list."""
    return [
        {**{key: value for key, value in entry.items() if key != "masses_kg"}, "mass_kg": mass}
        for entry in inputs["simulate"]
        for mass in entry["masses_kg"]
    ]


def build_scenario(entry: Inputs, operating_point: Inputs) -> StepScenario:
    """What is done to the loop in one run.

    Raises
    ------
    NumericsError
        when its numbers describe no run.
    """
    parts = {"prefilter": Prefilter, "sensor": SensorDynamics, "rotor": FlexibleRotor, "disturbance": Disturbance}
    fields = dict(entry)
    for key, part in parts.items():
        fields[key] = None if fields[key] is None else part(**fields[key])
    return StepScenario(**operating_point, **fields)

"""The study file as types: what a case is made of, and what stands around the cases."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, PlainValidator, WithJsonSchema, model_validator

from magbear_cli.spec.methods import METHODS, Controller, order_or_auto
from magbear_cli.spec.nodes import Path
from magbear_cli.spec.scalars import number_hint
from magbear_cli.spec.scenario import Disturbance, Prefilter, Rotor, Scenario, Sensor
from magbear_cli.spec.section import Length, Omega, PartName, Section, fault
from magbear_cli.spec.weights import WEIGHT_FORMS, Performance

SMALLEST_KG, LARGEST_KG = 1e-6, 1e6
SMALLEST_FACTOR, LARGEST_FACTOR = 1e-2, 1e2
FIGURES = ("mu", "sensitivity", "nyquist", "controller_gain", "step", "poles", "limitation", "limits", "orders")
Figure = Literal[
    "mu", "sensitivity", "nyquist", "controller_gain", "step", "poles", "limitation", "limits", "orders"
]  # fmt: skip
USUAL_FIGURES: list[Figure] = ["mu", "sensitivity", "nyquist", "poles", "controller_gain", "step"]


class Bearing(Section):
    """The electromagnets: force k0 (i0 + u)²/(z0 − z)² − k0 (i0 − u)²/(z0 + z)² (thesis eq. 2.1)."""

    air_gap_m: Length = Field(description="Nominal air gap z0 (m).")
    force_constant_n_m2_per_a2: float = Field(ge=1e-15, le=1.0, description="Electromagnetic constant k0 (N m²/A²).")
    bias_current_a: float = Field(ge=1e-6, le=1e4, description="Bias current i0 (A).")
    current_law: Literal["full", "half_switched"] = Field(
        "full",
        description="Coil currents i0 ± u (thesis eq. 2.1), or i0 ± u/2 with a coil off beyond 2 i0 (eq. 4.1).",
    )


def _rising(factors: list[float]) -> list[float]:
    """The factors, unless they are no range of positive numbers near one."""
    low, high = factors
    if not low < high:
        raise fault("E114", f"begins at {low:g} and ends at {high:g}", "write [low, high]; leave it out if it is known")
    if low < SMALLEST_FACTOR or high > LARGEST_FACTOR:
        raise fault("E105", f"must lie in {SMALLEST_FACTOR:g} to {LARGEST_FACTOR:g}", "1 is the bearing's own value")
    return factors


class OperatingPoint(Section):
    """Where the bearing is linearised."""

    position_m: float = Field(0.0, ge=-0.1, le=0.1, description="Rotor position (m), smaller than the air gap.")
    current_a: float = Field(0.0, ge=-1e4, le=1e4, description="Control current (A).")


Factors = Annotated[list[float], Field(min_length=2, max_length=2), AfterValidator(_rising)]
UNCERTAIN_PARAMETERS = ("force_constant", "negative_stiffness", "current_stiffness")


class Uncertain(Section):
    """Parameters of the bearing that are known within factors only, each constant in time; any of them together."""

    force_constant: Factors | None = Field(
        None, description="k0, which scales both stiffnesses: [low, high] over the value that the bearing gives it."
    )
    negative_stiffness: Factors | None = Field(
        None, description="The negative stiffness k_z alone: [low, high] over the value that the bearing gives it."
    )
    current_stiffness: Factors | None = Field(
        None, description="The current stiffness k_i alone: [low, high] over the value that the bearing gives it."
    )
    parameter: Literal["force_constant", "negative_stiffness", "current_stiffness"] | None = Field(
        None, description="The older form, for one of them: which one; with factor."
    )
    factor: Factors | None = Field(None, description="The older form, for one of them: [low, high]; with parameter.")

    @model_validator(mode="after")
    def _names_something(self) -> Uncertain:
        """Refuse a section that names nothing, or names one thing in both forms."""
        if (self.parameter is None) != (self.factor is None):
            missing, given = ("factor", "parameter") if self.factor is None else ("parameter", "factor")
            remedy = "write for example negative_stiffness: [0.8, 1.2]"
            raise fault("E103", f"has {given} without {missing}", remedy)
        given_too = self.parameter is not None and getattr(self, self.parameter) is not None
        if given_too:
            raise fault("E114", f"gives {self.parameter} twice", "leave parameter and factor out")
        if not self.ranges():
            raise fault("E103", "names no parameter", "write for example negative_stiffness: [0.8, 1.2]")
        return self

    def ranges(self) -> dict[str, list[float]]:
        """The factors of each parameter that is uncertain."""
        found = {name: getattr(self, name) for name in UNCERTAIN_PARAMETERS}
        if self.parameter is not None and self.factor is not None:
            found[self.parameter] = self.factor
        return {name: [float(factor) for factor in factors] for name, factors in found.items() if factors is not None}


StatesKept = Annotated[Any, *order_or_auto(0, 200)]


class Reduction(Section):
    """Fewer states for whatever controller was designed; the loop is judged with what is left."""

    order: StatesKept = Field("auto", description="States to keep, or auto: the fewest that keep what was reached.")
    method: Literal["truncation", "residualisation"] = Field(
        "truncation", description="Cut the weakest balanced states off, or put them at rest."
    )


class Bandwidth(Section):
    """The bound on the complementary sensitivity, W3 = s²/omega_c²."""

    omega_c_rad_s: Omega = Field(description="Bandwidth limit (rad/s).")


class Report(Section):
    """What the report shows."""

    figures: Annotated[list[Figure], Field(min_length=1)] = Field(
        USUAL_FIGURES, description="Figures, in this order.", json_schema_extra={"uniqueItems": True}
    )


class Run(Section):
    """Limits of one case; not part of its identity."""

    timeout_s: float = Field(300.0, ge=0.1, le=1e7, description="A case that takes longer is stopped (s).")
    memory_gib: float = Field(4.0, ge=1, le=4096, description="A case that takes more memory is stopped (GiB).")


def _number(value: Any) -> bool:  # noqa: ANN401 - the file may hold anything
    """Whether a value is a number that is not a truth value."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def _mass(value: Any) -> float | list[float]:  # noqa: ANN401 - the file may hold anything
    """A mass, or the two ends of its range."""
    masses = value if isinstance(value, list) else [value]
    for index, mass in enumerate(masses):
        at = (str(index),) if isinstance(value, list) else ()
        if not _number(mass):
            hint = (number_hint(mass) if isinstance(mass, str) else "") or "the unit is kg"
            raise fault("E104", "must be a number" if at else "must be a number or [low, high]", hint, at)
        if not SMALLEST_KG <= mass <= LARGEST_KG:
            what = "must be greater than 0" if mass <= 0 else f"must lie in {SMALLEST_KG:g} to {LARGEST_KG:g} kg"
            raise fault("E105", what, "", at)
    if not isinstance(value, list):
        return float(value)
    if len(masses) != 2:
        raise fault(
            "E104",
            f"must be a number or [low, high], not a list of {len(masses)}",
            "write two numbers, with decimal points",
        )
    low, high = masses
    if low == high:
        raise fault("E114", f"has two equal ends, {low:g}", f"write the number {low:g} for a mass that is known")
    if low > high:
        raise fault("E114", f"begins at {low:g} and ends at {high:g}", f"write [{high:g}, {low:g}]")
    return [float(low), float(high)]


_MASS_NUMBER = {"type": "number", "minimum": SMALLEST_KG, "maximum": LARGEST_KG}
MassOrRange = Annotated[
    Any,
    PlainValidator(_mass),
    WithJsonSchema({"anyOf": [_MASS_NUMBER, {"type": "array", "items": _MASS_NUMBER, "minItems": 2, "maxItems": 2}]}),
]


class Case(Section):
    """One case: a bearing, a mass or a range of masses, two bounds, a controller and simulations."""

    bearing: Annotated[Bearing, PartName("bearings")] = Field(description="The electromagnets, in place or by name.")
    operating_point: OperatingPoint | None = Field(None, description="Where the bearing is linearised.")
    mass_kg: MassOrRange = Field(description="Mass of the rotor (kg): a number, or the uncertain range [low, high].")
    uncertain: Uncertain | None = Field(None, description="Parameters beside the mass that are not known exactly.")
    performance: Annotated[Performance, PartName("weights")] = Field(
        description="W1, the bound on the sensitivity: dc_gain and corner_rad_s, num and den, or a name."
    )
    bandwidth: Bandwidth | None = Field(None, description="W3 = s²/omega_c²; null or left out for no limit.")
    controller: Controller = Field(description="The synthesis method and its options.")
    reduction: Reduction | None = Field(None, description="Order reduction after the design; null for none.")
    simulate: Annotated[list[Scenario], Field(min_length=1, max_length=100)] | None = Field(
        None, description="Responses to simulate with the controller."
    )


def _format(value: Any) -> Any:  # noqa: ANN401 - the file may hold anything
    """The number of the format; 1 is equal to 1.0 and true, but these are not it."""
    if type(value) is not int or value != 1:
        raise fault("E112", "must be 1, the format that this release reads", "write magbear: 1")
    return value


class StudyFile(Case):
    """A magbear study: a case, and lists of values for any of its keys."""

    magbear: Annotated[Literal[1], BeforeValidator(_format)] = Field(description="Format of this file.")
    name: str = Field(
        min_length=1,
        max_length=80,
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$",
        description="Name of the study; files are named by it.",
    )
    description: str | None = Field(None, max_length=4000, description="What the study asks, for the report.")
    sweep: dict[str, Annotated[list[Any], Field(min_length=1)]] | None = Field(
        None, description="Any dotted key with a list of values; the cases are the product."
    )
    report: Report | None = Field(None, description="What the report shows.")
    run: Run | None = Field(None, description="Limits of one case.")


CASE_KEYS: tuple[str, ...] = tuple(Case.model_fields)
FRAME_KEYS: tuple[str, ...] = tuple(key for key in StudyFile.model_fields if key not in CASE_KEYS)

SECTIONS: dict[Path, tuple[type[Section], ...]] = {
    (): (StudyFile,),
    ("bearing",): (Bearing,),
    ("operating_point",): (OperatingPoint,),
    ("uncertain",): (Uncertain,),
    ("performance",): tuple(WEIGHT_FORMS.values()),
    ("bandwidth",): (Bandwidth,),
    ("reduction",): (Reduction,),
    ("controller",): METHODS,
    ("controller", "step_prefilter"): (Prefilter,),
    ("simulate", "*"): (Scenario,),
    ("simulate", "*", "prefilter"): (Prefilter,),
    ("simulate", "*", "sensor"): (Sensor,),
    ("simulate", "*", "rotor"): (Rotor,),
    ("simulate", "*", "disturbance"): (Disturbance,),
    ("report",): (Report,),
    ("run",): (Run,),
}

LISTS: dict[Path, int] = {  # keys that hold lists of scalars, whose entries may be named by index
    ("mass_kg",): 2,
    ("uncertain", "factor"): 2,
    ("uncertain", "force_constant"): 2,
    ("uncertain", "negative_stiffness"): 2,
    ("uncertain", "current_stiffness"): 2,
    ("performance", "num"): 21,
    ("performance", "den"): 21,
    ("controller", "q"): 2,
    ("controller", "xi"): 2,
    ("controller", "gain"): 2,
    ("controller", "position_m"): 2,
    ("controller", "current_a"): 2,
    ("simulate", "*", "masses_kg"): 100,
    ("report", "figures"): 8,
}

PARTS: dict[Path, str] = {
    ("bearing",): "bearings",
    ("performance",): "weights",
    ("controller", "step_prefilter"): "prefilters",
    ("simulate", "*", "prefilter"): "prefilters",
    ("simulate", "*", "sensor"): "sensors",
    ("simulate", "*", "rotor"): "rotors",
}


def pattern_of(path: Path) -> Path:
    """The path with ``*`` for the indices of ``simulate``."""
    return tuple("*" if index == 1 and path[0] == "simulate" else key for index, key in enumerate(path))

"""The synthesis methods a study may ask for, each with its options and their defaults."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, PlainValidator, WithJsonSchema

from magbear_cli.spec.scenario import Prefilter
from magbear_cli.spec.section import NonNegative, PartName, Positive, Section, Tiny, fault


def _not_all_zero(values: list[float]) -> list[float]:
    """The values, unless they are all zero."""
    if not any(values):
        raise fault("E105", "must not be all zero", "give a positive number")
    return values


Pair = Annotated[list[NonNegative], Field(min_length=2, max_length=2), AfterValidator(_not_all_zero)]


def _legal_grid(grid: list[float]) -> list[float]:
    """The grid, unless it is empty or its number of points is no number of points."""
    low, high, points = grid
    if not low < high:
        raise fault("E105", "must rise from low to high", "write [low, high, points]")
    if points != int(points) or not 10 <= points <= 5000:
        raise fault("E105", "must end with a whole number of points from 10 to 5000", "write [low, high, points]")
    return grid


FrequencyGrid = Annotated[list[Positive], Field(min_length=3, max_length=3), AfterValidator(_legal_grid)]


class MuConvex(Section):
    """The best controller of any order by convex optimisation over all stabilising controllers."""

    method: Literal["mu_convex"]
    uncertainty: Literal["real", "complex"] = Field(
        "real", description="Take the mass as real (exact) or as a complex perturbation (mu-synthesis)."
    )
    max_order: int = Field(12, ge=2, le=100, description="Largest number of controller states.")
    minimise: Literal["worst_case", "ks_peak", "step_current"] = Field(
        "worst_case",
        description="The worst case (or mu) itself; or with it held at 1 the peak of |K S|, or of a step's current.",
    )
    step_prefilter: Annotated[Prefilter, PartName("prefilters")] | None = Field(
        None, description="The filter of the step whose current is minimised; null for none."
    )


def _order(value: Any) -> int | str:  # noqa: ANN401 - the file may hold anything
    """A number of states, or the word for seeking it."""
    if value == "auto":
        return "auto"
    if isinstance(value, bool) or not isinstance(value, int):
        raise fault("E104", "must be a whole number or auto", "write a number from 1 to 6, or auto")
    if not 1 <= value <= LARGEST_ORDER:
        raise fault("E105", f"must lie in 1 to {LARGEST_ORDER}", "write auto for the fewest states that are enough")
    return value


LARGEST_ORDER = 6
OrderOrAuto = Annotated[
    Any,
    PlainValidator(_order),
    WithJsonSchema({"anyOf": [{"type": "integer", "minimum": 1, "maximum": LARGEST_ORDER}, {"const": "auto"}]}),
]


class FixedOrder(Section):
    """The best controller of a given order by direct search on the exact worst case."""

    method: Literal["fixed_order"]
    order: OrderOrAuto = Field(1, description="Number of controller states, or auto: the fewest that are enough.")
    max_order: int = Field(6, ge=1, le=8, description="Where auto stops.")
    uncertainty: Literal["real", "complex"] = Field(
        "real", description="Take the mass as real (exact worst case) or as a complex perturbation (peak mu)."
    )
    minimise: Literal["worst_case", "ks_peak"] = Field(
        "worst_case", description="The worst case itself, or the peak of |K S| with the worst case held at 1."
    )


class Limit(Section):
    """The smallest bandwidth limit that linear control can meet, bracketed by a proof on each side."""

    method: Literal["limit"]
    tolerance: float = Field(0.01, ge=1e-3, le=0.5, description="Relative width of the bracket to reach.")
    max_order: int = Field(14, ge=2, le=100, description="Number of states of the controllers at the limit.")


class Hinf(Section):
    """H-infinity mixed sensitivity by gamma iteration, at the nominal mass."""

    method: Literal["hinf"]
    gamma_tolerance: float = Field(1e-3, ge=1e-6, le=0.5, description="Relative width at which the iteration stops.")
    form: Literal["mended", "as_printed"] = Field(
        "mended", description="The generalised plant as derived, or with the slips of the thesis's appendix A.2."
    )


class MuDk(Section):
    """D-K iteration: the classic mu-synthesis, with rational D-scales and complex blocks."""

    method: Literal["mu_dk"]
    d_order: int = Field(2, ge=0, le=8, description="Number of states of each fitted D-scale.")
    iterations: int = Field(6, ge=0, le=30, description="Steps of D and K after the first controller, at most.")
    gamma_tolerance: float = Field(1e-3, ge=1e-6, le=0.5, description="Relative width at which each K-step stops.")
    frequency_grid: FrequencyGrid | None = Field(
        None, description="[low, high, points]: logarithmic grid of the D-scales in rad/s; null: from the problem."
    )
    form: Literal["mended", "as_printed"] = Field(
        "mended", description="The generalised plant as derived, or with the slips of the thesis's appendix A.5."
    )
    channel_scaling: bool = Field(
        default=True, description="Scale the channels by constants first; false: the units of the thesis."
    )
    fit_every_scale: bool = Field(
        default=False, description="Fit all D-scales, as the thesis did, and not only their ratios to the last."
    )


class Lqg(Section):
    """Linear quadratic Gaussian design at the nominal mass (thesis section 2.3.1)."""

    method: Literal["lqg"]
    q: Pair = Field([1.0, 1e-5], description="Diagonal of the weight on position (m) and velocity (m/s), eq. 2.9.")
    r: Tiny = Field(3e-9, description="Weight on the control current (A), eq. 2.10.")
    xi: Tiny = Field(1.0, description="Intensity of the force disturbance (N).")
    theta: Tiny = Field(1e-15, description="Intensity of the measurement noise (m).")


class LqgLtr(Section):
    """LQG with loop transfer recovery at the nominal mass (thesis section 2.3.3)."""

    method: Literal["lqg_ltr"]
    xi: Pair = Field([1e-7, 50.0], description="Diagonal of the filter's process noise on position and velocity.")
    theta: Tiny = Field(8e-9, description="Intensity of the filter's measurement noise.")
    q: Pair = Field([1e6, 1e-3], description="Diagonal of the recovery's weight on position and velocity.")
    r: Tiny = Field(1e-10, description="Recovery's weight on the control current.")


class Stored(Section):
    """A controller that exists already, judged and simulated like the rest."""

    method: Literal["stored"]
    path: str = Field(
        min_length=1,
        max_length=4096,
        description="A results file, a run's directory or a .json of matrices, from the study's folder.",
    )
    case: str | None = Field(None, min_length=1, max_length=200, description="The case in it; null if it has one only.")


METHODS: tuple[type[Section], ...] = (MuConvex, FixedOrder, Limit, Hinf, MuDk, Lqg, LqgLtr, Stored)

Controller = Annotated[
    MuConvex | FixedOrder | Limit | Hinf | MuDk | Lqg | LqgLtr | Stored, Field(discriminator="method")
]

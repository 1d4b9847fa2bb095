"""The synthesis methods a study may ask for, each with its options and their defaults."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, PlainValidator, WithJsonSchema

from magbear_cli.spec.adaptation import AdaptiveLfe, AdaptiveLimit, RotorIdentification
from magbear_cli.spec.scenario import Prefilter
from magbear_cli.spec.section import Mass, NonNegative, Omega, PartName, Positive, Section, Signed, Tiny, fault


def _not_all_zero(values: list[float]) -> list[float]:
    """The values, unless they are all zero."""
    if not any(values):
        raise fault("E105", "must not be all zero", "give a positive number")
    return values


Pair = Annotated[list[NonNegative], Field(min_length=2, max_length=2), AfterValidator(_not_all_zero)]


def _rising(ends: list[float]) -> list[float]:
    """The ends of a range, unless it is turned inside out."""
    if ends[0] > ends[1]:
        raise fault("E114", f"begins at {ends[0]:g} and ends at {ends[1]:g}", "write [low, high]")
    return ends


Range = Annotated[list[Signed], Field(min_length=2, max_length=2), AfterValidator(_rising)]
TwoPairs = Annotated[
    list[Annotated[list[Signed], Field(min_length=2, max_length=2)]], Field(min_length=2, max_length=2)
]
_DIFFERENTIATOR = "Pole of the differentiator (rad/s); null: 1000 times the loop's fastest pole."


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


def order_or_auto(least: int, most: int) -> tuple[PlainValidator, WithJsonSchema]:
    """What makes a key a number of states between two ends, or the word for seeking it."""

    def legal(value: Any) -> int | str:  # noqa: ANN401 - the file may hold anything
        if value == "auto":
            return "auto"
        if isinstance(value, bool) or not isinstance(value, int):
            raise fault("E104", "must be a whole number or auto", f"write a number from {least} to {most}, or auto")
        if not least <= value <= most:
            raise fault("E105", f"must lie in {least} to {most}", "write auto for the fewest states that are enough")
        return value

    schema = {"anyOf": [{"type": "integer", "minimum": least, "maximum": most}, {"const": "auto"}]}
    return PlainValidator(legal), WithJsonSchema(schema)


LARGEST_ORDER = 6
OrderOrAuto = Annotated[Any, *order_or_auto(1, LARGEST_ORDER)]


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
    max_order: int | None = Field(
        None,
        ge=2,
        le=100,
        description="Number of states of the controllers at the limit; null: 14, or 20 for a tolerance below 0.8 %.",
    )


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


class PolePlacement(Section):
    """Full-state feedback that puts both poles of the nominal rotor at a place; the speed is differentiated."""

    method: Literal["pole_placement"]
    omega_rad_s: Omega = Field(600.0, description="Natural frequency of the poles (rad/s).")
    zeta: float = Field(1.0, ge=1e-3, le=1e3, description="Their damping ratio.")
    derivative_rad_s: Omega | None = Field(None, description=_DIFFERENTIATOR)


class Eigenstructure(Section):
    """Full-state feedback with eigenvalues, and eigenvectors as near to wishes as one current allows."""

    method: Literal["eigenstructure"]
    eigenvalues_rad_s: TwoPairs = Field(
        [[-500.0, 0.0], [-700.0, 0.0]], description="Two eigenvalues, [real, imaginary] each (rad/s)."
    )
    eigenvectors: TwoPairs = Field(
        [[1.0, -500.0], [1.0, -700.0]], description="The wish for each, [position, speed] (m, m/s)."
    )
    derivative_rad_s: Omega | None = Field(None, description=_DIFFERENTIATOR)


class Lqr(Section):
    """Full-state feedback of least quadratic cost at the nominal mass; the speed is differentiated."""

    method: Literal["lqr"]
    q: Pair = Field([1.0, 1e-5], description="Diagonal of the weight on position (m) and velocity (m/s).")
    r: Tiny = Field(3e-9, description="Weight on the control current (A).")
    derivative_rad_s: Omega | None = Field(None, description=_DIFFERENTIATOR)


class OperatingRange(Section):
    """No controller: what a range of positions and currents does to the stiffness, told as a range of masses."""

    method: Literal["operating_range"]
    position_m: Range = Field([-2e-4, 2e-4], description="[low, high] of the rotor's position (m), inside the gap.")
    current_a: Range = Field([0.0, 0.0], description="[low, high] of the control current (A).")
    low_kg: Mass = Field(3.0, description="Lightest rotor of the equivalent range (kg).")
    points: int = Field(41, ge=2, le=401, description="Positions and currents of the stored force surface.")


class Stored(Section):
    """A controller that exists already, judged and simulated like the rest."""

    method: Literal["stored"]
    path: str = Field(
        min_length=1,
        max_length=4096,
        description="A results file, a run's directory, or a .json or .mat of matrices, from the study's folder.",
    )
    case: str | None = Field(None, min_length=1, max_length=200, description="The case in it; null if it has one only.")


METHODS: tuple[type[Section], ...] = (
    MuConvex, FixedOrder, Limit, Hinf, MuDk, Lqg, LqgLtr, PolePlacement, Eigenstructure, Lqr, AdaptiveLfe,
    AdaptiveLimit, RotorIdentification, OperatingRange, Stored,
)  # fmt: skip

Controller = Annotated[
    MuConvex
    | FixedOrder
    | Limit
    | Hinf
    | MuDk
    | Lqg
    | LqgLtr
    | PolePlacement
    | Eigenstructure
    | Lqr
    | AdaptiveLfe
    | AdaptiveLimit
    | RotorIdentification
    | OperatingRange
    | Stored,
    Field(discriminator="method"),
]

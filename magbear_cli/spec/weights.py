"""The bound on the sensitivity, W1: by dc gain and corner, or by numerator and denominator."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Annotated, Any

from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from magbear_cli.spec.section import Omega, Positive, Section, fault

Coefficients = Annotated[list[Annotated[float, Field(ge=-1e60, le=1e60)]], Field(min_length=1, max_length=21)]


def trimmed(coefficients: Sequence[float]) -> list[float]:
    """The coefficients from the first that is not zero on; empty when all are zero."""
    first = next((i for i, value in enumerate(coefficients) if value), len(coefficients))
    return [float(value) for value in coefficients[first:]]


def is_stable(coefficients: Sequence[float]) -> bool:
    """Whether all roots lie in the open left half-plane, by Routh's table in exact arithmetic."""
    exact = [Fraction(value) for value in coefficients]
    above, row = exact[0::2], exact[1::2]
    while row:
        if row[0] == 0 or (row[0] > 0) != (exact[0] > 0):
            return False
        ratio = above[0] / row[0]
        padded = [*row[1:], Fraction(0)]
        above, row = row, [first - ratio * second for first, second in zip(above[1:], padded, strict=False)]
    return True


class LowPassWeight(Section):
    """The weight dc_gain·corner/(s + corner)."""

    dc_gain: Positive = Field(description="The bound on the sensitivity at low frequencies is 1/dc_gain.")
    corner_rad_s: Omega = Field(description="Where the weight falls by 3 dB (rad/s).")


def _not_zero(num: list[float]) -> list[float]:
    """The numerator, unless it is zero."""
    if not trimmed(num):
        raise fault("E115", "is zero, so that the weight asks for nothing", "give a coefficient that is not zero")
    return num


def _stable(den: list[float]) -> list[float]:
    """The denominator, unless it has a root outside of the open left half-plane."""
    if not trimmed(den):
        raise fault("E115", "is zero, so that the weight is infinite", "give a coefficient that is not zero")
    if not is_stable(trimmed(den)):
        raise fault(
            "E115", "has a root that is not in the open left half-plane", "move a root at s = 0 to a small -eps"
        )
    return den


class RationalWeight(Section):
    """The weight num(s)/den(s), coefficients by descending powers of s (rad/s)."""

    num: Annotated[Coefficients, AfterValidator(_not_zero)] = Field(description="Numerator, highest power first.")
    den: Annotated[Coefficients, AfterValidator(_stable)] = Field(description="Denominator, highest power first.")

    @model_validator(mode="after")
    def _is_proper(self) -> RationalWeight:
        """Refuse a weight that grows without end."""
        degrees = len(trimmed(self.num)) - 1, len(trimmed(self.den)) - 1
        if degrees[0] > degrees[1]:
            raise fault(
                "E115",
                f"is not proper: num has degree {degrees[0]}, den only {degrees[1]}",
                "give den at least the degree of num",
                ("num",),
            )
        return self


def _form(value: Any) -> str:  # noqa: ANN401 - pydantic shows what the file holds
    """Which of the two forms was begun."""
    keys = value if isinstance(value, dict) else ()
    begun = sum(key in keys for key in ("num", "den")) > sum(key in keys for key in ("dc_gain", "corner_rad_s"))
    return "rational" if begun else "low_pass"


Performance = Annotated[
    Annotated[LowPassWeight, Tag("low_pass")] | Annotated[RationalWeight, Tag("rational")], Discriminator(_form)
]
WEIGHT_FORMS: dict[str, type[Section]] = {"low_pass": LowPassWeight, "rational": RationalWeight}

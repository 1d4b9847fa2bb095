"""|W(jω)|² of a rational weight, enclosed over boxes of ω, or over boxes of 1/ω with its fall-off taken out."""

from __future__ import annotations

import numpy as np

from magbear_cli.analysis.interval import Enclosure, Interval, polynomial
from magbear_cli.model.problem import RationalWeight


def squared_modulus(weight: RationalWeight, omega: Enclosure) -> Enclosure:
    """|W(jω)|²."""
    num, den = _trimmed(weight.num), _trimmed(weight.den)
    return squared_polynomial(num, omega) * squared_polynomial(den, omega).reciprocal()


def squared_modulus_at_infinity(weight: RationalWeight, inverse: Enclosure) -> Enclosure:
    """|W(jω)|² ω^{2r}, r the relative degree, over boxes of 1/ω: the polynomials read backwards."""
    num, den = _trimmed(weight.num), _trimmed(weight.den)
    return squared_polynomial(num[::-1], inverse) * squared_polynomial(den[::-1], inverse).reciprocal()


def without_zero_at_rest(weight: RationalWeight) -> RationalWeight:
    """The weight over s, for one that vanishes at s = 0; exact, as a coefficient is dropped."""
    return RationalWeight(weight.num[:-1], weight.den)


def squared_polynomial(coefficients: list[Interval], at: Enclosure) -> Enclosure:
    """|p(jx)|² for real coefficients by descending powers: even and odd part in x² apart."""
    ascending = coefficients[::-1]
    square = at.square()
    parts = []
    for start in (0, 1):
        chosen = [c if k % 2 == 0 else -c for k, c in enumerate(ascending[start::2])]
        parts.append(polynomial(chosen[::-1], square) if chosen else square.of_constant(0.0))
    return parts[0].square() + square * parts[1].square()


def _trimmed(coefficients: tuple[float, ...]) -> list[Interval]:
    return [Interval.of(value) for value in np.trim_zeros(np.array(coefficients, dtype=float), "f")]

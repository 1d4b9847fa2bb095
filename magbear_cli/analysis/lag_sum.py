"""The sum c0 + Σ c_k p_k/(s + p_k) on the imaginary axis, enclosed over boxes of frequency and at both ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.analysis.interval import Enclosure, Interval

Floats = NDArray[np.float64]

_TERMS = 8  # of the Taylor series about the centre of a box; a box of 5 % leaves 1e-11 of each lag
_AT_ONCE = 400_000  # boxes times lags in memory at once


@dataclass(frozen=True, eq=False)
class LagSum:
    """The constant, the poles (k,) and the coefficients (k,); one of these may follow from the others.

    ``derived`` is the index of that one: 0, the slowest, where the sum's derivative at s = 0 vanishes; −1, the fastest,
    where its 1/s term vanishes; None where all are free. The coefficients passed in leave it out.
    """

    constant: float
    poles: Floats
    free: Floats
    derived: int | None

    @classmethod
    def of(cls, poles: tuple[float, ...], coefficients: tuple[float, ...], derived: int | None) -> LagSum:
        """The sum from a certificate's lists: poles, and the constant followed by the free coefficients."""
        return cls(coefficients[0], np.array(poles), np.array(coefficients[1:]), derived)

    @property
    def coefficients(self) -> Interval:
        """All coefficients of the lags, the derived one as the interval that holds it."""
        if self.derived is None:
            return Interval.of(self.free)
        if self.derived == 0:  # Σ c_k/p_k = 0
            rest = -(Interval.of(self.free) / self.poles[1:]).sum() * self.poles[0]
            return _joined(rest, Interval.of(self.free))
        rest = -(Interval.of(self.free) * self.poles[:-1]).sum() / self.poles[-1]  # Σ c_k p_k = 0
        return _joined(Interval.of(self.free), rest)

    def over_boxes(self, low: Floats, high: Floats) -> tuple[Enclosure, Enclosure]:
        """Real and imaginary part over the boxes [low, high] of ω, 0 < low, each of width below low."""
        step = max(1, _AT_ONCE // self.poles.size)
        parts = [self._over_boxes(low[i : i + step], high[i : i + step]) for i in range(0, low.size, step)]
        return _stacked([part[0] for part in parts]), _stacked([part[1] for part in parts])

    def near_zero(self, omega: Interval) -> tuple[Interval, Interval]:
        """Real part, and imaginary part over ω (over ω³ where the derivative at 0 vanishes), for one interval of ω."""
        # p²/(p² + ω²) = 1 − ω²/p² + ω⁴/(p²(p² + ω²)): large terms cancel in the first sums and are small in the last.
        square, poles, coefficients = omega.square(), Interval.of(self.poles), self.coefficients
        own = poles.square() + square
        at = _first(square)
        fourth = (coefficients / (poles.square() * own)).sum()
        real = coefficients.sum() + self.constant - at * ((coefficients / poles.square()).sum() - at * fourth)
        if self.derived != 0:
            linear = (coefficients / poles).sum() - at * (coefficients / (poles * own)).sum()
            return real, -linear
        slowest, poles = Interval.of(self.poles[0]), Interval.of(self.poles[1:])
        cubic = (slowest.square() - poles.square()) * self.free / (poles * (poles.square() + square))
        return real, (cubic / (slowest.square() + square)).sum()

    def near_infinity(self, inverse: Interval) -> tuple[Interval, Interval]:
        """Real part, and imaginary part over 1/ω (over 1/ω³ where the 1/s term vanishes), for one interval of 1/ω."""
        square, poles, coefficients = inverse.square(), Interval.of(self.poles), self.coefficients
        own = poles.square() * square + 1.0
        real = _first(square) * (coefficients * poles.square() / own).sum() + self.constant
        if self.derived != -1:
            cubic = (coefficients * poles * poles.square() / own).sum()
            return real, _first(square) * cubic - (coefficients * poles).sum()
        fastest, poles = Interval.of(self.poles[-1]), Interval.of(self.poles[:-1])
        lowest = (poles.square() - fastest.square()) * poles * self.free / (poles.square() * square + 1.0)
        return real, (lowest / (fastest.square() * square + 1.0)).sum()

    def _over_boxes(self, low: Floats, high: Floats) -> tuple[Enclosure, Enclosure]:
        """The Taylor series of the sum; beyond all poles, on the side where a term vanishes, that of what is left."""
        coefficients = self.coefficients
        if self.derived is None:
            return self._taylor(coefficients, self.constant, low, high)
        beyond = high < self.poles[0] if self.derived == 0 else low > self.poles[-1]
        if not beyond.any():
            return self._taylor(coefficients, self.constant, low, high)
        if not beyond.all():
            parts = [self._over_boxes(low[where], high[where]) for where in (beyond, ~beyond)]
            places = np.argsort(np.concatenate([np.flatnonzero(beyond), np.flatnonzero(~beyond)]))
            both = _stacked([part[0] for part in parts]), _stacked([part[1] for part in parts])
            return both[0].reordered(places), both[1].reordered(places)
        square = Enclosure.of_variable(low, high).square()
        if self.derived == 0:  # p/(s + p) = 1 − s/p + (s/p)² p/(s + p), and the sum of the second terms is zero
            real, imaginary = self._taylor(coefficients / Interval.of(self.poles).square(), 0.0, low, high)
            return -(square * real) + (coefficients.sum() + self.constant), -(square * imaginary)
        # p/(s + p) = p/s − (p/s)² + (p/s)² p/(s + p), and the sum of the first terms is zero
        steeper = coefficients * Interval.of(self.poles).square()
        real, imaginary = self._taylor(steeper, 0.0, low, high)
        inverse = square.reciprocal()
        return inverse * (-real + steeper.sum()) + self.constant, -(inverse * imaginary)

    def _taylor(
        self, coefficients: Interval, constant: float, low: Floats, high: Floats
    ) -> tuple[Enclosure, Enclosure]:
        """The Taylor series about the centres, with p/(p + jω0 + jδ) = p z Σ (−j z δ)ⁿ, z = 1/(p + jω0)."""
        variable = Enclosure.of_variable(low, high)
        centre, reach = variable.centre, variable.reach
        at = Interval.of(centre.low[:, None])
        poles = Interval.of(self.poles[None, :])
        size = poles.square() + at.square()
        z = poles / size, -(at / size)
        turn = z[1], -z[0]  # −j z
        term = coefficients * poles * z[0], coefficients * poles * z[1]
        series = []
        for _ in range(_TERMS):
            series.append((term[0].sum(), term[1].sum()))
            term = term[0] * turn[0] - term[1] * turn[1], term[0] * turn[1] + term[1] * turn[0]
        # What is left after n terms is at most the first term left out over 1 − q, with q = |z| max|δ|.
        largest = Interval.of(reach.magnitude())
        q = Interval.of(largest.low[:, None]) * size.root().reciprocal()
        first = (coefficients * poles) * size.root().reciprocal()
        rest = Interval.of(first.magnitude()) * _power(q, _TERMS) / (1.0 - q)
        rest_slope = Interval.of(first.magnitude()) * _power(q, _TERMS - 1) * size.root().reciprocal() * float(_TERMS)
        rest_slope = rest_slope / (1.0 - q).square()
        tails = [Interval.of(-bound.sum().high, bound.sum().high) for bound in (rest, rest_slope)]
        parts = []
        for index in (0, 1):
            values = [pair[index] for pair in series]
            values[0] = values[0] + (constant if index == 0 else 0.0)
            slopes = [value * float(power) for power, value in enumerate(values)][1:]
            whole, slope = _horner(values, reach) + tails[0], _horner(slopes, reach) + tails[1]
            parts.append(Enclosure(values[0], whole, slope, reach))
        return parts[0], parts[1]


def _first(column: Interval) -> Interval:
    """A column of intervals as a row."""
    return Interval(column.low[..., 0], column.high[..., 0])


def _horner(ascending: list[Interval], at: Interval) -> Interval:
    value = ascending[-1]
    for coefficient in reversed(ascending[:-1]):
        value = value * at + coefficient
    return value


def _power(base: Interval, exponent: int) -> Interval:
    value = base
    for _ in range(exponent - 1):
        value = value * base
    return value


def _joined(first: Interval, second: Interval) -> Interval:
    return Interval(
        np.concatenate([np.atleast_1d(first.low), np.atleast_1d(second.low)]),
        np.concatenate([np.atleast_1d(first.high), np.atleast_1d(second.high)]),
    )


def _stacked(parts: list[Enclosure]) -> Enclosure:
    fields = []
    for name in ("centre", "whole", "slope", "reach"):
        intervals = [getattr(part, name) for part in parts]
        fields.append(Interval(np.concatenate([i.low for i in intervals]), np.concatenate([i.high for i in intervals])))
    return Enclosure(*fields)

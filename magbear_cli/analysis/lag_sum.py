"""The sum c0 + Σ c_k p_k/(s + p_k) on the imaginary axis, enclosed over boxes of frequency and at both ends.

Second-order terms (a n² + b n s)/(s² + 2 ζ n s + n²) may stand beside the lags.
"""

from __future__ import annotations

from dataclasses import dataclass, field

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

    ``pairs`` (m, 4) are second-order terms: n in rad/s, ζ, a, b. They do not go with ``derived`` 0.
    """

    constant: Interval
    poles: Floats
    free: Floats
    derived: int | None
    pairs: Floats = field(default_factory=lambda: np.zeros((0, 4)))

    @classmethod
    def of(cls, poles: tuple[float, ...], coefficients: tuple[float, ...], derived: int | None) -> LagSum:
        """The sum from a certificate's lists: poles, and the constant followed by the free coefficients."""
        return cls(Interval.of(coefficients[0]), np.array(poles), np.array(coefficients[1:]), derived)

    @property
    def at_rest(self) -> Interval:
        """The value at s = 0."""
        return self.coefficients.sum() + self.constant + Interval.of(self.pairs[:, 2]).sum()

    @property
    def coefficients(self) -> Interval:
        """All coefficients of the lags, the derived one as the interval that holds it."""
        if self.derived is None:
            return Interval.of(self.free)
        if self.derived == 0:  # Σ c_k/p_k = 0
            rest = -(Interval.of(self.free) / self.poles[1:]).sum() * self.poles[0]
            return _joined(rest, Interval.of(self.free))
        rest = (Interval.of(self.free) * self.poles[:-1]).sum() + self._pairs_by_s.sum()  # Σ c_k p_k + Σ b n = 0
        return _joined(Interval.of(self.free), -rest / self.poles[-1])

    @property
    def _pairs_by_s(self) -> Interval:
        """The 1/s terms b n of the second-order terms."""
        return Interval.of(self.pairs[:, 0]) * self.pairs[:, 3]

    def over_boxes(self, low: Floats, high: Floats) -> tuple[Enclosure, Enclosure]:
        """Real and imaginary part over the boxes [low, high] of ω, 0 < low, each of width below low."""
        step = max(1, _AT_ONCE // self.poles.size)
        parts = [self._with_pairs(low[i : i + step], high[i : i + step]) for i in range(0, low.size, step)]
        return _stacked([part[0] for part in parts]), _stacked([part[1] for part in parts])

    def near_zero(self, omega: Interval) -> tuple[Interval, Interval]:
        """Real part, and imaginary part over ω (over ω³ where the derivative at 0 vanishes), for one interval of ω."""
        curvature, odd = self.parts_near_zero(omega)
        return _first(omega.square()) * curvature + self.at_rest, odd

    def parts_near_zero(self, omega: Interval) -> tuple[Interval, Interval]:
        """Real part less its value at 0, over ω², and the imaginary part as in ``near_zero``, for one interval of ω."""
        # p²/(p² + ω²) = 1 − ω²/p² + ω⁴/(p²(p² + ω²)): large terms cancel in the first sums and are small in the last.
        square, poles, coefficients = omega.square(), Interval.of(self.poles), self.coefficients
        at = _first(square)
        own = poles.square() + square
        fourth = (coefficients / (poles.square() * own)).sum()
        curvature = at * fourth - (coefficients / poles.square()).sum()
        if self.derived != 0:
            linear = (coefficients / poles).sum() - at * (coefficients / (poles * own)).sum()
            even, odd = self._pairs_near_zero(square)
            return curvature + even, odd - linear
        slowest, poles = Interval.of(self.poles[0]), Interval.of(self.poles[1:])
        cubic = (slowest.square() - poles.square()) * self.free / (poles * (poles.square() + square))
        return curvature, (cubic / (slowest.square() + square)).sum()

    def near_infinity(self, inverse: Interval) -> tuple[Interval, Interval]:
        """Real part, and imaginary part over 1/ω (over 1/ω³ where the 1/s term vanishes), for one interval of 1/ω."""
        square, poles, coefficients = inverse.square(), Interval.of(self.poles), self.coefficients
        own = poles.square() * square + 1.0
        even, odd = self._pairs_near_infinity(square)
        real = _first(square) * ((coefficients * poles.square() / own).sum() + even) + self.constant
        if self.derived != -1:
            cubic = (coefficients * poles * poles.square() / own).sum()
            return real, _first(square) * cubic - (coefficients * poles).sum() + odd
        fastest, poles = Interval.of(self.poles[-1]), Interval.of(self.poles[:-1])
        lowest = (poles.square() - fastest.square()) * poles * self.free / (poles.square() * square + 1.0)
        return real, (lowest / (fastest.square() * square + 1.0)).sum() + odd

    def _pairs(self) -> tuple[Interval, Interval, Interval, Interval]:
        """n², 2 ζ n, a n² and b n of the second-order terms."""
        natural = Interval.of(self.pairs[:, 0])
        square = natural.square()
        return square, natural * self.pairs[:, 1] * 2.0, square * self.pairs[:, 2], natural * self.pairs[:, 3]

    def _pairs_near_zero(self, square: Interval) -> tuple[Interval, Interval]:
        """The second-order terms: real part less that at 0, over ω², and imaginary part over ω."""
        if not self.pairs.size:
            return Interval.of(0.0), Interval.of(0.0)
        stiff, damping, constant, linear = self._pairs()
        size = (stiff - square).square() + damping.square() * square
        # a n² (n² − ω²)/size − a = a ω² (n² − ω² − (2 ζ n)²)/size
        even = (constant / stiff * (stiff - square - damping.square()) + linear * damping) / size
        odd = (linear * (stiff - square) - constant * damping) / size
        return even.sum(), odd.sum()

    def _pairs_near_infinity(self, square: Interval) -> tuple[Interval, Interval]:
        """The second-order terms: real part over x², x = 1/ω, and imaginary part over x.

        Where the 1/s term of the sum vanishes, each is taken less its part of the derived lag, and over x³.
        """
        if not self.pairs.size:
            return Interval.of(0.0), Interval.of(0.0)
        stiff, damping, constant, linear = self._pairs()
        size = (stiff * square - 1.0).square() + damping.square() * square
        even = (constant * (stiff * square - 1.0) + linear * damping) / size
        if self.derived != -1:
            odd = (linear * (stiff * square - 1.0) - constant * damping * square) / size
            return even.sum(), odd.sum()
        fastest = Interval.of(self.poles[-1]).square()
        lowest = damping.square() - stiff - fastest + square * stiff * (fastest + stiff)
        odd = (linear * lowest / (fastest * square + 1.0) - constant * damping) / size
        return even.sum(), odd.sum()

    def _with_pairs(self, low: Floats, high: Floats) -> tuple[Enclosure, Enclosure]:
        """The sum over boxes, its second-order terms added by plain enclosures."""
        real, imaginary = self._over_boxes(low, high)
        omega = Enclosure.of_variable(low, high)
        square = omega.square()
        fast = Interval.of(np.where(self._lies_beyond(low, high) & (self.derived == -1), 1.0, 0.0))
        slow = -fast + 1.0
        for n, zeta, a, b in self.pairs:
            stiff = Interval.of(float(n)).square()
            damping = Interval.of(float(n)) * float(zeta) * 2.0
            constant, linear = stiff * float(a), Interval.of(float(n)) * float(b)
            rest = -square + stiff
            inverse = (rest.square() + square * damping.square()).reciprocal()
            # Beyond the fastest lag the 1/s terms of lags and pairs cancel: what is left of this one is
            # (a n² − 2 ζ b n² + …)/(s (s² + 2 ζ n s + n²)), and its numerator has these two coefficients.
            upper, lower = constant - linear * damping, -(linear * stiff)
            real = real + (rest * constant + square * (linear * damping)) * inverse * slow
            imaginary = imaginary + omega * (rest * linear - constant * damping) * inverse * slow
            if fast.high.any():
                turned = (rest * upper - lower * damping) * inverse
                straight = (rest * lower + square * (upper * damping)) * inverse
                real = real + turned * fast
                imaginary = imaginary - straight * omega.reciprocal() * fast
        return real, imaginary

    def _lies_beyond(self, low: Floats, high: Floats) -> NDArray[np.bool_]:
        """Which boxes lie beyond all lags, on the side where the sum loses a term."""
        if self.derived is None:
            return np.zeros(low.shape, dtype=bool)
        return np.asarray(high < self.poles[0] if self.derived == 0 else low > self.poles[-1])

    def _over_boxes(self, low: Floats, high: Floats) -> tuple[Enclosure, Enclosure]:
        """The Taylor series of the sum; beyond all poles, on the side where a term vanishes, that of what is left."""
        coefficients = self.coefficients
        if self.derived is None:
            return self._taylor(coefficients, self.constant, low, high)
        beyond = self._lies_beyond(low, high)
        if not beyond.any():
            return self._taylor(coefficients, self.constant, low, high)
        if not beyond.all():
            parts = [self._over_boxes(low[where], high[where]) for where in (beyond, ~beyond)]
            places = np.argsort(np.concatenate([np.flatnonzero(beyond), np.flatnonzero(~beyond)]))
            both = _stacked([part[0] for part in parts]), _stacked([part[1] for part in parts])
            return both[0].reordered(places), both[1].reordered(places)
        square = Enclosure.of_variable(low, high).square()
        if self.derived == 0:  # p/(s + p) = 1 − s/p + (s/p)² p/(s + p), and the sum of the second terms is zero
            real, imaginary = self._taylor(coefficients / Interval.of(self.poles).square(), Interval.of(0.0), low, high)
            return -(square * real) + (coefficients.sum() + self.constant), -(square * imaginary)
        # p/(s + p) = p/s − (p/s)² + (p/s)² p/(s + p); the sum of the first terms is zero, with those of the pairs
        steeper = coefficients * Interval.of(self.poles).square()
        real, imaginary = self._taylor(steeper, Interval.of(0.0), low, high)
        inverse = square.reciprocal()
        return inverse * (-real + steeper.sum()) + self.constant, -(inverse * imaginary)

    def _taylor(
        self, coefficients: Interval, constant: Interval, low: Floats, high: Floats
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
            values[0] = values[0] + (constant if index == 0 else Interval.of(0.0))
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

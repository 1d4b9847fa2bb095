"""Interval arithmetic with outward rounding, and functions enclosed over boxes by their values and slopes.

Every operation is done in doubles, which IEEE 754 rounds to nearest, and then widened by one to two units in the last
place on both sides: the exact result for all numbers in the operands lies inside. A NaN becomes the whole line.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

_EPSILON, _TINY = float(np.finfo(float).eps), float(np.finfo(float).tiny)
_SUM_ERROR = 4.0 * _EPSILON  # n times this times the sum of magnitudes is more than any order of adding makes


@dataclass(frozen=True, eq=False)
class Interval:
    """Arrays of closed intervals [low, high]."""

    low: Floats
    high: Floats

    @classmethod
    def of(cls, low: ArrayLike, high: ArrayLike | None = None) -> Interval:
        """Exact doubles, or the intervals between two arrays of them."""
        lower = np.asarray(low, dtype=float)
        return cls(lower, lower if high is None else np.asarray(high, dtype=float))

    def __add__(self, other: Operand) -> Interval:
        """The sum."""
        right = as_interval(other)
        return _outward(self.low + right.low, self.high + right.high)

    def __neg__(self) -> Interval:
        """The negative, exact."""
        return Interval(-self.high, -self.low)

    def __sub__(self, other: Operand) -> Interval:
        """The difference."""
        right = as_interval(other)
        return _outward(self.low - right.high, self.high - right.low)

    def __mul__(self, other: Operand) -> Interval:
        """The product."""
        right = as_interval(other)
        if right.low is right.high:  # a number: two products are all there are
            with np.errstate(over="ignore"):
                at_low, at_high = self.low * right.low, self.high * right.low
            return _outward(np.minimum(at_low, at_high), np.maximum(at_low, at_high))
        with np.errstate(over="ignore"):  # an infinite end encloses all the same
            ends = (self.low * right.low, self.low * right.high, self.high * right.low, self.high * right.high)
        low = np.minimum(np.minimum(ends[0], ends[1]), np.minimum(ends[2], ends[3]))
        high = np.maximum(np.maximum(ends[0], ends[1]), np.maximum(ends[2], ends[3]))
        return _outward(low, high)

    __radd__ = __add__
    __rmul__ = __mul__

    def __rsub__(self, other: Operand) -> Interval:
        """The difference from a number."""
        return as_interval(other) - self

    def __truediv__(self, other: Operand) -> Interval:
        """The quotient; the whole line where the divisor holds zero."""
        return self * as_interval(other).reciprocal()

    def __rtruediv__(self, other: Operand) -> Interval:
        """A number over the interval."""
        return as_interval(other) * self.reciprocal()

    @property
    def as_column(self) -> Interval:
        """The intervals with a new last axis."""
        return Interval(self.low[..., None], self.high[..., None])

    def sum(self) -> Interval:
        """The sum over the last axis."""
        terms = self.low.shape[-1]
        error = _SUM_ERROR * terms * self.magnitude().sum(axis=-1)
        return _outward(self.low.sum(axis=-1) - error, self.high.sum(axis=-1) + error)

    def reciprocal(self) -> Interval:
        """1/x; the whole line where zero is inside."""
        inside = (self.low <= 0.0) & (self.high >= 0.0)
        result = _outward(1.0 / np.where(inside, 1.0, self.high), 1.0 / np.where(inside, 1.0, self.low))
        return Interval(np.where(inside, -np.inf, result.low), np.where(inside, np.inf, result.high))

    def square(self) -> Interval:
        """x², never below zero."""
        low, high = self.low * self.low, self.high * self.high
        holds_zero = (self.low <= 0.0) & (self.high >= 0.0)
        result = _outward(np.where(holds_zero, 0.0, np.minimum(low, high)), np.maximum(low, high))
        return Interval(np.maximum(result.low, 0.0), result.high)

    def root(self) -> Interval:
        """√x of the part that is not negative."""
        result = _outward(np.sqrt(np.maximum(self.low, 0.0)), np.sqrt(np.maximum(self.high, 0.0)))
        return Interval(np.maximum(result.low, 0.0), result.high)

    def intersection(self, other: Interval) -> Interval:
        """What both enclose; where rounding has left nothing, the first."""
        low, high = np.maximum(self.low, other.low), np.minimum(self.high, other.high)
        empty = low > high
        return Interval(np.where(empty, self.low, low), np.where(empty, self.high, high))

    def magnitude(self) -> Floats:
        """The largest |x| in each interval."""
        return np.asarray(np.maximum(np.abs(self.low), np.abs(self.high)))


Operand = Interval | Floats | float


def as_interval(value: Operand) -> Interval:
    """An interval as it is, a number as the interval that holds just it."""
    return value if isinstance(value, Interval) else Interval.of(value)


@dataclass(frozen=True, eq=False)
class Enclosure:
    """A function of one variable over boxes: its value at the centres, its range, and the range of its derivative.

    The range is kept within value + slope·reach (the mean value theorem), so that what cancels between two terms of a
    sum cancels in the range too, to first order in the width of the box.
    """

    centre: Interval
    whole: Interval
    slope: Interval
    reach: Interval  # the box less its centre

    @classmethod
    def of_variable(cls, low: Floats, high: Floats) -> Enclosure:
        """The variable itself over the boxes [low, high]."""
        middle = 0.5 * (low + high)
        box = Interval.of(low, high)
        return cls(Interval.of(middle), box, Interval.of(np.ones_like(middle)), box - middle)

    def of_constant(self, value: Operand) -> Enclosure:
        """A constant over the same boxes."""
        constant = as_interval(value) + Interval.of(np.zeros_like(self.reach.low))
        return Enclosure(constant, constant, Interval.of(np.zeros_like(self.reach.low)), self.reach)

    def __add__(self, other: Enclosure | Operand) -> Enclosure:
        """The sum."""
        right = self._as_enclosure(other)
        return self._tight(self.centre + right.centre, self.whole + right.whole, self.slope + right.slope)

    def __neg__(self) -> Enclosure:
        """The negative."""
        return Enclosure(-self.centre, -self.whole, -self.slope, self.reach)

    def __sub__(self, other: Enclosure | Operand) -> Enclosure:
        """The difference."""
        return self + (-self._as_enclosure(other))

    def __mul__(self, other: Enclosure | Operand) -> Enclosure:
        """The product."""
        right = self._as_enclosure(other)
        slope = self.slope * right.whole + self.whole * right.slope
        return self._tight(self.centre * right.centre, self.whole * right.whole, slope)

    __radd__ = __add__
    __rmul__ = __mul__

    def __rsub__(self, other: Operand) -> Enclosure:
        """The difference from a number."""
        return self._as_enclosure(other) - self

    def square(self) -> Enclosure:
        """The square."""
        return self._tight(self.centre.square(), self.whole.square(), self.whole * self.slope * 2.0)

    def root(self) -> Enclosure:
        """The square root of a function that is shown elsewhere not to be negative."""
        root = self.whole.root()
        return self._tight(self.centre.root(), root, self.slope / (root * 2.0))

    def reciprocal(self) -> Enclosure:
        """1/f."""
        whole = self.whole.reciprocal()
        return self._tight(self.centre.reciprocal(), whole, -(self.slope * whole.square()))

    def reordered(self, places: NDArray[np.intp]) -> Enclosure:
        """The boxes in another order."""
        parts = (self.centre, self.whole, self.slope, self.reach)
        return Enclosure(*(Interval(part.low[places], part.high[places]) for part in parts))

    def _as_enclosure(self, value: Enclosure | Operand) -> Enclosure:
        return value if isinstance(value, Enclosure) else self.of_constant(value)

    def _tight(self, centre: Interval, whole: Interval, slope: Interval) -> Enclosure:
        mean_value = centre + slope * self.reach
        return Enclosure(centre, whole.intersection(mean_value), slope, self.reach)


def polynomial(coefficients: list[Interval], at: Enclosure) -> Enclosure:
    """A polynomial by Horner's rule, coefficients by descending powers."""
    value = at.of_constant(coefficients[0])
    for coefficient in coefficients[1:]:
        value = value * at + coefficient
    return value


def _outward(low: Floats, high: Floats) -> Interval:
    # |x| ε is one to two units in the last place of x, and the smallest normal number covers what underflows: half a
    # unit is all that rounding to nearest can have taken. np.nextafter would be tighter by one unit and costs thrice.
    lower, upper = low - (np.abs(low) * _EPSILON + _TINY), high + (np.abs(high) * _EPSILON + _TINY)
    unknown = np.isnan(upper - lower)  # either is no number, or both are the same infinity
    if unknown.any():
        lower, upper = np.where(unknown, -np.inf, lower), np.where(unknown, np.inf, upper)
    return Interval(lower, upper)

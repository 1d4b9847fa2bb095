"""Where a smooth function over [0, 1] passes zero, by few evaluations: they cost more than all else here."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

Point = tuple[float, float]  # place and value

ROUNDING = float(np.finfo(float).eps)
INVERSE_POINTS = 4  # through which an inverse interpolation goes
HALVED_EVERY = 4  # evaluations: in an interval so often halved nothing creeps
NEAR_BY, FOUND = 1e-5, 1e-9  # a secant so short tells the slope, and a move so small is followed by rounding
DIP_STEPS = 8  # parabolas, until the least value is negative or surely not


def first_zero(
    function: Callable[[float], float], points: Sequence[tuple[float, float]], within: tuple[float, float]
) -> float:
    """A zero of a smooth function between two places where it changes from positive to negative.

    By inverse interpolation through known points (place, value), each answer becoming one of them, until the secant
    through two places near each other moves the last one by less than ``FOUND``; where interpolation leads astray or
    gets on slowly, by halving the interval.
    """
    known, (left, right), last, creeps = list(points), within, None, 0
    while right - left > ROUNDING:
        place = _inverse(known)
        if creeps == HALVED_EVERY or not left < place < right:
            place = 0.5 * (left + right)
        value = function(place)
        left, right = (place, right) if value > 0.0 else (left, place)
        if value == 0.0:
            return place
        if last is not None and abs(place - last[0]) < NEAR_BY and value != last[1]:
            move = -value * (place - last[0]) / (value - last[1])
            if abs(move) < FOUND and left - FOUND < place + move < right + FOUND:
                return place + move
        last = place, value
        creeps = creeps % HALVED_EVERY + 1
        known = sorted([*known, last], key=_size)[:INVERSE_POINTS]
    return right


def _size(point: Point) -> float:
    return abs(point[1])


def _inverse(points: Sequence[tuple[float, float]]) -> float:
    """The place of value zero on the polynomial that gives places over values, by Neville's scheme."""
    places, values = [point[0] for point in points], [point[1] for point in points]
    for width in range(1, len(points)):
        for at in range(len(points) - width):
            low, high = values[at], values[at + width]
            if low == high:
                return np.nan
            places[at] = (high * places[at] - low * places[at + 1]) / (high - low)
    return places[0]


def below_zero(function: Callable[[float], float], known: list[Point]) -> tuple[Point, Point] | None:
    """A place where a function is negative, near its least value within three known points, and the point before it."""
    points = list(known)
    for _ in range(DIP_STEPS):
        (a, u), (b, v), (c, w) = points
        first, second = (v - u) / (b - a), (w - v) / (c - b)
        if not second > first:
            return None
        place = 0.5 * (a + b) - 0.5 * first * (c - a) / (second - first)
        if not a < place < c or place == b:
            return None
        value = function(place)
        points = sorted([*points, (place, value)])
        at = min(range(1, 3), key=lambda one: points[one][1])
        if points[at][1] < 0.0:
            return points[at - 1], points[at]
        points = points[at - 1 : at + 2]
    return None

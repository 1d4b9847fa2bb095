"""Where a piecewise polynomial passes levels: every place, found by Bernstein's form and Newton's method, all at once.

On an interval the number of sign changes of the coefficients in Bernstein's form is at least that of the roots, and of
the same parity (Descartes' rule; Farin, Curves and Surfaces for CAGD, chapter 5). None: there is no root. One: there is
one. More: the interval is halved. So no root falls between two samples, and few pieces cost anything.
"""

from __future__ import annotations

from functools import cache
from math import comb

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PPoly

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Booleans = NDArray[np.bool_]

PARTS = 4  # of a piece, to begin with
HALVINGS = 40  # of a part; roots that are still together then are counted once where the sign changes, else not at all
NEWTON_STEPS = 60  # halvings among them
NOTHING = 1e-13  # of the span of a curve: an extreme beyond the others by this is rounding
ARRIVED = 1e-9  # of a piece: a change of Newton's method after which the next one would be rounding


def crossings(curve: PPoly, levels: ArrayLike) -> list[Floats]:
    """The times at which a curve passes each level, sorted.

    A jump over a level from one piece to the next counts as a passage at the time between them. A piece that rests on a
    level passes it nowhere.
    """
    heights = np.atleast_1d(np.asarray(levels, dtype=float))
    begin, width, powers = curve.x[:-1], np.diff(curve.x), _by_fraction(curve)
    form, own, left = _parts(powers)
    within = (form.min(axis=0) <= heights[:, None]) & (form.max(axis=0) >= heights[:, None])
    level, at = np.nonzero(within)  # only there may the level be passed
    which, before, after, rises = _isolated(form[:, at] - heights[level], np.arange(at.size), left[at])
    level, piece = level[which], own[at[which]]
    shifted = powers[:, piece]
    shifted[0] -= heights[level]
    time = begin[piece] + width[piece] * _refined(shifted, before, after, rises)
    jump_level, jump_time = _jumps(powers, heights, begin)
    level, time = np.concatenate([level, jump_level]), np.concatenate([time, jump_time])
    return [np.sort(time[level == one]) for one in range(heights.size)]


def extremes(curve: PPoly) -> tuple[float, float]:
    """The smallest and the largest value of a curve.

    The coefficients of Bernstein's form bound the values: only parts that may exceed the values at the ends of all of
    them are searched for a place without a slope.
    """
    powers = _by_fraction(curve)
    form, own, left = _parts(powers)
    ends = form[[0, -1]]
    low, high = float(ends.min()), float(ends.max())
    more = NOTHING * (high - low)
    worth = np.flatnonzero((form.max(axis=0) > high + more) | (form.min(axis=0) < low - more))
    if not worth.size:
        return low, high
    slopes = powers[1:] * np.arange(1, powers.shape[0])[:, None]
    of_root, before, after, rises = _isolated(np.diff(form[:, worth], axis=0), own[worth], left[worth])
    place = _refined(slopes[:, of_root], before, after, rises)
    values = _dot(powers[:, of_root], _powers_of(place, powers.shape[0]))
    return min(low, float(values.min(initial=low))), max(high, float(values.max(initial=high)))


def _by_fraction(curve: PPoly) -> Floats:
    """The coefficients of the powers, from the constant on, of the fraction of each piece, (degree + 1, pieces)."""
    return np.asarray(curve.c[::-1] * np.diff(curve.x) ** np.arange(curve.c.shape[0])[:, None])


def _parts(powers: Floats) -> tuple[Floats, Indices, Floats]:
    """Bernstein's form on the parts of every piece, the piece of each part, and where in it the part begins."""
    count, pieces = powers.shape
    form = (_bernstein_of_parts(count - 1) @ powers).reshape(PARTS, count, pieces).transpose(1, 0, 2)
    return form.reshape(count, -1), np.tile(np.arange(pieces), PARTS), np.repeat(np.arange(PARTS) / PARTS, pieces)


def _jumps(powers: Floats, heights: Floats, begin: Floats) -> tuple[Indices, Floats]:
    """Levels and times where the sign changes between the end of one piece and the beginning of the next."""
    before, after = powers.sum(axis=0)[:-1] - heights[:, None], powers[0, 1:] - heights[:, None]
    level, piece = np.nonzero(before * after < 0.0)
    return level, begin[piece + 1]


def _isolated(form: Floats, own: Indices, left: Floats) -> tuple[Indices, Floats, Floats, Booleans]:
    """Of parts in Bernstein's form: the piece of each root, the places left and right of it, and whether it rises."""
    degree, width = form.shape[0] - 1, 1.0 / PARTS
    found = []
    for depth in range(HALVINGS):
        positive = form > 0.0
        changes = (positive[1:] != positive[:-1]).sum(axis=0)
        single = changes == 1 if depth < HALVINGS - 1 else changes % 2 == 1
        if single.any():
            found.append((own[single], left[single], left[single] + width, positive[-1, single]))
        open_ones = np.flatnonzero(changes > 1)
        if not open_ones.size:
            break
        width /= 2.0
        form = np.hstack(np.split(_bernstein_of_halves(degree) @ form[:, open_ones], 2))
        own, left = np.tile(own[open_ones], 2), np.concatenate([left[open_ones], left[open_ones] + width])
    if not found:
        return np.empty(0, dtype=np.intp), np.empty(0), np.empty(0), np.empty(0, dtype=bool)
    owners, lefts, rights, signs = (np.concatenate(list(parts)) for parts in zip(*found, strict=True))
    return owners, lefts, rights, signs


def _refined(powers: Floats, left: Floats, right: Floats, rises: Booleans) -> Floats:
    """The one root of each polynomial (columns) between two places, by Newton's method held between them.

    Whether it rises there is told by Bernstein's form, as beside a root at the very end a value's sign is rounding.
    """
    slopes = powers[1:] * np.arange(1, powers.shape[0])[:, None]
    place = 0.5 * (left + right)
    for _ in range(NEWTON_STEPS if place.size else 0):
        by_degree = _powers_of(place, powers.shape[0])
        value, slope = _dot(powers, by_degree), _dot(slopes, by_degree[:-1])
        above = (value > 0.0) == rises
        right, left = np.where(above, place, right), np.where(above, left, place)
        with np.errstate(all="ignore"):
            wanted = place - value / slope
        held = np.where((wanted >= left) & (wanted <= right), wanted, 0.5 * (left + right))
        done = np.abs(held - place).max() <= ARRIVED
        place = held
        if done:
            break
    return np.asarray(place)


def _powers_of(place: Floats, count: int) -> Floats:
    powers = np.empty((count, place.size))
    powers[0], powers[1:] = 1.0, place
    return np.multiply.accumulate(powers, axis=0, out=powers)


def _dot(first: Floats, second: Floats) -> Floats:
    return np.asarray(np.einsum("ij,ij->j", first, second))


@cache
def _bernstein_of_parts(degree: int) -> Floats:
    """From coefficients of powers on (0, 1) to those of Bernstein's form on each part, one below the other."""
    k = np.arange(degree + 1)
    binomials = np.array([[comb(n, m) for m in k] for n in k], dtype=float)
    to_bernstein = binomials / binomials[degree]  # C(i, k)/C(degree, k)
    shifts = [  # (a + t/PARTS)^n = Σ C(n, m) a^(n − m) (t/PARTS)^m
        np.array([[comb(n, m) * (at / PARTS) ** (n - m) / PARTS**m if m <= n else 0.0 for n in k] for m in k])
        for at in range(PARTS)
    ]
    return np.vstack([to_bernstein @ shift for shift in shifts])


@cache
def _bernstein_of_halves(degree: int) -> Floats:
    """From Bernstein's form on an interval to that on its left half and on its right half (de Casteljau)."""
    k = range(degree + 1)
    left = np.array([[comb(i, j) / 2.0**i if j <= i else 0.0 for j in k] for i in k])
    return np.vstack([left, left[::-1, ::-1]])

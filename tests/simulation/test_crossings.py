"""Every crossing and every extreme of a piecewise polynomial is found, wherever it lies."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PPoly

from magbear_cli.simulation.crossings import crossings, extremes


def pieces(*roots: tuple[float, ...]) -> PPoly:
    """One unit piece for each list of roots (as fractions of the piece)."""
    degree = max(len(one) for one in roots)
    columns = [np.concatenate([np.zeros(degree - len(one)), np.poly(one)]) for one in roots]
    return PPoly(np.array(columns).T, np.arange(len(roots) + 1.0))


@settings(deadline=None, max_examples=80)
@given(st.lists(st.floats(0.01, 0.99), min_size=1, max_size=5), st.lists(st.floats(1.5, 3.0), max_size=4))
def test_roots_that_were_put_in_are_found(inside: list[float], outside: list[float]) -> None:
    """All roots within a piece, none of those without; of those that are nearly one, as many as change the sign."""
    spread = sorted(inside)
    if any(second - first < 1e-3 for first, second in pairwise(spread)):
        return
    (found,) = crossings(pieces(tuple(inside + outside)), 0.0)
    np.testing.assert_allclose(found, spread, atol=1e-9)


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 10_000), st.sampled_from([7, 22]))
def test_every_crossing_is_one_and_none_is_missed(seed: int, degree: int) -> None:
    """At each crossing the curve has the level; between two samples that differ in sign there is one."""
    generator = np.random.default_rng(seed)
    width = generator.uniform(0.05, 0.2, 6)
    curve = PPoly(
        generator.normal(size=(degree + 1, 6)) / width ** np.arange(degree, -1, -1)[:, None],
        np.append(0.0, np.cumsum(width)),
    )
    for level, found in zip((0.3, -0.7), crossings(curve, (0.3, -0.7)), strict=True):
        inner = found[~np.isin(found, curve.x)]
        np.testing.assert_allclose(curve(inner), level, atol=1e-9)
        for first, last in pairwise(curve.x):
            time = np.linspace(first, last, 300)[1:-1]
            above = curve(time) > level
            for at in np.flatnonzero(above[1:] != above[:-1]):
                assert ((found >= time[at]) & (found <= time[at + 1])).any()


def test_a_jump_over_the_level_counts() -> None:
    """Between two pieces that do not meet, the level is passed at the time between them."""
    steps = PPoly(np.array([[-1.0, 1.0, 3.0]]), np.arange(4.0))
    assert [found.tolist() for found in crossings(steps, (0.0, 2.0, 5.0))] == [[1.0], [2.0], []]


def test_a_touch_from_one_side_is_no_passage() -> None:
    """A double root changes no sign."""
    (found,) = crossings(pieces((0.4, 0.4)), 0.0)
    assert found.size in {0, 2}  # rounding may part it
    np.testing.assert_allclose(found, 0.4, atol=1e-6)


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10_000), st.sampled_from([3, 7, 22]))
def test_no_sample_exceeds_the_extremes(seed: int, degree: int) -> None:
    """The extremes hold every sample, and some sample comes near to each."""
    generator = np.random.default_rng(seed)
    width = generator.uniform(0.05, 0.2, 5)
    curve = PPoly(
        generator.normal(size=(degree + 1, 5)) / width ** np.arange(degree, -1, -1)[:, None],
        np.append(0.0, np.cumsum(width)),
    )
    low, high = extremes(curve)
    ends = [np.linspace(first, last, 2001)[:-1] for first, last in pairwise(curve.x)]
    values = curve(np.concatenate([np.append(one, np.nextafter(one[-1], np.inf)) for one in ends]))
    span = high - low
    assert values.min() >= low - 1e-12 * span
    assert values.max() <= high + 1e-12 * span
    assert values.max() == pytest.approx(high, abs=0.2 * span)


def test_a_constant_has_one_value() -> None:
    """A curve that rests is its own extreme and passes nothing."""
    rest = PPoly(np.array([[0.0, 0.0], [2.0, 2.0]]), np.arange(3.0))
    assert extremes(rest) == (2.0, 2.0)
    assert [found.size for found in crossings(rest, (1.0, 3.0))] == [0, 0]

"""Discs of K S for a level."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.synthesis.parrott import held_scales, level_discs


@given(seed=st.integers(0, 10_000), size=st.integers(1, 4), above=st.floats(1.01, 10.0))
@settings(deadline=None, max_examples=60)
def test_the_circle_is_where_the_norm_is_the_level(seed: int, size: int, above: float) -> None:
    """On the disc's edge the largest singular value is the level; inside it is less, outside more."""
    rng = np.random.default_rng(seed)

    def draw(*shape: int) -> np.ndarray[tuple[int, ...], np.dtype[np.complex128]]:
        return rng.normal(size=shape) + 1j * rng.normal(size=shape)

    p11, p12, p21 = draw(3, size, size), draw(3, size), draw(3, size)
    scales = np.exp(rng.normal(size=(3, size)))
    floor = level_discs((p11, p12, p21), scales, 1.0).floor
    level = above * max(float(floor.max()), 0.1)
    discs = level_discs((p11, p12, p21), scales, level)
    assert (discs.radius > 0).all()
    for factor, compare in ((0.9, np.less), (1.1, np.greater)):
        r = discs.centre + factor * discs.radius * np.exp(0.7j)
        matrix = p11 + r[:, None, None] * p12[:, :, None] * p21[:, None, :]
        norm = np.linalg.norm(scales[:, :, None] * matrix / scales[:, None, :], 2, axis=(1, 2))
        assert compare(norm, level * (1 + np.sign(factor - 1) * 1e-9)).all()
    edge = discs.centre + discs.radius * np.exp(-2.1j)
    matrix = p11 + edge[:, None, None] * p12[:, :, None] * p21[:, None, :]
    norm = np.linalg.norm(scales[:, :, None] * matrix / scales[:, None, :], 2, axis=(1, 2))
    np.testing.assert_allclose(norm, level, rtol=1e-7)


def test_below_the_floor_no_disc_is_left() -> None:
    """A level that no K S reaches has a negative radius."""
    p11 = np.array([[[0.0, 1.0], [1.0, 5.0]]], dtype=complex)
    discs = level_discs((p11, np.array([[1.0 + 0j, 0.0]]), np.array([[1.0 + 0j, 0.0]])), np.ones((1, 2)), 2.0)
    assert discs.radius[0] < 0
    assert discs.floor[0] == pytest.approx(np.sqrt(26.0))


def test_the_ends_borrow_scales_that_serve() -> None:
    """Where the neighbour's scales keep the level they are held in place of scales that only an infimum has."""
    reducible = np.array([[0.0, 1.0], [1e-12, 0.0]], dtype=complex)
    plain = np.array([[0.1, 0.2], [0.2, 0.1]], dtype=complex)
    scales = held_scales(np.stack([reducible, plain, plain, reducible]), 2.0)
    np.testing.assert_allclose(scales[0], scales[1])
    np.testing.assert_allclose(scales[-1], scales[-2])

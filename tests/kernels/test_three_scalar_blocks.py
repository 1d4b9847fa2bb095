"""The quick way to the scalings of three scalar blocks finds what the general descent finds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from magbear_cli.kernels import structured_singular_value, three_scalar_blocks
from magbear_cli.kernels.structured_singular_value import mu_upper_bound

Complexes = NDArray[np.complex128]


def _balanced(seed: int, count: int, rank: int = 3) -> Complexes:
    generator = np.random.default_rng(seed)
    parts = generator.normal(size=(2, 2, count, 3, 3))
    left, right = parts[0] + 1j * parts[1]
    return np.asarray(left[:, :, :rank] @ right[:, :rank])


@pytest.mark.parametrize("rank", [2, 3])
def test_both_ways_reach_the_same_bound(rank: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The least σ(D M D⁻¹) by the cubic and by the general descent agree to 1e-11."""
    stack = _balanced(2, 200, rank)
    quick, _ = mu_upper_bound(stack)

    def nothing_found(matrices: Complexes) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        return np.zeros((matrices.shape[0], 3)), np.zeros(matrices.shape[0], dtype=bool)

    monkeypatch.setattr(structured_singular_value, "least_log_scaling", nothing_found)
    general, _ = mu_upper_bound(stack)
    np.testing.assert_allclose(quick, general, rtol=1e-11)


def test_nearly_every_matrix_goes_the_quick_way() -> None:
    """For matrices without structure two singular values hardly ever coincide at the least."""
    assert three_scalar_blocks.least_log_scaling(_balanced(4, 1000))[1].mean() > 0.99


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_cubic_has_the_largest_eigenvalue_as_its_root_and_the_right_slopes(seed: int) -> None:
    """The root is σ² of e^X M e^−X; gradient and Hessian are those of its logarithm, by differences."""
    stack = _balanced(seed, 1)
    cubic, at = three_scalar_blocks._Cubic.of(stack), np.random.default_rng(seed).normal(size=(2, 1)) * 0.3

    def log_square(x: NDArray[np.float64]) -> float:
        d = np.exp(np.append(x[:, 0], 0.0))
        return 2.0 * float(np.log(np.linalg.norm(d[:, None] * stack[0] / d, 2)))

    here = cubic.at(at)
    assert here.log_root[0] == pytest.approx(log_square(at), abs=1e-9)
    steps = 1e-5 * np.eye(2)[:, :, None]
    slopes = [(log_square(at + step) - log_square(at - step)) / 2e-5 for step in steps]
    np.testing.assert_allclose(here.gradient[:, 0], slopes, atol=1e-6)
    up, down = zip(*((cubic.at(at + step).gradient, cubic.at(at - step).gradient) for step in steps), strict=True)
    numeric = (np.array(up) - np.array(down))[:, :, 0] / 2e-5
    scale = 1.0 / here.openness[0]
    np.testing.assert_allclose(here.hessian[:, 0], numeric[[0, 0, 1], [0, 1, 1]], atol=1e-6 * scale**3)


def test_singular_values_that_coincide_are_left_to_the_descent() -> None:
    """Of a unitary matrix all singular values are one: nothing is claimed, and the bound is still one."""
    unitary = np.linalg.svd(_balanced(1, 20))[0]
    assert not three_scalar_blocks.least_log_scaling(unitary)[1].any()
    np.testing.assert_allclose(mu_upper_bound(unitary)[0], 1.0, rtol=1e-12)

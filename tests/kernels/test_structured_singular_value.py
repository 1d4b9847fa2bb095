"""Both bounds of mu bound what they claim, and meet where theory says that they meet."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.structured_singular_value import mu_bounds, mu_lower_bound, mu_upper_bound

Complexes = NDArray[np.complex128]


def _random(seed: int, count: int, n: int) -> Complexes:
    generator = np.random.default_rng(seed)
    return np.asarray(generator.normal(size=(count, n, n)) + 1j * generator.normal(size=(count, n, n)))


def _families(seed: int, count: int, n: int) -> dict[str, Complexes]:
    generator = np.random.default_rng(seed + 1)
    stack = _random(seed, count, n)
    spread = np.exp(generator.normal(size=(count, n)) * 8.0)
    return {
        "random": stack,
        "badly scaled": stack * spread[:, :, None] / spread[:, ::-1, None].swapaxes(1, 2),
        "rank one": stack[:, :, :1] @ stack[:, :1, :],
        "rank two": stack[:, :, :2] @ stack[:, :2, :],
        "unitary": np.linalg.svd(stack)[0],
        "zero diagonal": stack * (1.0 - np.eye(n)),
        "huge": stack * 1e300,
        "tiny": stack * 1e-306,
    }


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("family", list(_families(0, 1, 3)))
def test_the_bounds_meet_for_up_to_three_blocks(n: int, family: str) -> None:
    """For n ≤ 3 complex scalar blocks, mu is the least upper bound."""
    stack = _families(7, 60, n)[family]
    upper, _ = mu_upper_bound(stack)
    lower, _ = mu_lower_bound(stack)
    assert np.all(lower <= upper * (1.0 + 1e-12))
    np.testing.assert_allclose(lower, upper, rtol=1e-6, atol=1e-300)


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 5), spread=st.floats(0.0, 10.0))
def test_each_bound_comes_with_its_witness(seed: int, n: int, spread: float) -> None:
    """The bound from above is σ(D M D⁻¹) for the D returned; the one from below makes I − M Δ/lower singular."""
    row = np.exp(spread * np.random.default_rng(seed).normal(size=(1, n, 1)))
    stack = _random(seed, 4, n) * row
    upper, d = mu_upper_bound(stack)
    lower, delta = mu_lower_bound(stack)
    scaled = d[:, :, None] * stack / d[:, None, :]
    np.testing.assert_allclose(np.linalg.norm(scaled, 2, axis=(1, 2)), upper, rtol=1e-11)
    np.testing.assert_allclose(np.abs(delta), 1.0, rtol=1e-12)
    loop = np.eye(n) - scaled * delta[:, None, :] / lower[:, None, None]
    assert np.all(np.linalg.svd(loop, compute_uv=False)[:, -1] < 1e-10)
    assert np.all(lower <= upper * (1.0 + 1e-12))


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(2, 4))
def test_no_other_scaling_and_no_random_perturbation_does_better(seed: int, n: int) -> None:
    """The upper bound is least over D; no unit-modulus Δ has a spectral radius above it."""
    generator = np.random.default_rng(seed)
    stack = _random(seed, 1, n)
    upper, d = mu_upper_bound(stack)
    near = np.log(d) + generator.normal(size=(300, n)) * 10.0 ** generator.uniform(-4, 0, size=(300, 1))
    norms = np.linalg.norm(np.exp(near)[:, :, None] * stack / np.exp(near)[:, None, :], 2, axis=(1, 2))
    assert norms.min() >= upper[0] * (1.0 - 1e-7)
    delta = np.exp(2j * np.pi * generator.uniform(size=(300, n)))
    assert np.abs(np.linalg.eigvals(stack * delta[:, None, :])).max() <= upper[0] * (1.0 + 1e-12)


def test_mu_does_not_change_under_diagonal_similarity_and_scales_with_the_matrix() -> None:
    """mu(D M D⁻¹) = mu(M) and mu(c M) = |c| mu(M)."""
    stack = _random(3, 50, 3)
    d = np.exp(np.random.default_rng(3).normal(size=(50, 3)) * 10.0)
    upper, _ = mu_upper_bound(stack)
    np.testing.assert_allclose(mu_upper_bound(d[:, :, None] * stack / d[:, None, :])[0], upper, rtol=1e-8)
    np.testing.assert_allclose(mu_upper_bound(3e7j * stack)[0], 3e7 * upper, rtol=1e-8)


def test_a_rank_one_matrix_has_the_sum_of_its_diagonal_moduli() -> None:
    """For M = a bᵀ, mu = Σ |a_i b_i|: the two-block robust performance of a SISO loop is |W1 S| + |W3 T|."""
    stack = _families(11, 40, 3)["rank one"]
    expected = np.abs(np.diagonal(stack, axis1=1, axis2=2)).sum(axis=1)
    np.testing.assert_allclose(mu_upper_bound(stack)[0], expected, rtol=1e-10)
    np.testing.assert_allclose(mu_lower_bound(stack)[0], expected, rtol=1e-10)


def test_a_reducible_matrix_has_the_mu_of_its_blocks() -> None:
    """For a block-triangular M the infimum over D is not attained, and is the largest mu of a diagonal block."""
    stack = _random(5, 30, 3)
    stack[:, 2, :2] = 0.0
    inner, _ = mu_upper_bound(stack[:, :2, :2])
    expected = np.maximum(inner, np.abs(stack[:, 2, 2]))
    upper, lower = mu_bounds(stack)
    np.testing.assert_allclose(upper, expected, rtol=1e-6)
    np.testing.assert_allclose(lower, expected, rtol=1e-6)


def test_a_nilpotent_matrix_and_a_zero_matrix_have_no_mu() -> None:
    """Where no perturbation whatever is singular, the upper bound is (nearly) zero and finite."""
    nilpotent = np.array([[0, 1, 1], [0, 0, 1], [0, 0, 0]], dtype=complex)
    upper, lower = mu_bounds(np.stack([nilpotent, 0.0 * nilpotent]))
    assert np.all(upper < 1e-20)
    assert np.all(lower <= upper)
    assert upper[1] == 0.0


def test_one_block_is_its_modulus() -> None:
    """For n = 1, mu is |m|."""
    stack = np.array([[[3.0 - 4.0j]], [[0.0]]])
    upper, lower = mu_bounds(stack)
    np.testing.assert_allclose(upper, [5.0, 0.0])
    np.testing.assert_allclose(lower, [5.0, 0.0])


@pytest.mark.parametrize("wrong", [np.nan, np.inf, complex(0.0, np.nan)])
def test_a_number_that_is_not_finite_is_refused(wrong: complex) -> None:
    """NaN and infinity end in a sentence, not in a bound."""
    stack = _random(1, 3, 3)
    stack[1, 2, 0] = wrong
    for bound in (mu_upper_bound, mu_lower_bound, mu_bounds):
        with pytest.raises(NumericsError, match="not finite"):
            bound(stack)


def test_matrices_that_are_not_square_are_refused() -> None:
    """A stack of another shape ends in a sentence."""
    with pytest.raises(NumericsError, match="shape"):
        mu_upper_bound(np.ones((3, 2, 3), dtype=complex))


@pytest.mark.parametrize("n", [2, 3, 4])
def test_slicot_agrees(n: int) -> None:
    """SLICOT's AB13MD finds the same upper bound once its input is balanced."""
    slycot = pytest.importorskip("slycot")
    stack = _random(17, 25, n)
    upper, d = mu_upper_bound(stack)
    balanced = d[:, :, None] * stack / d[:, None, :]
    blocks = np.ones(n, dtype=int)
    oracle = [slycot.ab13md(matrix, blocks, 2 * blocks)[0] for matrix in balanced]
    np.testing.assert_allclose(upper, oracle, rtol=2e-6)


def test_eight_blocks_whose_singular_values_coincide() -> None:
    """The least over D is 5.74118, by slycot's ab13md and by a simplex search on log D."""
    text = (Path(__file__).parent / "inputs" / "mu_eight_blocks.json").read_text(encoding="utf-8")
    parts = json.loads(text)
    upper, d = mu_upper_bound((np.array(parts["real"]) + 1j * np.array(parts["imag"]))[None])
    assert upper[0] == pytest.approx(5.7411801, rel=1e-6)
    assert np.prod(d) == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("n", [4, 6, 8])
def test_the_least_of_many_badly_scaled_blocks(n: int) -> None:
    """Rows and columns up to e^8 apart: never above what slycot's ab13md finds."""
    slycot = pytest.importorskip("slycot")
    generator = np.random.default_rng(n)
    shape = (60, n, n)
    matrices = generator.standard_normal(shape) + 1j * generator.standard_normal(shape)
    matrices *= np.exp(generator.uniform(-8.0, 8.0, (60, n, 1)) + generator.uniform(-8.0, 8.0, (60, 1, n)))
    expected = [slycot.ab13md(matrix, np.ones(n, int), np.full(n, 2))[0] for matrix in matrices]
    assert (mu_upper_bound(matrices)[0] <= np.array(expected) * (1.0 + 2e-5)).all()

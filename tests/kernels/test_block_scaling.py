"""Both bounds of mu for repeated and full blocks bound what they claim, and meet where theory says that they meet."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.block_perturbation import block_lower_bound
from magbear_cli.kernels.block_scaling import BlockBound, block_upper_bound
from magbear_cli.kernels.block_structure import Block, BlockStructure, FullBlock, RepeatedBlock
from magbear_cli.kernels.structured_singular_value import mu_upper_bound

Complexes = NDArray[np.complex128]

# Packard and Doyle 1993, section 9: the bound is mu when 2·(repeated blocks) + (full blocks) ≤ 3
EXACT: dict[str, tuple[Block, ...]] = {
    "full": (FullBlock(2, 3),),
    "two full": (FullBlock(2, 2), FullBlock(1, 3)),
    "three full": (FullBlock(1, 1), FullBlock(2, 1), FullBlock(2, 3)),
    "repeated": (RepeatedBlock(3),),
    "repeated and full": (RepeatedBlock(2), FullBlock(2, 2)),
}
ANY: dict[str, tuple[Block, ...]] = {
    **EXACT,
    "five full": (FullBlock(1, 1), FullBlock(2, 2), FullBlock(1, 2), FullBlock(2, 1), FullBlock(1, 1)),
    "two repeated": (RepeatedBlock(2), RepeatedBlock(2), FullBlock(2, 1)),
    "scalars": (FullBlock(1, 1), RepeatedBlock(1), FullBlock(1, 1), FullBlock(1, 1)),
}


def _random(seed: int, count: int, structure: BlockStructure) -> Complexes:
    generator = np.random.default_rng(seed)
    shape = (count, structure.outputs, structure.inputs)
    scale = np.exp(3.0 * generator.normal(size=(count, structure.outputs, 1)))
    return np.asarray(scale * (generator.normal(size=shape) + 1j * generator.normal(size=shape)))


def _scaled(stack: Complexes, bound: BlockBound) -> Complexes:
    return np.asarray(bound.left @ stack @ np.linalg.inv(bound.right))


@pytest.mark.parametrize("name", list(EXACT))
def test_the_bounds_meet_for_few_blocks(name: str) -> None:
    """Where mu is known to be the least upper bound, the perturbation found proves it."""
    structure = BlockStructure(EXACT[name])
    stack = _random(3, 40, structure)
    bound = block_upper_bound(stack, structure)
    lower, _ = block_lower_bound(stack, structure, bound)
    np.testing.assert_allclose(lower, bound.upper, rtol=1e-5)


@pytest.mark.parametrize("name", list(ANY))
@settings(deadline=None, max_examples=6)
@given(seed=st.integers(0, 2**32 - 1))
def test_each_bound_comes_with_its_witness(name: str, seed: int) -> None:
    """Upper is σ(D M D⁻¹) for the D returned, which commute with Δ; I − M Δ/lower is singular, Δ of the structure."""
    structure = BlockStructure(ANY[name])
    stack = _random(seed, 4, structure)
    bound = block_upper_bound(stack, structure)
    lower, delta = block_lower_bound(stack, structure)
    np.testing.assert_allclose(np.linalg.norm(_scaled(stack, bound), 2, axis=(1, 2)), bound.upper, rtol=1e-9)
    np.testing.assert_allclose(bound.right @ delta, delta @ bound.left, rtol=1e-9, atol=1e-9 * np.abs(bound.left).max())
    np.testing.assert_allclose(bound.left, bound.left.conj().swapaxes(1, 2))
    assert np.linalg.eigvalsh(bound.left).min() > 0
    logs = [np.linalg.slogdet(bound.left[:, row, row])[1] / (row.stop - row.start) for row in structure.rows]
    np.testing.assert_allclose(np.sum(logs, axis=0), 0.0, atol=1e-9)
    assert np.all(lower <= bound.upper * (1.0 + 1e-10))
    for block, row, column in zip(structure.blocks, structure.rows, structure.columns, strict=True):
        part = delta[:, column, row]
        np.testing.assert_allclose(np.linalg.norm(part, 2, axis=(1, 2)), 1.0)
        if isinstance(block, RepeatedBlock):
            np.testing.assert_allclose(part, part[:, :1, :1] * np.eye(block.size), atol=1e-12)
    loop = np.eye(structure.outputs) - _scaled(stack, bound) @ delta / lower[:, None, None]
    assert np.all(np.linalg.svd(loop, compute_uv=False)[:, -1] < 1e-9)


@pytest.mark.parametrize("name", ["five full", "two repeated", "repeated and full"])
def test_no_other_scaling_and_no_random_perturbation_does_better(name: str) -> None:
    """Neither nearby positive definite scalings of the structure nor Δ at random leave the bounds."""
    structure = BlockStructure(ANY[name])
    stack = _random(11, 6, structure)
    bound = block_upper_bound(stack, structure)
    generator = np.random.default_rng(5)
    for _ in range(60):
        left, right = _random_exponents(structure, generator)
        norms = np.linalg.norm(_exponential(left) @ _scaled(stack, bound) @ _exponential(-right), 2, axis=(1, 2))
        assert np.all(norms >= bound.upper * (1.0 - 2e-4))


def _exponential(hermitian: Complexes) -> Complexes:
    value, vector = np.linalg.eigh(hermitian)
    return np.asarray((vector * np.exp(value)) @ vector.conj().T)


def _random_exponents(structure: BlockStructure, generator: np.random.Generator) -> tuple[Complexes, Complexes]:
    """Hermitian matrices of the structure for outputs and inputs."""
    size = 10.0 ** generator.uniform(-4, 0)
    left = np.zeros((structure.outputs,) * 2, dtype=complex)
    right = np.zeros((structure.inputs,) * 2, dtype=complex)
    for block, row, column in zip(structure.blocks, structure.rows, structure.columns, strict=True):
        x = size * (generator.normal(size=(block.outputs,) * 2) + 1j * generator.normal(size=(block.outputs,) * 2))
        if isinstance(block, RepeatedBlock):
            left[row, row] = right[column, column] = x + x.conj().T
        else:
            left[row, row] = np.eye(block.outputs) * x[0, 0].real
            right[column, column] = np.eye(block.inputs) * x[0, 0].real
    return left, right


def test_a_full_block_has_the_largest_singular_value_and_a_repeated_one_the_spectral_radius() -> None:
    """With one block mu is what it is known to be, for a defective matrix too, whose infimum is not attained."""
    full, repeated = BlockStructure(EXACT["full"]), BlockStructure(EXACT["repeated"])
    stack = _random(1, 30, full)
    np.testing.assert_allclose(block_upper_bound(stack, full).upper, np.linalg.norm(stack, 2, axis=(1, 2)))
    stack = _random(2, 30, repeated)
    stack[0] = [[2.0, 5.0, 0.0], [0.0, 2.0, 7.0], [0.0, 0.0, 2.0]]
    expected = np.abs(np.linalg.eigvals(stack)).max(axis=1)
    np.testing.assert_allclose(block_upper_bound(stack, repeated).upper, expected, rtol=1e-3)


def test_scalar_blocks_are_those_of_the_scalar_kernel() -> None:
    """For numbers the general bound is the special one to the last bit."""
    structure = BlockStructure(ANY["scalars"])
    stack = _random(4, 20, structure)
    bound, (upper, d) = block_upper_bound(stack, structure), mu_upper_bound(stack)
    assert np.array_equal(bound.upper, upper)
    assert np.array_equal(np.diagonal(bound.left, axis1=1, axis2=2).real, d)


def test_slicot_agrees() -> None:
    """SLICOT's AB13MD finds the same bound for full square blocks once its input is balanced."""
    slycot = pytest.importorskip("slycot")
    sizes = np.array([2, 1, 3, 1])
    structure = BlockStructure(tuple(FullBlock(size, size) for size in sizes.tolist()))
    stack = _random(9, 20, structure)
    bound = block_upper_bound(stack, structure)
    oracle = [slycot.ab13md(matrix, sizes, np.full(4, 2))[0] for matrix in _scaled(stack, bound)]
    np.testing.assert_allclose(bound.upper, oracle, rtol=2e-6)


def test_zero_and_wrong_matrices() -> None:
    """Zero has mu zero; another shape and numbers that are not finite end in a sentence."""
    structure = BlockStructure(ANY["two full"])
    zero = np.zeros((2, 3, 5), dtype=complex)
    assert not block_upper_bound(zero, structure).upper.any()
    assert not block_lower_bound(zero, structure)[0].any()
    with pytest.raises(NumericsError, match="shape"):
        block_upper_bound(zero[:, :2], structure)
    with pytest.raises(NumericsError, match="not finite"):
        block_lower_bound(np.full_like(zero, np.nan), structure)

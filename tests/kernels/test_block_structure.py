"""Block structures know their channels and refuse what is none."""

from __future__ import annotations

import pytest

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.block_structure import BlockStructure, FullBlock, RepeatedBlock


def test_blocks_follow_one_another() -> None:
    """Outputs and inputs of the blocks fill the rows and columns of M in order."""
    structure = BlockStructure((RepeatedBlock(2), FullBlock(1, 3), FullBlock(2, 1)))
    assert (structure.outputs, structure.inputs) == (5, 6)
    assert structure.rows == (slice(0, 2), slice(2, 3), slice(3, 5))
    assert structure.columns == (slice(0, 2), slice(2, 5), slice(5, 6))
    assert structure.has_matrix
    assert not structure.is_scalar
    numbers = structure.with_numbers
    assert (numbers.rows, numbers.columns) == (structure.rows, structure.columns)
    assert not numbers.has_matrix


def test_repeated_once_is_a_number() -> None:
    """A block repeated once is scaled by a number, like a full block of one channel."""
    structure = BlockStructure((RepeatedBlock(1), FullBlock(1, 1)))
    assert structure.is_scalar
    assert not structure.has_matrix
    assert BlockStructure.scalar(3).outputs == 3


def test_empty_structures_are_refused() -> None:
    """No blocks, and blocks without channels, end in a sentence."""
    for blocks in ((), (FullBlock(0, 1),), (RepeatedBlock(0),)):
        with pytest.raises(NumericsError, match="block structure"):
            BlockStructure(blocks)

"""Which perturbations are meant: complex blocks on the diagonal of Δ, each repeated or full, square or not."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

from magbear_cli.errors import NumericsError


@dataclass(frozen=True)
class FullBlock:
    """Any complex matrix of norm at most one: it takes so many outputs of M and drives so many of its inputs."""

    outputs: int
    inputs: int


@dataclass(frozen=True)
class RepeatedBlock:
    """δ·I with one complex number |δ| ≤ 1, on as many outputs of M as inputs; of size one it is a scalar."""

    size: int

    @property
    def outputs(self) -> int:
        """How many outputs of M it takes."""
        return self.size

    @property
    def inputs(self) -> int:
        """How many inputs of M it drives."""
        return self.size


Block = FullBlock | RepeatedBlock


@dataclass(frozen=True)
class BlockStructure:
    """Blocks in the order of the channels of M.

    The scalings that commute with them are d·I for a full block and any positive definite matrix for a repeated one.
    """

    blocks: tuple[Block, ...]

    def __post_init__(self) -> None:
        """Refuse a structure without blocks, and blocks without channels."""
        if not self.blocks or any(min(block.outputs, block.inputs) < 1 for block in self.blocks):
            raise NumericsError(f"a block structure needs blocks of one channel at least, not {self.blocks}")

    @classmethod
    def scalar(cls, count: int) -> BlockStructure:
        """So many different complex numbers."""
        return cls((FullBlock(1, 1),) * count)

    @property
    def outputs(self) -> int:
        """The number of rows of M."""
        return sum(block.outputs for block in self.blocks)

    @property
    def inputs(self) -> int:
        """The number of columns of M."""
        return sum(block.inputs for block in self.blocks)

    @property
    def is_scalar(self) -> bool:
        """Whether all blocks are numbers."""
        return all(block.outputs == block.inputs == 1 for block in self.blocks)

    @property
    def has_matrix(self) -> bool:
        """Whether the scaling of some block is a matrix and not a number."""
        return any(self.is_matrix(block) for block in self.blocks)

    @property
    def with_numbers(self) -> BlockStructure:
        """The structure with a full block in place of each repeated one: more perturbations, fewer scalings."""
        return BlockStructure(tuple(FullBlock(block.outputs, block.inputs) for block in self.blocks))

    @cached_property
    def rows(self) -> tuple[slice, ...]:
        """Where the outputs of each block are."""
        return _slices([block.outputs for block in self.blocks])

    @cached_property
    def columns(self) -> tuple[slice, ...]:
        """Where the inputs of each block are."""
        return _slices([block.inputs for block in self.blocks])

    @staticmethod
    def is_matrix(block: Block) -> bool:
        """Whether the scaling of a block is a matrix and not a number."""
        return isinstance(block, RepeatedBlock) and block.size > 1


def _slices(sizes: list[int]) -> tuple[slice, ...]:
    ends = list(accumulate(sizes))
    return tuple(slice(end - size, end) for size, end in zip(sizes, ends, strict=True))

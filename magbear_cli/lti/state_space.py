"""A real state-space system, evaluated at its poles, its order and any complex frequency."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magbear_cli.errors import NumericsError


@dataclass(frozen=True, eq=False)
class StateSpace:
    """dx/dt = A x + B u, y = C x + D u with real matrices in SI units.

    Parameters
    ----------
    a : (n, n) array, in 1/s
    b : (n, m) array
    c : (p, n) array
    d : (p, m) array
    """

    a: NDArray[np.float64]
    b: NDArray[np.float64]
    c: NDArray[np.float64]
    d: NDArray[np.float64]

    def __post_init__(self) -> None:
        """Refuse shapes that do not fit and entries that are not finite."""
        n, m, p = self.a.shape[0], self.b.shape[1], self.c.shape[0]
        shapes = (self.a.shape, self.b.shape, self.c.shape, self.d.shape)
        if shapes != ((n, n), (n, m), (p, n), (p, m)):
            raise NumericsError(f"matrices of shapes {shapes} do not make a state-space system")
        if not all(np.isfinite(matrix).all() for matrix in (self.a, self.b, self.c, self.d)):
            raise NumericsError("a state-space matrix holds a number that is not finite")

    @classmethod
    def of(cls, a: ArrayLike, b: ArrayLike, c: ArrayLike, d: ArrayLike) -> Self:
        """The system with these matrices; an empty A makes a static gain of the shape of D."""
        d_matrix = np.atleast_2d(np.asarray(d, dtype=float))
        a_matrix = np.asarray(a, dtype=float)
        n = 0 if a_matrix.size == 0 else a_matrix.shape[0]
        return cls(
            a_matrix.reshape(n, n),
            np.asarray(b, dtype=float).reshape(n, d_matrix.shape[1]),
            np.asarray(c, dtype=float).reshape(d_matrix.shape[0], n),
            d_matrix,
        )

    @classmethod
    def gain(cls, d: ArrayLike) -> Self:
        """The static gain y = D u."""
        return cls.of([], [], [], d)

    @property
    def order(self) -> int:
        """The number of states."""
        return int(self.a.shape[0])

    @property
    def inputs(self) -> int:
        """The number of inputs."""
        return int(self.b.shape[1])

    @property
    def outputs(self) -> int:
        """The number of outputs."""
        return int(self.c.shape[0])

    def poles(self) -> NDArray[np.complex128]:
        """The eigenvalues of A, in rad/s, sorted by real part and then by imaginary part."""
        return np.sort_complex(np.linalg.eigvals(self.a).astype(complex))

    def __call__(self, s: complex) -> NDArray[np.complex128]:
        """The transfer matrix C (s I − A)⁻¹ B + D at one complex frequency, of shape (p, m)."""
        resolvent = np.linalg.solve(s * np.eye(self.order) - self.a, self.b)
        return np.asarray(self.c @ resolvent + self.d, dtype=complex)

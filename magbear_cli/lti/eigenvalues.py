"""Eigenvalues, each with a bound of its rounding error: whether a pole is stable must not hang on last digits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig

from magbear_cli.lti.balancing import with_balanced_states
from magbear_cli.lti.state_space import StateSpace

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def eigenvalues_with_error(matrix: Floats) -> tuple[Complexes, Floats]:
    """The eigenvalues (n,) by ascending real part, and a first-order bound (n,) of their rounding errors."""
    n = matrix.shape[0]
    balanced = with_balanced_states(StateSpace(matrix, np.zeros((n, 1)), np.zeros((1, n)), np.zeros((1, 1)))).a
    values, left, right = eig(balanced, left=True, right=True)
    product = np.abs((left.conj() * right).sum(axis=0))
    lengths = np.linalg.norm(left, axis=0) * np.linalg.norm(right, axis=0)
    rounding = n * np.finfo(float).eps
    # a defective pair moves by the root of the change, which first order calls infinite
    error = np.linalg.norm(balanced) * np.minimum(rounding * lengths / np.maximum(product, 1e-300), np.sqrt(rounding))
    order = np.lexsort((values.imag, values.real))
    return np.asarray(values[order], dtype=complex), np.asarray(error[order], dtype=float)

"""A stored controller as an exact quotient of polynomials, and Routh's test, in rational arithmetic."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from magbear_cli.lti.state_space import StateSpace

Polynomial = list[Fraction]  # by descending powers of s


def exact_transfer_function(controller: StateSpace) -> tuple[Polynomial, Polynomial]:
    """C adj(s I − A) B + D det(s I − A) and det(s I − A), both with order + 1 coefficients, nothing cancelled.

    Faddeev and LeVerrier's recursion M ← A M + c I, c ← −tr(A M)/k in integers: every double is an integer over a power
    of two.
    """
    order = controller.order
    a, a_scale = _integers(controller.a)
    b, b_scale = _integers(controller.b)
    c, c_scale = _integers(controller.c)
    direct = Fraction(float(controller.d[0, 0]))
    den, num = [1], []
    matrix = _identity(order)
    for k in range(1, order + 1):
        num.append(int((c @ matrix @ b)[0, 0]))
        product = a @ matrix
        coefficient = -int(np.trace(product)) // k
        den.append(coefficient)
        matrix = product + coefficient * _identity(order)
    # The integers belong to a_scale·A: the coefficient of s^(n−k) carries a_scale^k, that of C adj B one power less.
    denominator = [Fraction(value, a_scale**k) for k, value in enumerate(den)]
    strictly = [Fraction(0), *(Fraction(value, a_scale**k * b_scale * c_scale) for k, value in enumerate(num))]
    return [s + direct * d for s, d in zip(strictly, denominator, strict=True)], denominator


def is_hurwitz(polynomial: Polynomial) -> bool:
    """Whether all roots lie in the open left half-plane, by Routh's array; a zero in its first column means no."""
    sign = 1 if polynomial[0] > 0 else -1
    upper, lower = [sign * c for c in polynomial[0::2]], [sign * c for c in polynomial[1::2]]
    if upper[0] == 0:
        return False
    while lower:
        if lower[0] <= 0:
            return False
        ratio = upper[0] / lower[0]
        padded = [*lower[1:], *([Fraction(0)] * (len(upper) - len(lower)))]
        upper, lower = lower, [u - ratio * value for u, value in zip(upper[1:], padded, strict=True)]
    return True


def _integers(matrix: NDArray[np.float64]) -> tuple[NDArray[np.object_], int]:
    """The matrix times the least power of two that makes every entry an integer."""
    entries = [Fraction(float(value)) for value in matrix.ravel()]
    scale = max((entry.denominator for entry in entries), default=1)
    whole = np.empty(len(entries), dtype=object)
    whole[:] = [int(entry * scale) for entry in entries]
    return whole.reshape(matrix.shape), scale


def _identity(order: int) -> NDArray[np.object_]:
    identity = np.empty((order, order), dtype=object)
    identity[:] = 0
    for k in range(order):
        identity[k, k] = 1
    return identity

"""The Riccati solver against its equation, closed forms and bad data."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.riccati import solve_care


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 10_000), st.integers(1, 8), st.integers(1, 3))
def test_residual_and_stability(seed: int, n: int, m: int) -> None:
    """For random data the equation holds, X is symmetric and not negative, and the feedback stabilises."""
    generator = np.random.default_rng(seed)
    a, b = generator.standard_normal((n, n)), generator.standard_normal((n, m))
    root = generator.standard_normal((n, n))
    q, r = root @ root.T + np.eye(n), np.diag(generator.uniform(0.1, 10.0, m))
    x, residual = solve_care(a, b, q, r)
    gain = np.linalg.solve(r, b.T @ x)
    assert residual < 1e-11
    np.testing.assert_allclose(a.T @ x + x @ a - x @ b @ gain + q, 0.0, atol=1e-8 * (1 + np.abs(x).max() ** 2))
    np.testing.assert_array_equal(x, x.T)
    assert np.linalg.eigvalsh(x).min() > 0
    assert np.linalg.eigvals(a - b @ gain).real.max() < 0


@given(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(-6.0, 6.0))
@settings(deadline=None, max_examples=40)
def test_scalar_closed_form(q_exponent: float, r_exponent: float, a: float) -> None:
    """2aX − X²/R + Q = 0 has the root R(a + √(a² + Q/R)), over eighteen decades of weights."""
    q, r = 10.0**q_exponent, 10.0**r_exponent
    x, residual = solve_care(*(np.array([[value]]) for value in (a, 1.0, q, r)))
    root = np.hypot(a, np.sqrt(q / r))
    exact = r * (a + root) if a >= 0 else q / (root - a)
    assert x[0, 0] == pytest.approx(exact, rel=1e-6)
    assert residual <= 1e-8


@pytest.mark.parametrize(
    ("a", "b", "q", "r", "sentence"),
    [
        ([[np.nan]], [[1.0]], [[1.0]], [[1.0]], "not finite"),
        ([[1.0]], [[1.0]], [[-1.0]], [[1.0]], "Q is not positive"),
        ([[1.0]], [[1.0]], [[1.0]], [[0.0]], "R is not positive"),
        ([[1.0]], [[1.0]], [[1.0]], [[-2.0]], "R is not positive"),
        ([[1.0, 0.0], [0.0, 2.0]], [[1.0], [1.0]], [[1.0, 0.5], [0.0, 1.0]], [[1.0]], "not symmetric"),
        ([[1.0]], [[0.0]], [[1.0]], [[1.0]], "no stabilising solution"),
        ([[0.0]], [[1.0]], [[0.0]], [[1.0]], "stabilis"),
        ([[0.0, 1.0], [-4.0, 0.0]], [[0.0], [1.0]], [[0.0, 0.0], [0.0, 0.0]], [[1.0]], "stabilis"),
    ],
)
def test_bad_data_get_a_sentence(
    a: list[list[float]], b: list[list[float]], q: list[list[float]], r: list[list[float]], sentence: str
) -> None:
    """Data outside the assumptions end in a sentence and not in a number."""
    with pytest.raises(NumericsError, match=sentence):
        solve_care(*(np.array(matrix) for matrix in (a, b, q, r)))


def test_a_stable_plant_without_cost_needs_no_control() -> None:
    """Q = 0 and a stable A: the stabilising solution is zero, exactly."""
    generator = np.random.default_rng(0)
    a, b = generator.standard_normal((4, 4)) - 4.0 * np.eye(4), generator.standard_normal((4, 2))
    x, residual = solve_care(a, b, np.zeros((4, 4)), np.eye(2))
    assert not x.any()
    assert residual == 0.0

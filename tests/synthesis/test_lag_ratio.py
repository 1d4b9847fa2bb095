"""Controllers as quotients of lag combinations."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.synthesis.lag_ratio import LagRatio, lag_basis


@given(seed=st.integers(0, 10_000), order=st.integers(1, 6))
@settings(deadline=None, max_examples=50)
def test_the_state_space_system_is_the_quotient(seed: int, order: int) -> None:
    """The realisation of X/Y has order n and the response of the quotient, at ∞ too."""
    rng = np.random.default_rng(seed)
    poles = np.sort(np.geomspace(0.1, 100.0, order) * rng.uniform(0.9, 1.1, order))
    ratio = LagRatio(poles, rng.normal(size=order + 1), np.append(1.0, rng.uniform(-0.05, 1.0, order)))
    system = ratio.controller()
    omega = np.append(np.geomspace(0.01, 1e4, 20), np.inf)
    direct = ratio.response(omega)
    assert system.order == order
    np.testing.assert_allclose([system(1j * w)[0, 0] for w in omega[:-1]], direct[:-1], rtol=1e-8, atol=1e-10)
    assert system.d[0, 0] == direct[-1]


def test_a_new_lag_changes_nothing() -> None:
    """A lag that is not used yet leaves the response as it was."""
    ratio = LagRatio(np.array([3.0]), np.array([-5.0, 2.0]), np.array([1.0, 0.5]))
    omega = np.geomspace(0.1, 100.0, 9)
    np.testing.assert_allclose(ratio.with_lag(40.0).response(omega), ratio.response(omega), rtol=1e-14)


def test_the_basis_ends_at_one_and_at_zero() -> None:
    """At rest every lag is one, at ∞ only the constant is left."""
    basis = lag_basis(np.array([1.0, 10.0]), np.array([0.0, np.inf]))
    np.testing.assert_array_equal(basis, [[1, 1, 1], [1, 0, 0]])

"""The chain of all-pass sections and the controllers over it."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.lti.frequency import frequency_response
from magbear_cli.synthesis.lag_chain import ChainRatio, chain_basis


def test_the_functions_are_orthogonal_on_the_axis() -> None:
    """Two different lags of the chain integrate against each other to zero, whatever their poles."""
    poles = np.array([1.0, 1.1, 3.0, 50.0])
    angle = (np.arange(200_000) + 0.5) * np.pi / 200_000 - np.pi / 2
    omega = 10.0 * np.tan(angle)
    lags = chain_basis(poles, omega)[:, 1:]
    weights = 10.0 / np.cos(angle) ** 2 * np.pi / angle.size
    gram = (lags.conj().T * weights) @ lags
    np.testing.assert_allclose(gram, np.diag(4.0 * np.pi * poles), rtol=1e-6, atol=1e-3)


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 12), st.integers(0, 2**32 - 1))
def test_the_state_space_form_has_the_response_of_the_ratio(order: int, seed: int) -> None:
    """The quotient's matrices give X/Y at every frequency, ends included."""
    rng = np.random.default_rng(seed)
    ratio = ChainRatio(
        np.geomspace(0.1, 100.0, order), rng.normal(size=order + 1), np.append(2.0, 0.3 * rng.normal(size=order))
    )
    omega = np.concatenate([[0.0], np.geomspace(1e-3, 1e4, 40), [np.inf]])
    expected = ratio.response(omega)
    found = frequency_response(ratio.controller(), omega)[:, 0, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-9 * np.abs(expected).max())

"""Rational matrix scales: they follow the data, and are stable and of minimum phase whatever the data."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from magbear_cli.lti.connection import series
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.synthesis.matrix_scale_fit import fit_matrix_scale

Complexes = NDArray[np.complex128]

OMEGA = np.geomspace(1e-2, 1e2, 40)


def _square(d: Complexes) -> Complexes:
    return np.asarray(d.conj().swapaxes(1, 2) @ d)


@settings(deadline=None, max_examples=4)
@given(seed=st.integers(0, 10**6), order=st.integers(0, 2))
def test_fits_are_stable_and_minimum_phase(seed: int, order: int) -> None:
    """Of any positive definite data, noise included, D and D⁻¹ are stable, inverse to each other, and of that order."""
    random = np.random.default_rng(seed)
    noise = random.normal(size=(OMEGA.size, 2, 2)) + 1j * random.normal(size=(OMEGA.size, 2, 2))
    fits = fit_matrix_scale(OMEGA, _square(noise) + 0.1 * np.eye(2), random.uniform(0.1, 1.0, OMEGA.size), order)
    assert len(fits) >= 2
    for fit in fits:
        left, inverse = fit.left(), fit.right_inverse()
        assert left.order in {0, 2 * order}
        assert max(left.poles().real.max(initial=-1.0), inverse.poles().real.max(initial=-1.0)) < 0
        one = frequency_response(series(inverse, left), OMEGA)
        assert np.abs(one - np.eye(2)).max() < 1e-6
        d, d_inverse = fit.response(OMEGA)
        np.testing.assert_allclose(d @ d_inverse, np.broadcast_to(np.eye(2), d.shape), atol=1e-9)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_matrix_of_the_family_is_found_again(seed: int) -> None:
    """The spectrum of a full 2x2 system with two poles of each row is met to rounding by the best fit of order two."""
    random = np.random.default_rng(seed)
    poles = np.diag([0.3, 0.3, 5.0, 5.0])
    enter = np.kron(np.array([[0.5], [2.0]]), np.eye(2))
    truth = StateSpace(-poles, enter, 0.5 * random.normal(size=(2, 4)), np.eye(2) + 0.3 * random.normal(size=(2, 2)))
    spectra = _square(frequency_response(truth, OMEGA))
    best = fit_matrix_scale(OMEGA, spectra, np.ones(OMEGA.size), 2)[0]
    found = _square(frequency_response(best.left(), OMEGA))
    assert np.abs(found - spectra).max() < 1e-6 * np.abs(spectra).max()

"""Rational D-scales: they follow the data, and are stable and minimum phase whatever the data."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.lti.connection import inverse, series
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.synthesis.scale_fit import ScaleFit, fit_scale

OMEGA = np.geomspace(1e-2, 1e2, 60)


@settings(deadline=None, max_examples=15)
@given(seed=st.integers(0, 10**6), order=st.integers(0, 4))
def test_fits_are_stable_and_minimum_phase(seed: int, order: int) -> None:
    """Of any data, noise included, the fit and its inverse are stable, of that order, and inverse to each other."""
    random = np.random.default_rng(seed)
    log_d = random.normal(size=OMEGA.size) * 3.0 + random.normal() * np.log(OMEGA)
    for fit in fit_scale(OMEGA, log_d, random.uniform(0.0, 1.0, OMEGA.size), order):
        system = fit.system()
        assert system.order == order
        assert order == 0 or system.poles().real.max() < 0
        assert order == 0 or inverse(system).poles().real.max() < 0
        assert np.abs(frequency_response(system, OMEGA)[:, 0, 0]) == pytest.approx(np.exp(fit.log_magnitude(OMEGA)))
        one = frequency_response(series(system, inverse(system)), OMEGA)[:, 0, 0]
        assert np.abs(one - 1.0).max() < 1e-6


@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_function_of_the_family_is_found_again(order: int) -> None:
    """Data from real zeros and poles are met to rounding by the best fit of the same order."""
    corners = np.geomspace(0.05, 20.0, 2 * order)
    truth = ScaleFit(1.3, corners[::2], corners[1::2])
    best = fit_scale(OMEGA, truth.log_magnitude(OMEGA), np.ones(OMEGA.size), order)[0]
    assert np.abs(best.log_magnitude(OMEGA) - truth.log_magnitude(OMEGA)).max() < 1e-3


def test_weights_decide_where_the_fit_is_good() -> None:
    """A slope that no fit of order one follows everywhere is followed where the weight is."""
    log_d = -2.0 * np.log(OMEGA)
    left = fit_scale(OMEGA, log_d, np.where(OMEGA < 0.3, 1.0, 1e-3), 1)[0].log_magnitude(OMEGA) - log_d
    right = fit_scale(OMEGA, log_d, np.where(OMEGA > 3.0, 1.0, 1e-3), 1)[0].log_magnitude(OMEGA) - log_d
    slow, fast = OMEGA < 0.3, OMEGA > 3.0
    assert np.abs(left[slow]).max() < np.abs(right[slow]).max()
    assert np.abs(right[fast]).max() < np.abs(left[fast]).max()

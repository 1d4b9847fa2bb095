"""Poles of a function known by samples."""

from __future__ import annotations

import numpy as np
import pytest

from magbear_cli.synthesis.all_pass_sections import Sections
from magbear_cli.synthesis.pole_fit import fit_poles

OMEGA = np.geomspace(0.01, 1e3, 120)


def test_a_rational_function_gives_its_poles_back() -> None:
    """From log-spaced real poles the fit finds the complex and real poles of a function of that order."""
    poles = np.array([-2.0 + 9.0j, -2.0 - 9.0j, -0.5, -40.0, -5.0], dtype=complex)
    truth = Sections.of_poles(poles)
    values = truth.functions(OMEGA) @ np.array([1.0, 2.0, -1.0, 0.5, 1.5, -0.7])
    start = Sections.of_poles(-np.geomspace(0.1, 100.0, 5).astype(complex))
    found = fit_poles(values, np.ones(OMEGA.size), OMEGA, start)
    assert np.poly(np.linalg.eigvals(found.chain()[0])) == pytest.approx(np.poly(poles).real, rel=1e-6)


def test_too_few_poles_still_come_near() -> None:
    """A function of many lags is met within one per cent by four stable poles."""
    lags = np.geomspace(1.0, 10.0, 12)
    values = (1.0 / (1j * OMEGA[:, None] + lags)).sum(axis=1)
    found = fit_poles(
        values, 1.0 / np.abs(values), OMEGA, Sections.of_poles(-np.geomspace(0.1, 100, 4).astype(complex))
    )
    functions = found.functions(OMEGA) / np.abs(values)[:, None]
    matrix = np.vstack([functions.real, functions.imag])
    target = np.concatenate([values.real, values.imag]) / np.tile(np.abs(values), 2)
    residual = matrix @ np.linalg.lstsq(matrix, target, rcond=None)[0] - target
    assert found.order == 4
    assert np.abs(residual).max() < 0.01

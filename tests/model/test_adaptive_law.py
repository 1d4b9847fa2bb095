"""The adaptive law is refused where its numbers are none, and its P is a Lyapunov solution."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.errors import NumericsError
from magbear_cli.model.adaptive_law import AdaptiveLaw

LAW = AdaptiveLaw(600.0, 1.0, 1.71e4, 52.8, 1200.0 / 52.8, 2e9, 1e-6, 0.5e-6)


@settings(deadline=None, max_examples=50)
@given(st.floats(1.0, 1e5), st.floats(0.05, 20.0))
def test_p_solves_its_equation(omega: float, zeta: float) -> None:
    """A_mᵀP + P A_m = −I, and P is positive definite."""
    p = replace(LAW, omega_rad_s=omega, zeta=zeta).lyapunov
    a = np.array([[0.0, 1.0], [-(omega**2), -2.0 * zeta * omega]])
    left = a.T @ p + p @ a
    size = np.abs(a).max() * np.abs(p).max()
    assert np.abs(left + np.eye(2)).max() <= 1e-12 * max(size, 1.0)
    assert np.linalg.eigvalsh(p).min() > 0.0


def test_the_sphere_has_two_borders() -> None:
    """The adaptation of Table 4.2 begins at 1.5 µm and ends at 0.5 µm."""
    assert pytest.approx(1.5e-6) == LAW.outer_m
    assert pytest.approx(0.5e-6) == LAW.inner_m


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("omega_rad_s", 0.0),
        ("zeta", -1.0),
        ("input_gain_m_per_s2_a", np.inf),
        ("rho_m", 0.0),
        ("gamma", -1.0),
        ("sigma_m", 2e-6),
        ("gain_position_a_per_m", np.nan),
        ("taylor_order", 2),
        ("trigger", "sphere"),
    ],
)
def test_a_law_that_is_none_is_refused(name: str, value: float | str) -> None:
    """A number that describes no law is refused by its name."""
    with pytest.raises(NumericsError):
        replace(LAW, **{name: value})  # type: ignore[arg-type]

"""A spectral factor gives the spectrum back, and is stable with a stable inverse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.spectral_factor import spectral_factor

POINTS = 1j * np.geomspace(1e-2, 1e2, 30)


@settings(deadline=None, max_examples=25)
@given(seed=st.integers(0, 2**32 - 1), order=st.integers(1, 5), size=st.integers(1, 3))
def test_the_factor_gives_the_spectrum_back(seed: int, order: int, size: int) -> None:
    """W(jω)ᴴ W(jω) is Z + Zᴴ, and the zeros of W lie in the left half-plane, for Z made positive real by its gain."""
    random = np.random.default_rng(seed)
    a = random.normal(size=(order, order))
    a -= (np.linalg.eigvals(a).real.max() + 0.3) * np.eye(order)
    b, c = random.normal(size=(order, size)), random.normal(size=(size, order))
    z = np.stack([c @ np.linalg.solve(s * np.eye(order) - a, b) for s in POINTS])
    both = z + z.conj().swapaxes(1, 2)
    r = (0.5 - min(0.0, 1.5 * float(np.linalg.eigvalsh(both).min()))) * np.eye(size)
    try:
        c_w, d_w = spectral_factor(a, b, c, r)
    except NumericsError:  # negative between the points
        return
    w = np.stack([d_w + c_w @ np.linalg.solve(s * np.eye(order) - a, b) for s in POINTS])
    np.testing.assert_allclose(w.conj().swapaxes(1, 2) @ w, both + r, rtol=1e-6, atol=1e-6 * np.abs(r).max())
    assert np.linalg.eigvals(a - b @ np.linalg.solve(d_w, c_w)).real.max() < 0


def test_a_known_factor_is_found_again() -> None:
    """(s + 2)/(s + 1) from its square on the axis, (4 − s²)/(1 − s²) = 1 + 1.5/(1 + s) + 1.5/(1 − s)."""
    c_w, d_w = spectral_factor(np.array([[-1.0]]), np.array([[1.0]]), np.array([[1.5]]), np.array([[1.0]]))
    assert d_w[0, 0] == pytest.approx(1.0)
    assert c_w[0, 0] == pytest.approx(1.0)


@pytest.mark.parametrize(("c", "r"), [(-1.0, 1.0), (1.0, -1.0), (0.0, 0.0), (float("nan"), 1.0)])
def test_what_is_not_positive_has_no_factor(c: float, r: float) -> None:
    """A spectrum that is negative somewhere, at ω = 0 or at ∞, and numbers that are none end in a sentence."""
    with pytest.raises(NumericsError, match="spectrum"):
        spectral_factor(np.array([[-1.0]]), np.array([[1.0]]), np.array([[c]]), np.array([[r]]))

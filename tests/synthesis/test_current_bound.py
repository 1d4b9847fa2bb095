"""Lower bounds of the least peak of |K S|."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.model.scaling import scale_problem
from magbear_cli.synthesis import current_bound
from magbear_cli.synthesis.all_pass_sections import Sections
from magbear_cli.synthesis.current_bound import least_peak_bound
from magbear_cli.synthesis.section_controller import SectionController

Maker = Callable[[float, float, float | None], ControlProblem]


@settings(deadline=None, max_examples=25)
@given(
    q=st.lists(st.integers(-5, 5).map(float), min_size=3, max_size=3),
    multiplier=st.lists(st.integers(-4, 4).map(float), min_size=5, max_size=5),
)
def test_the_integral_is_the_same_for_every_controller(q: list[float], multiplier: list[float]) -> None:
    """∫ Re(K S h) dω = 2π L(1), whatever the controller and the multiplier: the identity that the bound rests on."""
    form = SectionController(Sections(np.array([[8.0, 30.0], [20.0, 200.0], [5.0, 50.0]])), np.array(q))
    poles, omega = Sections(np.array([[3.0, 2.0], [10.0, 40.0]])), np.geomspace(1e-6, 1e7, 6000)
    h = current_bound._functions(poles, omega) @ np.array(multiplier)
    integral = current_bound._weights(omega) @ (form.control_sensitivity(omega) * h).real
    expected = 2.0 * np.pi * float(current_bound._at_one(poles) @ np.array(multiplier))
    assert integral == pytest.approx(expected, abs=1e-4 * (1.0 + np.abs(q).max()))


def test_without_a_specification_the_bound_is_the_known_one() -> None:
    """To hold an unstable pole at all |K S| must reach four times k_z/k_i: −4 (s − 1)/(s + 1) is the least."""
    weight = RationalWeight.low_pass(1e-4, 1.0)
    scaled = ControlProblem.of_mass(1.0, 1.0, (1.0, 1.0), weight)
    assert least_peak_bound(scaled, "real", (0.3, 20.0), 4.1) == pytest.approx(4.0, rel=2e-3)


def test_the_bound_is_close_below_what_was_reached(thrust_problem: Maker) -> None:
    """For 3.0-4.5 kg no controller takes less than 6.6 A per 10 µm (real mass); one of four states takes 6.82 A."""
    scaled, scaling = scale_problem(thrust_problem(3.0, 4.5, None))
    unit = scaling.gain_a_per_m * 10e-6
    assert 6.6 <= least_peak_bound(scaled, "real", (1.0, 60.0), 6.82 / unit) * unit <= 6.82


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 10_000))
def test_the_largest_over_discs_is_not_exceeded(seed: int) -> None:
    """No point of all discs has a larger Re(r h) than the one that is computed, and some come near."""
    random = np.random.default_rng(seed)
    centre = random.normal(size=(2, 1)) + 1j * random.normal(size=(2, 1))
    radius = np.abs(centre) * random.uniform(0.9, 2.0, size=(2, 1)) + 0.05
    h = random.normal(size=1) + 1j * random.normal(size=1)
    largest = float(current_bound._largest(h, current_bound.Discs(centre, radius), 1.0)[0])
    r = random.uniform(-1, 1, 40_000) + 1j * random.uniform(-1, 1, 40_000)
    inside = (np.abs(r - centre) <= radius).all(axis=0) & (np.abs(r) <= 1.0)
    values = (r[inside] * h).real
    assert values.max() <= largest + 1e-9
    assert values.max() >= largest - 0.1 * np.abs(h[0])

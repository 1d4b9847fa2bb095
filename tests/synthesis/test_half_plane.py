"""Cone rows about a present controller."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import control_sensitivity
from magbear_cli.model.scaling import scale_problem
from magbear_cli.synthesis.fixed_order import best_lead
from magbear_cli.synthesis.frequency_span import frequency_span
from magbear_cli.synthesis.half_plane import (
    complex_mu_level,
    complex_mu_rows,
    control_rows,
    real_mass_level,
    real_mass_rows,
    widest_margin,
)

Maker = Callable[[float, float, float | None], ControlProblem]


@pytest.mark.parametrize("high_kg", [3.0, 3.5, 4.5])
@pytest.mark.parametrize(("level", "rows"), [(real_mass_level, real_mass_rows), (complex_mu_level, complex_mu_rows)])
def test_the_present_controller_meets_its_own_level_and_none_below(
    thrust_problem: Maker, high_kg: float, level: Callable[..., np.ndarray], rows: Callable[..., object]
) -> None:
    """At each frequency the rows of the present controller's level are tight: exact, not only sufficient."""
    scaled, _ = scale_problem(thrust_problem(3.0, high_kg, 2e4))
    lead = best_lead(scaled)
    v = np.concatenate([lead.x, lead.y])
    for omega in np.geomspace(0.05, 500.0, 9):
        grid = np.array([0.9 * omega, omega, 1.1 * omega])
        here = level(scaled, lead.response(grid), grid)[1]
        built = rows(scaled, lead, grid, here)
        left = built.mix @ np.abs(built.moduli @ v)  # type: ignore[attr-defined]
        right = (built.side @ v).real  # type: ignore[attr-defined]
        slack = ((right - left) / np.abs(right)).reshape(-1, 3)[:, 1]
        assert slack.min() == pytest.approx(0.0, abs=2e-6)


def test_a_lower_level_is_reached_where_the_margin_is_positive(thrust_problem: Maker) -> None:
    """What the cone program proposes with a positive margin meets the level at every frequency of its grid."""
    scaled, _ = scale_problem(thrust_problem(3.0, 4.5, 2e4))
    span = frequency_span(scaled)
    omega = span.grid(60)
    lead = best_lead(scaled)
    target = 0.99 * float(real_mass_level(scaled, lead.response(omega), omega).max())
    better, margin = widest_margin(real_mass_rows(scaled, lead, omega, target), lead, span.fastest_pole)
    assert margin > 0
    assert real_mass_level(scaled, better.response(omega), omega).max() <= target * (1 + 1e-6)
    assert better.controller().poles().real.sum() >= -span.fastest_pole * (1 + 1e-6)


def test_the_rows_of_the_current_bound_k_s(thrust_problem: Maker) -> None:
    """|K S| ≤ bound holds with equality at the bound that is |K S| itself."""
    scaled, _ = scale_problem(thrust_problem(3.0, 4.5, None))
    lead = best_lead(scale_problem(thrust_problem(3.0, 4.5, 2e4))[0])
    omega = np.array([0.3, 3.0, 30.0])
    ks = np.abs(control_sensitivity(scaled, lead.response(omega), omega))
    v = np.concatenate([lead.x, lead.y])
    for index, bound in enumerate(ks):
        rows = control_rows(scaled, lead, omega, bound)
        assert np.abs(rows.moduli @ v)[index] == pytest.approx(float((rows.side @ v).real[index]), rel=1e-9)

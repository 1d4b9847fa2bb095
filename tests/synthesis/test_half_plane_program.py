"""The half-plane condition over a chain of lags."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import worst_level
from magbear_cli.model.scaling import scale_problem
from magbear_cli.synthesis.fixed_order import best_lead
from magbear_cli.synthesis.frequency_span import frequency_span
from magbear_cli.synthesis.half_plane_program import HalfPlaneProgram
from magbear_cli.synthesis.stabilisation import stabilises

ProblemMaker = Callable[[float, float, float | None], ControlProblem]


def test_what_satisfies_the_condition_stabilises_and_has_at_most_its_level(thrust_problem: ProblemMaker) -> None:
    """With θ = 1 the answer of one program stabilises every mass, and its exact worst case is below the target."""
    scaled, _ = scale_problem(thrust_problem(3.0, 4.5, 1e4))
    span = frequency_span(scaled)
    lead = best_lead(scaled)
    program = HalfPlaneProgram(scaled, np.geomspace(span.slow, 5 * span.fast, 8), float(np.sqrt(span.fast)), lead)
    omega, dense = span.grid(90), span.grid(1000)
    candidate = program.widest_margin(lead, program.free_directions(omega), omega, 0.8)
    assert program.level(candidate, program.free_directions(dense), dense).max() < 0.8
    assert stabilises(scaled, candidate.controller())
    worst = worst_level(scaled, candidate.response(dense), dense)[0]
    assert worst.max() < 0.8


def test_held_directions_never_lose_what_the_present_controller_has(thrust_problem: ProblemMaker) -> None:
    """In its own directions a controller meets the condition at its own exact level, frequency by frequency."""
    scaled, _ = scale_problem(thrust_problem(3.0, 4.5, 1e4))
    span = frequency_span(scaled)
    lead = best_lead(scaled)
    program = HalfPlaneProgram(scaled, np.geomspace(span.slow, 5 * span.fast, 8), float(np.sqrt(span.fast)), lead)
    omega = span.grid(200)
    level = worst_level(scaled, lead.response(omega), omega)[0]
    directions = program.directions_of(lead)(omega)
    x, y = lead.numerator_denominator(omega)
    for share in scaled.family.end_shares:
        plant = scaled.plant(omega[1:-1], share)
        chi = (y[1:-1] / plant - x[1:-1]) * directions[1:-1]
        radius = scaled.performance_bound(omega[1:-1]) * np.abs(y[1:-1] / plant)
        radius += scaled.bandwidth_bound(omega[1:-1]) * np.abs(x[1:-1])
        assert (radius <= level[1:-1] * chi.real * (1 + 1e-9)).all()


def test_directions_are_unit_numbers(thrust_problem: ProblemMaker) -> None:
    """Both kinds of direction only turn, and at ω = ∞ the free one points the way of −d."""
    scaled, _ = scale_problem(thrust_problem(3.0, 4.5, 1e4))
    lead = best_lead(scaled)
    program = HalfPlaneProgram(scaled, np.array([1.0, 10.0]), 3.0, lead)
    omega = np.array([0.0, 1.0, 50.0, np.inf])
    for directions in (program.free_directions(omega), program.directions_of(lead)(omega)):
        np.testing.assert_allclose(np.abs(directions), 1.0)
    assert program.free_directions(omega)[-1] == pytest.approx(-1.0)

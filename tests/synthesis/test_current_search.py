"""The search over given poles, and over moving ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.scaling import scale_problem
from magbear_cli.synthesis.all_pass_sections import Sections
from magbear_cli.synthesis.current_search import MET, CurrentSearch
from magbear_cli.synthesis.current_wish import CurrentWish
from magbear_cli.synthesis.fixed_order import FixedOrderOptions, search_order
from magbear_cli.synthesis.frequency_span import frequency_span
from magbear_cli.synthesis.lag_ratio import LagRatio

Maker = Callable[[float, float, float | None], ControlProblem]


def _begun(problem: ControlProblem) -> tuple[CurrentSearch, LagRatio]:
    scaled, _ = scale_problem(problem)
    span = frequency_span(scaled)
    search = CurrentSearch(scaled, "real", CurrentWish(), span.grid(500, margin=1e3), span.grid(60))
    return search, search_order(scaled, FixedOrderOptions()).controller


def test_more_poles_take_less_and_moved_ones_less_still(thrust_problem: Maker) -> None:
    """All that is reached meets the specification; a subset of poles costs more; moving them costs nothing."""
    search, lead = _begun(thrust_problem(3.0, 4.5, 2e4))
    speeds = np.geomspace(0.7, 80.0, 8)
    many = search.settle(lead, Sections(np.stack([3.0 * speeds, 2.0 * speeds**2], axis=1)))
    few = search.settle(many.form, Sections(np.array([[25.0, 500.0], [25.0, 500.0], [3.0, 2.0]])))
    moved = search.polish(few)
    assert max(many.level, few.level, moved.level) <= MET
    assert many.cost < few.cost
    assert moved.cost < 0.97 * few.cost
    assert moved.cost == pytest.approx(moved.peak_ks)


def test_peaks_between_the_constraints_join_them(thrust_problem: Maker) -> None:
    """From very few constrained frequencies the search finds those it lacks."""
    search, lead = _begun(thrust_problem(3.0, 4.5, 2e4))
    search.omega = search.omega[::6]
    before = search.omega.size
    speeds = np.geomspace(0.7, 80.0, 6)
    answer = search.settle(lead, Sections(np.stack([3.0 * speeds, 2.0 * speeds**2], axis=1)))
    assert search.omega.size > before
    assert answer.level <= MET

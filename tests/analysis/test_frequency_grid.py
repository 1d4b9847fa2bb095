"""The grid reaches past all dynamics and is fine where damping is light."""

from __future__ import annotations

import numpy as np

from magbear_cli.analysis.frequency_grid import closed_frequency_grid, frequency_grid, loop_roots
from magbear_cli.lti.conversion import from_transfer_function
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem


def test_the_grid_reaches_past_the_dynamics(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """Ascending, positive, from far below the slowest root to far above the fastest."""
    grid = frequency_grid(quickstart, good_lead)
    speeds = np.abs(loop_roots(quickstart, good_lead))
    assert np.all(np.diff(grid) > 0)
    assert 0 < grid[0] <= 1e-3 * speeds.min()
    assert grid[-1] >= 1e3 * speeds.max() * (1 - 1e-12)


def test_the_grid_is_fine_near_a_light_pole(quickstart: ControlProblem) -> None:
    """A controller pole of 0.01 % damping has grid points within its half-width."""
    controller = from_transfer_function([-1e6, -1e9, -1e10], [1.0, 2e-4 * 3000.0, 3000.0**2])
    grid = frequency_grid(quickstart, controller)
    assert np.abs(grid - 3000.0).min() < 0.3
    assert (np.abs(grid - 3000.0) < 3.0).sum() > 10


def test_the_closed_grid_starts_at_zero_unless_a_pole_is_there(
    quickstart: ControlProblem, good_lead: StateSpace
) -> None:
    """ω = 0 is a point of the closed grid; with an integrator it is a frequency far below all dynamics."""
    assert closed_frequency_grid(quickstart, good_lead)[0] == 0.0
    integrator = from_transfer_function([-1e6, -1e8, -1e8], [1.0, 1e4, 0.0])
    grid = closed_frequency_grid(quickstart, integrator)
    assert 0.0 < grid[0] < 1e-3

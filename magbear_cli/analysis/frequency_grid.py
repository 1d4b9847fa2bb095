"""The frequencies at which a loop is looked at: a logarithmic grid over all its dynamics, finer near light damping."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from magbear_cli.analysis.pole_family import controller_poles, pole_family
from magbear_cli.lti.conversion import zeros_poles_gain
from magbear_cli.lti.resonance import resonance_frequencies
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_BEYOND = 1e3  # how far past the slowest and the fastest dynamics the grid reaches
_ALWAYS = (1.0, 1e6)  # rad/s that every grid covers
_MEMBERS = 9
_WIDEST_DECADES = 10.0  # a pole or zero farther than this from the plant and the bounds is a numerical infinity


def frequency_grid(problem: ControlProblem, controller: StateSpace, points_per_decade: int = 60) -> Floats:
    """Positive ascending frequencies (w,) in rad/s for one problem and one controller."""
    roots = loop_roots(problem, controller)
    speeds = np.abs(roots)
    low = min(float(speeds.min()) / _BEYOND, _ALWAYS[0])
    high = max(float(speeds.max()) * _BEYOND, _ALWAYS[1])
    count = int(np.ceil(points_per_decade * np.log10(high / low))) + 1
    resonances = resonance_frequencies(np.concatenate([roots, np.roots(problem.performance.num)]))
    return np.unique(np.concatenate([np.geomspace(low, high, count), np.geomspace(*_ALWAYS, 2), resonances]))


def closed_frequency_grid(problem: ControlProblem, controller: StateSpace, points_per_decade: int = 60) -> Floats:
    """The same grid with ω = 0 before it; where a pole there forbids that, a frequency that is as good as zero."""
    grid = frequency_grid(problem, controller, points_per_decade)
    return np.concatenate([[0.0 if is_regular_at_zero(problem, controller) else grid[0] * 1e-3], grid])


def loop_roots(problem: ControlProblem, controller: StateSpace) -> Complexes:
    """The poles and zeros (k,) in rad/s that shape the loop: plant, bounds, controller and closed loop.

    Roots at zero and roots farther from the plant and the bounds than any dynamics of interest are left out.
    """
    own = [problem.natural_rad_s, *problem.performance.poles_rad_s]
    own += [] if problem.omega_c_rad_s is None else [problem.omega_c_rad_s]
    zeros, _, _ = zeros_poles_gain(controller)
    poles, errors = controller_poles(controller)
    poles = poles[np.abs(poles) > errors]  # an integrator is seldom exactly at zero
    closed = pole_family(problem, controller, problem.family.shares(_MEMBERS)).poles_rad_s.ravel()
    given = np.array([root for root in own if root != 0], dtype=complex)
    known = np.abs(given)
    roots = np.concatenate([given, zeros, poles, closed])
    reach = 10.0**_WIDEST_DECADES
    return np.asarray(
        roots[(np.abs(roots) > known.min() / reach) & (np.abs(roots) < known.max() * reach)], dtype=complex
    )


def is_regular_at_zero(problem: ControlProblem, controller: StateSpace) -> bool:
    """Whether W1(0) is finite and K(0) exists."""
    if problem.performance.den[-1] == 0.0:
        return False
    poles, errors = controller_poles(controller)
    return bool((np.abs(poles) > errors).all())

"""Whether a controller, as stored, does what is claimed of it: judged anew from its matrices and the problem.

Nothing a synthesis method believes is used. The loop of every mass is rebuilt; its stability over the whole range is
shown by the closed-loop poles, by counting them on the Nyquist curve, and by the masses at which a pole can cross the
axis; its level is searched on masses × frequencies, densely and then around every bump, ends included.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from magbear_cli.analysis.frequency_grid import frequency_grid, is_regular_at_zero
from magbear_cli.analysis.loop_functions import controller_response
from magbear_cli.analysis.pole_family import AxisCrossings, PoleFamily, axis_crossings, pole_family
from magbear_cli.analysis.winding_number import UnstablePoles, dense_response, unstable_poles
from magbear_cli.errors import NumericsError
from magbear_cli.lti.balancing import with_balanced_states
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem

Floats = NDArray[np.float64]

_RESPONSE_AGREEMENT = 1e-2  # of 1 − K G; what disagreement there is counts against the level
_MASSES = 33
_POINTS_PER_DECADE = 120
_COUNTED_MASSES = 3  # the two ends and the middle of 1/m; between them the crossings decide
_BUMPS = 24
_ZOOMS = 8
_ZOOM_POINTS = 9


@dataclass(frozen=True)
class Verification:
    """The verdict with its sentence, the worst level that was found, and figures for the log."""

    verified: bool
    sentence: str
    worst_level: float
    statistics: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class _Stability:
    is_stable: bool
    sentence: str
    statistics: Mapping[str, float] = field(default_factory=dict)


def verify(
    problem: ControlProblem, controller: StateSpace, level: float = 1.0, *, tolerance: float = 1e-3
) -> Verification:
    """Judge a controller against a level: |W1 S| + |W3 T| ≤ level·(1 + tolerance) and stable for every mass.

    Parameters
    ----------
    controller : from measured position in m to control current in A, as it will be stored
    level : what is claimed
    tolerance : how far above the claim the recomputed level may lie

    Returns
    -------
    Verification
        ``verified`` only if stability was shown for the whole range, in every way, and the level was met. The worst
        level is infinite for a loop that is unstable, NaN where it could not be computed.
    """
    if not np.isfinite(level) or level <= 0:
        return _refused(f"the level to verify must be a positive number, not {level}")
    if (controller.inputs, controller.outputs) != (1, 1):
        return _refused("the controller does not map one measurement to one current")
    try:
        with np.errstate(all="ignore"):
            # powers of two: the same controller to the last bit
            return _verify(problem, with_balanced_states(controller), level * (1.0 + tolerance))
    except (NumericsError, np.linalg.LinAlgError, FloatingPointError) as error:
        return _refused(f"the loop could not be computed: {error}")


def _verify(problem: ControlProblem, controller: StateSpace, limit: float) -> Verification:
    grid = frequency_grid(problem, controller, _POINTS_PER_DECADE)
    stability = _stability(problem, controller, grid)
    if not stability.is_stable:
        return _refused(stability.sentence, float("inf"), stability.statistics)
    disagreement = response_disagreement(problem, controller, grid)
    if not disagreement <= _RESPONSE_AGREEMENT:
        sentence = f"two ways to evaluate the controller change the loop by {disagreement:.2g} of itself: its matrices"
        return _refused(f"{sentence} are too ill-conditioned to be judged", statistics=stability.statistics)
    worst, mass, omega = worst_level(problem, controller, grid)
    statistics = {
        "response_disagreement": disagreement,
        **stability.statistics,
        "worst_mass_kg": mass,
        "worst_omega_rad_s": omega,
    }
    statistics |= {"frequencies": float(grid.size), "limit": limit}
    if not np.isfinite(worst):
        return _refused("the level is not finite at some mass and frequency", statistics=statistics)
    place = f"at m = {mass:.4g} kg and ω = {omega:.4g} rad/s"
    # K known to a relative error e of 1 − K G leaves the level uncertain by about 2 e of itself
    if worst * (1.0 + 2.0 * disagreement) > limit:
        doubt = f" with a rounding error of {2.0 * disagreement:.1g} of itself" if worst <= limit else ""
        sentence = f"the recomputed level {worst:.5g} {place}{doubt} exceeds {limit:.5g}"
        return _refused(sentence, worst, statistics)
    sentence = f"stable for every mass, and the recomputed level is {worst:.5g} {place}"
    return Verification(verified=True, sentence=sentence, worst_level=worst, statistics=statistics)


def _refused(
    sentence: str, worst_level: float = float("nan"), statistics: Mapping[str, float] | None = None
) -> Verification:
    return Verification(verified=False, sentence=sentence, worst_level=worst_level, statistics=statistics or {})


def _stability(problem: ControlProblem, controller: StateSpace, grid: Floats) -> _Stability:
    """Whether the loop is stable for every mass, by three ways that must agree."""
    family = pole_family(problem, controller, problem.mass.samples_kg(_MASSES))
    counts = [
        unstable_poles(problem, controller, float(mass), grid) for mass in problem.mass.samples_kg(_COUNTED_MASSES)
    ]
    crossings = axis_crossings(problem, controller, grid)
    inside = crossings.within(problem.mass.low_kg * (1.0 - 1e-9), problem.mass.high_kg * (1.0 + 1e-9))
    statistics = {
        "max_pole_real_rad_s": family.max_real_rad_s,
        "nyquist_points": float(sum(count.points for count in counts)),
        "nyquist_unstable_poles": float(max((count.count or 0) for count in counts)),
        **_stable_masses(problem, crossings),
    }
    sentence = _objection(family, counts, inside)
    return _Stability(not sentence, sentence, statistics)


def _objection(family: PoleFamily, counts: list[UnstablePoles], inside: AxisCrossings) -> str:
    """Why stability is not shown; empty when it is.

    Where eigenvalues cannot tell the sign of a pole because of rounding, the count on the curve decides.
    """
    uncounted = next((count.reason for count in counts if count.count is None), "")
    if uncounted:
        return f"unstable poles could not be counted: {uncounted}"
    counted = max(count.count or 0 for count in counts)
    if family.certainly_unstable:
        row = int(family.poles_rad_s.real.max(axis=1).argmax())
        pole = f"a closed-loop pole at {family.max_real_rad_s:.4g} rad/s for m = {family.masses_kg[row]:.4g} kg"
        return f"{pole}, which the Nyquist count {'confirms' if counted else 'of the end masses does not see'}"
    if counted:
        return f"the Nyquist curve counts {counted} unstable poles, which the eigenvalues do not show"
    if inside.masses_kg.size:
        return (
            f"a closed-loop pole crosses the imaginary axis at m = {inside.masses_kg[0]:.4g} kg, "
            f"ω = {inside.omega_rad_s[0]:.4g} rad/s"
        )
    if family.max_real_rad_s >= 0.0 and any(count.shift_rad_s > 0.0 for count in counts):
        # the curve passed to the right of doubtful poles of K, so a hidden one among them has no other witness
        return "a closed-loop pole is on the imaginary axis to within rounding"
    return ""


def _stable_masses(problem: ControlProblem, crossings: AxisCrossings) -> dict[str, float]:
    """The nearest masses outside the range at which a pole crosses the axis, where there are any."""
    below = crossings.masses_kg[crossings.masses_kg < problem.mass.low_kg]
    above = crossings.masses_kg[crossings.masses_kg > problem.mass.high_kg]
    edges = {"stable_above_kg": below[-1:], "stable_below_kg": above[:1]}
    return {name: float(edge[0]) for name, edge in edges.items() if edge.size}


def response_disagreement(problem: ControlProblem, controller: StateSpace, omega_rad_s: Floats) -> float:
    """The largest change of 1 − K G, relative to itself, between K by dense solves and K by its Hessenberg form."""
    dense, other = dense_response(controller, 1j * omega_rad_s), controller_response(controller, omega_rad_s)
    force = problem.current_stiffness_n_per_a * dense
    changes = [
        np.abs(problem.current_stiffness_n_per_a * (dense - other))
        / np.abs(problem.dynamic_stiffness_n_per_m(omega_rad_s, mass) + force)
        for mass in (problem.mass.low_kg, problem.mass.high_kg)
    ]
    return float(np.max(changes))


def worst_level(problem: ControlProblem, controller: StateSpace, omega_rad_s: Floats) -> tuple[float, float, float]:
    """The largest |W1 S| + |W3 T| found over masses × frequencies: (level, mass in kg, ω in rad/s).

    Parameters
    ----------
    omega_rad_s : (w,) positive ascending grid

    Notes
    -----
    A dense grid first; then every bump of it is zoomed into in (1/m, log ω) together. At ω → ∞ the terms tend to
    |W1(∞)| and k_i |K(∞)|/(m ω_c²); at ω → 0 the loop is taken at zero, or far below its slowest dynamics.
    """
    inverse = 1.0 / problem.mass.samples_kg(_MASSES)
    at_zero = np.array([0.0 if is_regular_at_zero(problem, controller) else omega_rad_s[0] * 1e-3])
    omega = np.concatenate([at_zero, omega_rad_s])
    levels = _level(problem, controller, inverse[:, None], omega[None, :])
    if np.isnan(levels).any():
        return float("nan"), float("nan"), float("nan")
    row, column = np.unravel_index(int(levels.argmax()), levels.shape)
    found = [(float(levels[row, column]), float(1.0 / inverse[row]), float(omega[column]))]
    found.append((_level_at_infinity(problem, controller), problem.mass.low_kg, float("inf")))
    over_mass = levels.max(axis=0)
    columns = _bumps(over_mass)
    rows = levels[:, columns].argmax(axis=0)
    # 1/m falls along the rows
    x = np.stack([inverse[np.minimum(rows + 1, inverse.size - 1)], inverse[np.maximum(rows - 1, 0)]])
    w = np.log(np.stack([omega[np.maximum(columns - 1, 1)], omega[np.minimum(columns + 1, omega.size - 1)]]))
    found.append(_zoom(problem, controller, x, w))
    return max(found)


def _level(problem: ControlProblem, controller: StateSpace, inverse_mass: Floats, omega_rad_s: Floats) -> Floats:
    """|W1 S| + |W3 T| straight from the definitions of S and T, for arrays of 1/m and ω that broadcast.

    K is evaluated once for each ω of the array as given.
    """
    response = dense_response(controller, 1j * omega_rad_s.ravel()).reshape(omega_rad_s.shape)
    gain = response * problem.plant(omega_rad_s, 1.0 / inverse_mass)
    sensitivity = 1.0 / (1.0 - gain)
    weighted = problem.performance_bound(omega_rad_s) * np.abs(sensitivity)
    return np.asarray(weighted + problem.bandwidth_bound(omega_rad_s) * np.abs(gain * sensitivity), dtype=float)


def _level_at_infinity(problem: ControlProblem, controller: StateSpace) -> float:
    far = 1e3 * max(problem.natural_rad_s, *np.abs(problem.performance.poles_rad_s), 1.0)
    # W1 is a ratio of polynomials: far beyond its poles it is at its limit, or tends to zero, or grows
    near_limit, at_limit = problem.performance_bound(np.array([far * 1e9, far * 1e12]))
    performance = float("inf") if at_limit > 10.0 * near_limit else float(at_limit)
    if problem.omega_c_rad_s is None:
        return performance
    gain = abs(problem.current_stiffness_n_per_a * float(controller.d[0, 0]))
    return performance + gain / (problem.inertia_kg(problem.mass.low_kg) * problem.omega_c_rad_s**2)


def _bumps(values: Floats) -> NDArray[np.intp]:
    """Where the values have local maxima of a height worth a look, highest first."""
    padded = np.concatenate([[-np.inf], values, [-np.inf]])
    local = np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] >= padded[2:]) & (values > 0.8 * values.max()))
    return local[np.argsort(-values[local], kind="stable")[:_BUMPS]]


def _zoom(
    problem: ControlProblem, controller: StateSpace, inverse_mass: Floats, log_omega: Floats
) -> tuple[float, float, float]:
    """The largest level in windows (2, k) of 1/m and log ω, by looking ever closer around the best point of each."""
    bounds, (x_low, x_high), (w_low, w_high) = inverse_mass, inverse_mass, log_omega
    share, every = np.linspace(0.0, 1.0, _ZOOM_POINTS), np.arange(inverse_mass.shape[1])
    best = (-np.inf, float(1.0 / x_low[0]), float(np.exp(w_low[0])))
    for _ in range(_ZOOMS):
        x, w = x_low[:, None] + (x_high - x_low)[:, None] * share, w_low[:, None] + (w_high - w_low)[:, None] * share
        levels = _level(problem, controller, x[:, :, None], np.exp(w)[:, None, :]).reshape(every.size, -1)
        row, column = np.divmod(levels.argmax(axis=1), _ZOOM_POINTS)
        top = int(levels.max(axis=1).argmax())
        best = max(best, (float(levels[top].max()), float(1.0 / x[top, row[top]]), float(np.exp(w[top, column[top]]))))
        x_step, w_step = (x_high - x_low) / (_ZOOM_POINTS - 1), (w_high - w_low) / (_ZOOM_POINTS - 1)
        x_low = np.maximum(bounds[0], x[every, row] - x_step)
        x_high = np.minimum(bounds[1], x[every, row] + x_step)
        w_low, w_high = w[every, column] - w_step, w[every, column] + w_step
    return best

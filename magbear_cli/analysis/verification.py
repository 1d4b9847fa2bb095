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
from magbear_cli.analysis.pole_family import (
    AxisCrossings,
    PoleFamily,
    axis_crossings,
    pole_family,
    real_response_frequencies,
)
from magbear_cli.analysis.winding_number import UnstablePoles, dense_response, unstable_poles
from magbear_cli.errors import NumericsError
from magbear_cli.lti.balancing import with_balanced_states
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.family import FIRST, LAST
from magbear_cli.model.problem import ControlProblem

Floats = NDArray[np.float64]

_RESPONSE_AGREEMENT = 1e-2  # of 1 − K G; what disagreement there is counts against the level
_MEMBERS = 33
_SAME_SHARE = 1e-9  # how far beyond an end a crossing still counts as inside
_POINTS_PER_DECADE = 120
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
    worst, share, omega = searched_level(problem, controller, grid)
    statistics = {
        "response_disagreement": disagreement,
        **stability.statistics,
        "worst_mass_kg": float(problem.family.mass_kg(share)),
        "worst_omega_rad_s": omega,
    }
    statistics |= {"frequencies": float(grid.size), "limit": limit}
    if not np.isfinite(worst):
        return _refused("the level is not finite at some mass and frequency", statistics=statistics)
    place = f"at {member_text(problem, share)} and ω = {omega:.4g} rad/s"
    # K known to a relative error e of 1 − K G leaves the level uncertain by about 2 e of itself
    if worst * (1.0 + 2.0 * disagreement) > limit:
        doubt = f" with a rounding error of {2.0 * disagreement:.1g} of itself" if worst <= limit else ""
        sentence = f"the recomputed level {worst:.5g} {place}{doubt} exceeds {limit:.5g}"
        return _refused(sentence, worst, statistics)
    sentence = f"stable for every member, and the recomputed level is {worst:.5g} {place}"
    return Verification(verified=True, sentence=sentence, worst_level=worst, statistics=statistics)


def _refused(
    sentence: str, worst_level: float = float("nan"), statistics: Mapping[str, float] | None = None
) -> Verification:
    return Verification(verified=False, sentence=sentence, worst_level=worst_level, statistics=statistics or {})


def _stability(problem: ControlProblem, controller: StateSpace, grid: Floats) -> _Stability:
    """Whether the loop is stable for every mass, by three ways that must agree."""
    family = pole_family(problem, controller, problem.family.shares(_MEMBERS))
    counts = [unstable_poles(problem, controller, float(share), grid) for share in problem.family.shown_shares()]
    crossings = axis_crossings(problem, controller, grid)
    inside = crossings.within(FIRST - _SAME_SHARE, LAST + _SAME_SHARE)
    statistics = {
        "max_pole_real_rad_s": family.max_real_rad_s,
        "nyquist_points": float(sum(count.points for count in counts)),
        "nyquist_unstable_poles": float(max((count.count or 0) for count in counts)),
        **_stable_masses(problem, controller, grid),
    }
    sentence = _objection(problem, family, counts, inside)
    return _Stability(not sentence, sentence, statistics)


def _objection(problem: ControlProblem, family: PoleFamily, counts: list[UnstablePoles], inside: AxisCrossings) -> str:
    """Why stability is not shown; empty when it is.

    Where eigenvalues cannot tell the sign of a pole because of rounding, the count on the curve decides.
    """
    uncounted = next((count.reason for count in counts if count.count is None), "")
    if uncounted:
        return f"unstable poles could not be counted: {uncounted}"
    counted = max(count.count or 0 for count in counts)
    if family.certainly_unstable:
        row = int(family.poles_rad_s.real.max(axis=1).argmax())
        pole = f"a closed-loop pole at {family.max_real_rad_s:.4g} rad/s for {member_text(problem, family.shares[row])}"
        return f"{pole}, which the Nyquist count {'confirms' if counted else 'of the ends does not see'}"
    if counted:
        return f"the Nyquist curve counts {counted} unstable poles, which the eigenvalues do not show"
    if inside.shares.size:
        return (
            f"a closed-loop pole crosses the imaginary axis at {member_text(problem, inside.shares[0])}, "
            f"ω = {inside.omega_rad_s[0]:.4g} rad/s"
        )
    if family.max_real_rad_s >= 0.0 and any(count.shift_rad_s > 0.0 for count in counts):
        # the curve passed to the right of doubtful poles of K, so a hidden one among them has no other witness
        return "a closed-loop pole is on the imaginary axis to within rounding"
    return ""


def _stable_masses(problem: ControlProblem, controller: StateSpace, grid: Floats) -> dict[str, float]:
    """The nearest masses outside the range at which a pole crosses the axis; none where the magnets are uncertain.

    Where K is real at ω, the mass with m ω² + k_z = −k_i K has a pole at jω.
    """
    family = problem.family
    if not family.is_known_at_rest:
        return {}
    omega = real_response_frequencies(controller, grid)
    force = -family.first.current_stiffness_n_per_a * controller_response(controller, omega).real
    masses = np.sort((force - family.first.negative_stiffness_n_per_m) / omega**2)
    below = masses[(masses > 0) & (masses < family.first.mass_kg)]
    above = masses[masses > family.last.mass_kg]
    edges = {"stable_above_kg": below[-1:], "stable_below_kg": above[:1]}
    return {name: float(edge[0]) for name, edge in edges.items() if edge.size}


def member_text(problem: ControlProblem, share: float) -> str:
    """A member by those of its parameters that differ along the family, by its mass where it is the only one."""
    family, member = problem.family, problem.family.member(float(np.clip(share, FIRST, LAST)))
    parts = [
        (family.first.mass_kg, family.last.mass_kg, f"m = {member.mass_kg:.4g} kg"),
        (
            family.first.negative_stiffness_n_per_m,
            family.last.negative_stiffness_n_per_m,
            f"k_z = {member.negative_stiffness_n_per_m:.4g} N/m",
        ),
        (
            family.first.current_stiffness_n_per_a,
            family.last.current_stiffness_n_per_a,
            f"k_i = {member.current_stiffness_n_per_a:.4g} N/A",
        ),
    ]
    told = [text for first, last, text in parts if first != last]
    return ", ".join(told or [parts[0][2]])


def response_disagreement(problem: ControlProblem, controller: StateSpace, omega_rad_s: Floats) -> float:
    """The largest change of 1 − K G, relative to itself, between K by dense solves and K by its Hessenberg form."""
    dense, other = dense_response(controller, 1j * omega_rad_s), controller_response(controller, omega_rad_s)
    changes = [
        np.abs(dense - other) / np.abs(problem.family.current_per_displacement(omega_rad_s, share) + dense)
        for share in problem.family.end_shares
    ]
    return float(np.max(changes))


def searched_level(problem: ControlProblem, controller: StateSpace, omega_rad_s: Floats) -> tuple[float, float, float]:
    """The largest |W1 S| + |W3 T| found over members × frequencies: (level, share, ω in rad/s).

    Parameters
    ----------
    omega_rad_s : (w,) positive ascending grid

    Notes
    -----
    A dense grid first; then every bump of it is zoomed into in (share, log ω) together. At ω → ∞ the terms tend to
    |W1(∞)| and b |K(∞)|/ω_c²; at ω → 0 the loop is taken at zero, or far below its slowest dynamics.
    """
    shares = problem.family.shares(_MEMBERS)
    at_zero = np.array([0.0 if is_regular_at_zero(problem, controller) else omega_rad_s[0] * 1e-3])
    omega = np.concatenate([at_zero, omega_rad_s])
    levels = _level(problem, controller, shares[:, None], omega[None, :])
    if np.isnan(levels).any():
        return float("nan"), float("nan"), float("nan")
    row, column = np.unravel_index(int(levels.argmax()), levels.shape)
    found = [(float(levels[row, column]), float(shares[row]), float(omega[column]))]
    found.append((_level_far_out(problem, controller), FIRST, float("inf")))
    over_family = levels.max(axis=0)
    columns = _bumps(over_family)
    rows = levels[:, columns].argmax(axis=0)
    x = np.stack([shares[np.maximum(rows - 1, 0)], shares[np.minimum(rows + 1, shares.size - 1)]])
    w = np.log(np.stack([omega[np.maximum(columns - 1, 1)], omega[np.minimum(columns + 1, omega.size - 1)]]))
    found.append(_zoom(problem, controller, x, w))
    return max(found)


def _level(problem: ControlProblem, controller: StateSpace, shares: Floats, omega_rad_s: Floats) -> Floats:
    """|W1 S| + |W3 T| straight from the definitions of S and T, for arrays of shares and ω that broadcast.

    K is evaluated once for each ω of the array as given.
    """
    response = dense_response(controller, 1j * omega_rad_s.ravel()).reshape(omega_rad_s.shape)
    gain = response * problem.plant(omega_rad_s, shares)
    sensitivity = 1.0 / (1.0 - gain)
    weighted = problem.performance_bound(omega_rad_s) * np.abs(sensitivity)
    return np.asarray(weighted + problem.bandwidth_bound(omega_rad_s) * np.abs(gain * sensitivity), dtype=float)


def _level_far_out(problem: ControlProblem, controller: StateSpace) -> float:
    """The limit at ω → ∞, W1 taken far beyond its poles and not from its coefficients."""
    far = 1e3 * max(problem.natural_rad_s, *np.abs(problem.performance.poles_rad_s), 1.0)
    # W1 is a ratio of polynomials: far beyond its poles it is at its limit, or tends to zero, or grows
    near_limit, at_limit = problem.performance_bound(np.array([far * 1e9, far * 1e12]))
    performance = float("inf") if at_limit > 10.0 * near_limit else float(at_limit)
    if problem.omega_c_rad_s is None:
        return performance
    first = problem.family.first
    gain = abs(first.current_stiffness_n_per_a * float(controller.d[0, 0]))
    return performance + gain / (first.mass_kg * problem.omega_c_rad_s**2)


def _bumps(values: Floats) -> NDArray[np.intp]:
    """Where the values have local maxima of a height worth a look, highest first."""
    padded = np.concatenate([[-np.inf], values, [-np.inf]])
    local = np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] >= padded[2:]) & (values > 0.8 * values.max()))
    return local[np.argsort(-values[local], kind="stable")[:_BUMPS]]


def _zoom(
    problem: ControlProblem, controller: StateSpace, shares: Floats, log_omega: Floats
) -> tuple[float, float, float]:
    """The largest level in windows (2, k) of share and log ω, by looking ever closer around the best point of each."""
    bounds, (x_low, x_high), (w_low, w_high) = shares, shares, log_omega
    share, every = np.linspace(0.0, 1.0, _ZOOM_POINTS), np.arange(shares.shape[1])
    best = (-np.inf, float(x_low[0]), float(np.exp(w_low[0])))
    for _ in range(_ZOOMS):
        x, w = x_low[:, None] + (x_high - x_low)[:, None] * share, w_low[:, None] + (w_high - w_low)[:, None] * share
        levels = _level(problem, controller, x[:, :, None], np.exp(w)[:, None, :]).reshape(every.size, -1)
        row, column = np.divmod(levels.argmax(axis=1), _ZOOM_POINTS)
        top = int(levels.max(axis=1).argmax())
        best = max(best, (float(levels[top].max()), float(x[top, row[top]]), float(np.exp(w[top, column[top]]))))
        x_step, w_step = (x_high - x_low) / (_ZOOM_POINTS - 1), (w_high - w_low) / (_ZOOM_POINTS - 1)
        x_low = np.maximum(bounds[0], x[every, row] - x_step)
        x_high = np.minimum(bounds[1], x[every, row] + x_step)
        w_low, w_high = w[every, column] - w_step, w[every, column] + w_step
    return best

"""A lower bound of the peak of |K S| over all linear controllers that meet the specification, by convex duality.

In the scaled problem every stabilising controller has r = K S stable and proper with r(1) = 0 and r'(1) = −2 (the
unstable pole must leave S). Let h(s) = L(s)/(s − 1)² with L stable and proper. The residue of r h at 1 is −2 L(1), so
that ∫ Re(r h) dω over [0, ∞] is 2π L(1) whatever the controller. The specification keeps r(jω) in discs: for one plant
n/d of the family |W1 S| + |W3 T| ≤ 1, hence |W1 S|² + |W3 T|² ≤ 1, hence with e = G d − n

    |W1 d (1 + G r)|² + |W3 n r|² ≤ |d + e r|²,

which is a disc where the left-hand side has more of |r|². If for some γ the largest Re(r h) over those discs and
|r| ≤ γ integrates to less than 2π L(1), then no controller has a peak of γ or less. Any L gives a bound; a cone program
finds a good one.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.conic import Cone, solve_cone_program
from magbear_cli.model.problem import ControlProblem
from magbear_cli.synthesis.all_pass_sections import Sections
from magbear_cli.synthesis.control_set import Uncertainty

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_TURNS = 12  # plants on the rim of the complex perturbation that are looked at
_COARSE, _FINE = 60, 500  # frequencies a decade: for the program, and for the integral that is believed
_HALVINGS = 14  # of the interval for γ
_PAIRS = (10, 8, 13)  # of poles of L, in turn until the program is solved
_WIDER = 1.0005  # the discs of the program: the coarse sum's errors must not be worth exploiting
_INSIDE = 1e-9  # relative: a corner of discs that touch is taken as theirs
_NO_DISC = 1e12  # times the size of everything else: a radius that bounds nothing


@dataclass(frozen=True, eq=False)
class Discs:
    """|r − centre| ≤ radius, (n, w) arrays."""

    centre: Complexes
    radius: Floats


def least_peak_bound(scaled: ControlProblem, uncertainty: Uncertainty, span: tuple[float, float], peak: float) -> float:
    """A γ that max |K S| of every controller exceeds which meets the specification; 0 where none was found.

    Parameters
    ----------
    span : slowest and fastest pole of L
    peak : one that a controller reaches, the unit

    Notes
    -----
    The integral is a trapezoidal sum over log ω that is fine beside every pole of h, with the ends added in closed
    form: exact to about 1e-4, but no interval arithmetic.
    """
    low, high = 1e-2 * min(span[0], 1.0), 1e3 * span[1]
    decades = float(np.log10(high / low))
    omega, fine = (np.geomspace(low, high, int(density * decades)) for density in (_COARSE, _FINE))
    coarse_discs, discs = (_discs(scaled, uncertainty, grid, peak) for grid in (omega, fine))
    for pairs in _PAIRS:
        speed = np.geomspace(*span, pairs)
        poles = Sections(np.stack([3.0 * speed, 2.0 * speed**2], axis=1))
        try:
            coefficients = _multiplier(coarse_discs, poles, omega, peak)
        except NumericsError:
            continue
        bound = _bound(discs, poles, coefficients, fine, peak)
        if bound > 0.0:
            return bound
    return 0.0


def _bound(discs: Discs, poles: Sections, coefficients: Floats, fine: Floats, peak: float) -> float:
    """The largest γ that this L excludes."""
    h, at_one = _functions(poles, fine) @ coefficients, float(_at_one(poles) @ coefficients)
    weights, below, above = _weights(fine), 0.0, 1.0
    tail = 1.01 * float(np.abs(h[-1]) * fine[-1])  # h falls like 1/ω² beyond the grid
    for _ in range(_HALVINGS):
        middle = (below + above) / 2.0
        largest = _largest(h, discs, middle * peak)
        if float(weights @ largest) + middle * peak * tail < 2.0 * np.pi * at_one:
            below = middle
        else:
            above = middle
    return below * peak


def _discs(scaled: ControlProblem, uncertainty: Uncertainty, omega: Floats, peak: float) -> Discs:
    """The discs of the nominal plant and of those at the ends, or around the rim, of the uncertainty.

    Where |r| ≤ peak lies well within a disc, it is left out: its radius is infinite.
    """
    spread_a, spread_b = scaled.family.spread
    turns: Complexes = np.array([0.0, 1.0, -1.0], dtype=complex)
    if uncertainty == "complex":
        turns = np.append(0.0, np.exp(2j * np.pi * np.arange(_TURNS) / _TURNS))
    squared, weight = omega**2, scaled.performance_bound(omega)
    plant = -1.0 / (1.0 + squared)
    centres, radii = [], []
    for turn in turns[:1] if scaled.family.is_fixed else turns:
        d = -(squared + 1.0 + spread_a * turn) / (1.0 + squared)
        n = (1.0 + spread_b * turn) / (1.0 + squared)
        e, bound = plant * d - n, weight * np.abs(d)
        most = (bound * plant) ** 2 + (scaled.bandwidth_bound(omega) * np.abs(n)) ** 2
        # The left-hand side less the right is a |r|² + 2 Re(b r) + c.
        a, b, c = most - np.abs(e) ** 2, bound**2 * plant - np.conj(d) * e, bound**2 - np.abs(d) ** 2
        is_disc = a > 1e-6 * most
        a = np.where(is_disc, a, 1.0)
        radius = np.sqrt(np.maximum(np.abs(b / a) ** 2 - c / a, 0.0))
        is_disc &= radius < np.abs(b / a) + 1.5 * peak
        centres.append(np.where(is_disc, -np.conj(b) / a, 0.0))
        radii.append(np.where(is_disc, radius, np.inf))
    return Discs(np.array(centres), np.array(radii))


def _functions(poles: Sections, omega: Floats) -> Complexes:
    return np.asarray(poles.functions(omega) / (1j * omega[:, None] - 1.0) ** 2)


def _at_one(poles: Sections) -> Floats:
    """The functions at s = 1; they are real there, and analytic: ω = −j."""
    return np.asarray(poles.functions(np.array([-1j]))[0].real)


def _weights(omega: Floats) -> Floats:
    """Trapezoidal weights over log ω; what lies below the grid, where all is flat, goes to its first point."""
    step = np.diff(np.log(omega))
    weights = omega * np.concatenate([step[:1], step[1:] + step[:-1], step[-1:]]) / 2.0
    weights[0] += omega[0]
    return np.asarray(weights)


def _multiplier(discs: Discs, poles: Sections, omega: Floats, peak: float) -> Floats:
    """The coefficients of L that maximise 2π L(1) − Σ of the discs' part of Re(r h), the rest of h having norm one.

    h is split among the discs and the rest: Re(r h_i) ≤ Re(c_i h_i) + ρ_i |h_i| over disc i, γ |h_rest| over |r| ≤ γ.
    """
    weights, count = _weights(omega), omega.size
    functions = _functions(poles, omega) * (weights * peak)[:, None]
    q, back = np.linalg.qr(np.vstack([functions.real, functions.imag]))
    basis, free = q[:count] + 1j * q[count:], functions.shape[1]
    places = [np.flatnonzero(np.isfinite(radius)) for radius in discs.radius]
    split = sum(place.size for place in places)
    # Unknowns: coefficients; real and imaginary part of each split; its modulus; the modulus of the rest.
    unknowns = free + 3 * split + count
    cost = np.zeros(unknowns)
    cost[:free] = -2.0 * np.pi * np.linalg.solve(back.T, _at_one(poles))
    rest, start = np.zeros((3 * count, free)), free
    rest[1::3], rest[2::3] = -basis.real, -basis.imag
    taken = sparse.lil_matrix((3 * count, unknowns - free))
    taken[np.arange(0, 3 * count, 3), 3 * split + np.arange(count)] = -1.0
    for centre, radius, place in zip(discs.centre, discs.radius, places, strict=True):
        index = start + 3 * np.arange(place.size)
        cost[index], cost[index + 1] = _WIDER * radius[place] / peak, centre[place].real / peak
        cost[index + 2] = -centre[place].imag / peak
        taken[3 * place + 1, index + 1 - free] = 1.0
        taken[3 * place + 2, index + 2 - free] = 1.0
        start += 3 * place.size
    own = sparse.hstack(
        [sparse.csr_matrix((3 * split, free)), -sparse.identity(3 * split), sparse.csr_matrix((3 * split, count))]
    )
    norm = sparse.csr_matrix(np.concatenate([np.zeros(free + 3 * split), np.ones(count)])[None, :])
    answer = solve_cone_program(
        cost,
        sparse.vstack([sparse.hstack([sparse.csr_matrix(rest), taken]), own, norm]),
        np.concatenate([np.zeros(3 * count + 3 * split), [1.0]]),
        [*[(Cone.SECOND_ORDER, 3)] * (count + split), (Cone.ZERO, 1)],
        tolerance=1e-8,
    )
    if not answer.is_solved:
        raise NumericsError(f"the cone program of the bound ended as {answer.status}")
    return np.asarray(np.linalg.solve(back, answer.x[:free]))


def _largest(h: Complexes, discs: Discs, peak: float) -> Floats:
    """The largest Re(r h) over the discs and |r| ≤ peak, (w,): at a disc's own extreme or where two circles meet."""
    centre = np.vstack([discs.centre, np.zeros((1, h.size))])
    radius = np.vstack([np.where(np.isfinite(discs.radius), discs.radius, _NO_DISC * peak), np.full((1, h.size), peak)])
    single = np.min((centre * h).real + radius * np.abs(h), axis=0)
    extremes = np.asarray(centre + radius * np.conj(h) / np.maximum(np.abs(h), 1e-300))
    pairs = combinations(zip(centre, radius, strict=True), 2)
    candidates = np.concatenate([extremes, *(_corners(first, second) for first, second in pairs)])
    inside = np.ones(candidates.shape, dtype=bool)
    for c, rho in zip(centre, radius, strict=True):
        inside &= np.abs(candidates - c) <= rho * (1.0 + _INSIDE) + _INSIDE
    values = np.where(inside, (candidates * h).real, -np.inf).max(axis=0)
    return np.asarray(np.where(np.isfinite(values), np.minimum(values, single), single))


def _corners(first: tuple[Complexes, Floats], second: tuple[Complexes, Floats]) -> Complexes:
    """The two points where circles meet, (2, w); not a number where they do not."""
    (c1, r1), (c2, r2) = first, second
    between = c2 - c1
    with np.errstate(all="ignore"):
        distance = np.abs(between)
        along = (distance**2 + r1**2 - r2**2) / (2.0 * distance)
        across = np.sqrt(r1**2 - along**2)
        unit = between / distance
        return np.stack([c1 + (along + 1j * across) * unit, c1 + (along - 1j * across) * unit])

"""The closed-loop poles along the family, and the members that have a pole on the imaginary axis.

With K = n(s)/q(s) the closed-loop polynomial s² q − a q − b n is affine in the share. By zero exclusion the family is
stable when one member is and none has a root on the axis (Barmish 1994, section 7). On s = jω that is
ω² + a + b K(jω) = 0, so a crossing needs Im K(jω) = 0, at frequencies that do not depend on the member; each
such frequency puts one member on the axis. At ω = 0 and ω → ∞ no member matters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import block_diag

from magbear_cli.analysis.loop_functions import controller_response
from magbear_cli.analysis.supremum import sign_changes
from magbear_cli.lti.conversion import zeros_poles_gain
from magbear_cli.lti.eigenvalues import eigenvalues_with_error
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.family import FIRST, LAST, PlantFamily
from magbear_cli.model.problem import ControlProblem

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_NEAR_AXIS = 1e-2  # of the modulus: how far from the axis a computed zero of K(s) − K(−s) may lie and still be tried
_SAME = 1e-9  # relative distance at which two ways have found the same frequency
_REAL_ENOUGH = 1e-8  # of |K|: how small Im K must be to count as zero


@dataclass(frozen=True, eq=False)
class PoleFamily:
    """Closed-loop poles of sample members, with the rounding error that each may carry."""

    shares: Floats  # (k,)
    poles_rad_s: Complexes  # (k, n), by ascending real part
    uncertainty_rad_s: Floats  # (k, n) first-order bound of the rounding error

    @property
    def max_real_rad_s(self) -> float:
        """The largest real part of any pole of any sample member."""
        return float(self.poles_rad_s.real.max())

    @property
    def certainly_unstable(self) -> bool:
        """Whether a pole lies in the right half-plane by more than its rounding error."""
        return bool((self.poles_rad_s.real > self.uncertainty_rad_s).any())

    @property
    def certainly_stable(self) -> bool:
        """Whether every pole lies in the left half-plane by more than its rounding error."""
        return bool((self.poles_rad_s.real < -self.uncertainty_rad_s).all())


@dataclass(frozen=True, eq=False)
class AxisCrossings:
    """The pairs (share, frequency) at which the closed loop has a pole on the axis, by ascending share.

    Shares beyond the ends continue the family.
    """

    shares: Floats  # (k,)
    omega_rad_s: Floats  # (k,)

    def within(self, low: float, high: float) -> AxisCrossings:
        """The crossings of a range of shares, its ends included."""
        inside = (self.shares >= low) & (self.shares <= high)
        return AxisCrossings(self.shares[inside], self.omega_rad_s[inside])


def closed_loop_matrix(problem: ControlProblem, controller: StateSpace, share: float, time_s: float) -> Floats:
    """The state matrix of the rotor with its controller, in units of time_s; states z, time_s·dz/dt, x_K.

    z'' = a z + b u, u = C x_K + D z, x_K' = A x_K + B z.
    """
    n, family = controller.order, problem.family
    push = time_s**2 * float(family.acceleration_per_current(share))
    matrix = np.zeros((n + 2, n + 2))
    matrix[0, 1] = 1.0
    matrix[1, 0] = time_s**2 * float(family.pole_squared(share)) + push * float(controller.d[0, 0])
    matrix[1, 2:] = push * controller.c[0]
    matrix[2:, :1] = time_s * controller.b
    matrix[2:, 2:] = time_s * controller.a
    return matrix


def pole_family(problem: ControlProblem, controller: StateSpace, shares: ArrayLike) -> PoleFamily:
    """The closed-loop poles of each member, with a bound of their rounding error.

    Parameters
    ----------
    shares : (k,) array

    Notes
    -----
    The matrix is balanced by powers of two before its eigenvalues are computed, in time scaled by the plant's own. A
    simple eigenvalue moves by at most ‖E‖/|yᴴx| under a small change E of the balanced matrix (Golub and Van Loan
    2013, section 7.2.2); E is taken as n·eps times its norm.
    """
    members = np.atleast_1d(np.asarray(shares, dtype=float))
    time = 1.0 / max(problem.natural_rad_s, 1e-300)
    rows = [eigenvalues_with_error(closed_loop_matrix(problem, controller, float(share), time)) for share in members]
    poles = np.stack([row[0] for row in rows]) / time
    return PoleFamily(members, poles, np.stack([row[1] for row in rows]) / time)


def controller_poles(controller: StateSpace) -> tuple[Complexes, Floats]:
    """The poles of the controller (n,) in rad/s, and a bound (n,) of their rounding errors."""
    if controller.order == 0:
        return np.empty(0, dtype=complex), np.empty(0)
    return eigenvalues_with_error(controller.a)


def axis_crossings(problem: ControlProblem, controller: StateSpace, omega_rad_s: Floats) -> AxisCrossings:
    """Every member, beyond the ends too, that has a closed-loop pole on the imaginary axis, with its frequency.

    Parameters
    ----------
    omega_rad_s : (w,) positive ascending grid, to find sign changes of Im K beside the zeros of K(s) − K(−s)

    Notes
    -----
    Two ways to the frequencies with Im K(jω) = 0 are joined: the sign changes on the grid, narrowed down, and the zeros
    of the odd system K(s) − K(−s) near the axis, kept where Im K is zero to rounding.
    """
    omega = real_response_frequencies(controller, omega_rad_s)
    response = controller_response(controller, omega)
    shares = _shares_in_balance(problem.family, response.real, omega)
    order = np.argsort(shares)
    order = order[np.isfinite(shares[order])]
    return AxisCrossings(shares[order], omega[order])


def _shares_in_balance(family: PlantFamily, gain_a_per_m: Floats, omega_rad_s: Floats) -> Floats:
    """The shares with ω² + a + b K = 0 for real K; NaN where there is none or no plant is."""
    first = omega_rad_s**2 + family.pole_squared(FIRST) + family.acceleration_per_current(FIRST) * gain_a_per_m
    last = omega_rad_s**2 + family.pole_squared(LAST) + family.acceleration_per_current(LAST) * gain_a_per_m
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        share = first / (first - last)
        is_plant = (family.acceleration_per_current(share) > 0) & (family.pole_squared(share) > 0)
    return np.where(is_plant, share, np.nan)


def real_response_frequencies(controller: StateSpace, omega_rad_s: Floats) -> Floats:
    """The frequencies (k,) in (0, ∞) with Im K(jω) = 0: where the loop's phase crosses 0 or 180 degrees."""

    def imaginary(omega: Floats) -> Floats:
        return controller_response(controller, omega).imag

    if controller.order == 0:
        return np.empty(0)
    crossed, exact = sign_changes(imaginary, omega_rad_s), omega_rad_s[imaginary(omega_rad_s) == 0.0]
    zeros = _odd_part_zeros(controller)
    near = np.abs(zeros[(zeros.imag > 0) & (np.abs(zeros.real) <= _NEAR_AXIS * np.abs(zeros))])
    if near.size:
        response = controller_response(controller, near)
        near = near[np.abs(response.imag) <= _REAL_ENOUGH * np.abs(response)]
    found = np.unique(np.concatenate([crossed, exact, near]))
    return found[np.diff(found, prepend=0.0) > _SAME * found]


def _odd_part_zeros(controller: StateSpace) -> Complexes:
    """The finite zeros of K(s) − K(−s), whose direct gains cancel."""
    b, c = controller.b, controller.c
    odd = StateSpace(block_diag(controller.a, -controller.a), np.vstack([b, b]), np.hstack([c, c]), np.zeros((1, 1)))
    zeros, _, _ = zeros_poles_gain(odd)
    return zeros

"""The H-infinity norm of a system: the largest gain over all frequencies, and where it is taken."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.lti.balancing import with_balanced_states, with_time_unit
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace

ROUNDS = 60  # the iteration converges quadratically: five to eight rounds are usual
NEAR_THE_AXIS = 1e-6  # an eigenvalue this close, relative to its size, is tried as a crossing; a false one does no harm


def hinf_norm(system: StateSpace, tolerance: float = 1e-6) -> tuple[float, float]:
    """The supremum over ω of the largest singular value of the response, and the frequency where it is taken.

    Parameters
    ----------
    system : StateSpace
    tolerance : relative; the value returned is a gain attained at the frequency returned, and the norm is larger
        by no more than this fraction

    Returns
    -------
    norm : the gain; ∞ when a pole is not in the open left half-plane
    omega_rad_s : where; ∞ is possible, and for an unstable system it is the frequency of the offending pole

    Raises
    ------
    NumericsError
        when the iteration does not settle.

    Notes
    -----
    A level is exceeded exactly when the Hamiltonian matrix built with it has imaginary eigenvalues, which are the
    frequencies where the gain crosses the level; the gain at the midpoints between them is a better level (Boyd and
    Balakrishnan 1990; Bruinsma and Steinbuch 1990). Eigenvalues merely near the axis are tried too: the gain there is
    evaluated, so a wrong guess costs time and never truth.
    """
    poles = system.poles()
    unstable = poles[poles.real >= 0]
    if unstable.size:
        worst = unstable[np.argmax(unstable.real)]
        return float("inf"), float(abs(worst.imag))
    if min(system.inputs, system.outputs) == 0:
        return 0.0, 0.0
    speeds = np.abs(poles)
    unit = float(np.sqrt(speeds.min() * speeds.max())) if speeds.size else 1.0
    scaled = with_balanced_states(with_time_unit(system, unit))
    level, omega = _largest_gain(scaled, _first_frequencies(poles / unit))
    for _ in range(ROUNDS):
        crossings = _crossings(scaled, (1.0 + tolerance) * level)
        middles = (crossings[1:] + crossings[:-1]) / 2.0
        found, where = _largest_gain(scaled, np.concatenate([crossings, middles]))
        if found <= (1.0 + tolerance) * level:
            return (found, where * unit) if found > level else (level, omega * unit)
        level, omega = found, where
    raise NumericsError(f"the H-infinity norm did not settle in {ROUNDS} rounds")


def _first_frequencies(poles: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Zero, infinity, the speed and resonance of every pole, and a coarse grid between."""
    speeds = np.abs(poles)
    if speeds.size == 0:
        return np.array([0.0])
    resonances = np.sqrt(np.maximum(poles.imag**2 - poles.real**2, 0.0))
    grid = np.geomspace(speeds.min() / 10.0, speeds.max() * 10.0, 40)
    return np.concatenate([[0.0, np.inf], speeds, np.abs(poles.imag), resonances, grid])


def _largest_gain(system: StateSpace, omega: NDArray[np.float64]) -> tuple[float, float]:
    if omega.size == 0:
        return 0.0, 0.0
    gains = np.linalg.svd(frequency_response(system, omega), compute_uv=False)[:, 0]
    best = int(np.argmax(gains))
    return float(gains[best]), float(omega[best])


def _crossings(system: StateSpace, level: float) -> NDArray[np.float64]:
    """Frequencies where a singular value may equal the level, ascending and without zero's mirror images."""
    if level <= 0.0 or system.order == 0:
        return np.zeros(0)
    # Inputs and outputs are divided by the square root of the level, so that the Hamiltonian is of one size.
    b, c, d = system.b / np.sqrt(level), system.c / np.sqrt(level), system.d / level
    r = np.eye(system.inputs) - d.T @ d
    r_inverse_dc, r_inverse_b = np.linalg.solve(r, d.T @ c), np.linalg.solve(r, b.T)
    a = system.a + b @ r_inverse_dc
    hamiltonian = np.block([[a, b @ r_inverse_b], [-c.T @ (c + d @ r_inverse_dc), -a.T]])
    eigenvalues = np.linalg.eigvals(hamiltonian)
    near = np.abs(eigenvalues.real) <= NEAR_THE_AXIS * np.maximum(np.abs(eigenvalues), 1e-12)
    return np.unique(np.abs(eigenvalues[near].imag))

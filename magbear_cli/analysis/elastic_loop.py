"""What an elastic rotor does to a loop that was designed for a rigid one: its poles, and the bound it may touch.

Elasticity multiplies the rigid plant by 1 + Δ. A loop with |T| < 1/|W3| stays stable for every stable Δ with
|Δ| < |W3|: here is how much of that bound a rotor takes, and where the poles go when it is not kept.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

from magbear_cli.errors import NumericsError
from magbear_cli.lti.connection import feedback
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.rotor import FlexibleRotor, rotor_dynamics

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

SCAN = np.geomspace(0.05, 20.0, 1200)  # of the resonance: where the peak is sought


def elastic_plant(problem: ControlProblem, mass_kg: float, rotor: FlexibleRotor | None) -> StateSpace:
    """From the current to the position at the sensor, the negative stiffness at the magnets; None: rigid."""
    free, nominal = rotor_dynamics(mass_kg, rotor), problem.nominal
    k_z, k_i = nominal.negative_stiffness_n_per_m, nominal.current_stiffness_n_per_a
    held = free.a + k_z * free.b @ free.c[:1]
    return StateSpace(held, k_i * free.b, free.c[1:], np.zeros((1, 1)))


def elastic_poles(
    problem: ControlProblem, controller: StateSpace, mass_kg: float, rotor: FlexibleRotor | None
) -> Complexes:
    """The poles of the loop of a controller around such a rotor, in rad/s."""
    return feedback(elastic_plant(problem, mass_kg, rotor), controller).poles()


def fastest_growing(poles_rad_s: Complexes) -> complex:
    """The rightmost oscillating pole, with a positive imaginary part; the rightmost of all if none oscillates."""
    above = poles_rad_s[poles_rad_s.imag > 1e-6 * np.abs(poles_rad_s)]
    chosen = above if above.size else poles_rad_s
    return complex(chosen[np.argmax(chosen.real)])


def elasticity(problem: ControlProblem, mass_kg: float, rotor: FlexibleRotor, omega_rad_s: Floats) -> Complexes:
    """Δ(jω) = G_elastic/G_rigid − 1, of the shape of omega."""
    elastic, rigid = (
        frequency_response(elastic_plant(problem, mass_kg, part), omega_rad_s)[:, 0, 0] for part in (rotor, None)
    )
    return np.asarray(elastic / rigid - 1.0, dtype=complex)


def free_touching_damping(reduced_mass_kg: float, stiffness_n_per_m: float, omega_c_rad_s: float) -> float:
    """``touching_damping`` in closed form for a rotor that no magnet holds, μ √(2 (ω0² − √(ω0⁴ − ω_c⁴))).

    There Δ = −μ s²/(μ s² + c s + k), so that |Δ| = |W3| where the least of |k − μ ω² + j c ω| is μ ω_c². NaN for a
    resonance below the bandwidth limit, where no damping does.
    """
    square = stiffness_n_per_m / reduced_mass_kg
    with np.errstate(invalid="ignore"):
        return float(reduced_mass_kg * np.sqrt(2.0 * (square - np.sqrt(square**2 - omega_c_rad_s**4))))


def elasticity_over_bound(problem: ControlProblem, mass_kg: float, rotor: FlexibleRotor) -> tuple[float, float]:
    """The largest |Δ(jω)|/|W3(jω)| with Δ = G_elastic/G_rigid − 1, and the ω in rad/s where it is.

    Raises
    ------
    NumericsError
        when the problem has no bandwidth limit.
    """
    if problem.omega_c_rad_s is None:
        raise NumericsError("without a bandwidth limit there is no bound on the elasticity")
    limit = problem.omega_c_rad_s

    def share(log_omega: float) -> float:
        at = np.exp(np.array([log_omega]))
        return float(np.abs(elasticity(problem, mass_kg, rotor, at)[0])) * limit**2 / float(at[0]) ** 2

    points = np.log(SCAN * rotor.resonance_rad_s(mass_kg))
    omega = np.exp(points)
    delta = elasticity(problem, mass_kg, rotor, omega)
    top = int(np.argmax(np.abs(delta) * limit**2 / omega**2))
    ends = points[max(top - 1, 0)], points[min(top + 1, points.size - 1)]
    found = minimize_scalar(lambda point: -share(point), bounds=ends, method="bounded", options={"xatol": 1e-10})
    return -float(found.fun), float(np.exp(found.x))


def touching_damping(problem: ControlProblem, mass_kg: float, rotor: FlexibleRotor) -> float:
    """The damping in N s/m at which |Δ| just touches |W3|, all else of the rotor kept; less damping exceeds it.

    Raises
    ------
    NumericsError
        when no damping does.
    """
    critical = 2.0 * rotor.stiffness_n_per_m / rotor.resonance_rad_s(mass_kg)

    def excess(damping: float) -> float:
        return elasticity_over_bound(problem, mass_kg, replace(rotor, damping_n_s_per_m=damping))[0] - 1.0

    low, high = 1e-4 * critical, critical
    if not excess(low) > 0.0 > excess(high):
        raise NumericsError("no damping brings the elasticity to its bound")
    return float(brentq(excess, low, high, rtol=1e-8))

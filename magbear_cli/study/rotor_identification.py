"""The elastic rotor that has a known resonance, a known touch of its bound and a known growing pole.

Unknown are the masses m1 at the magnets and m2 at the sensor and the stiffness k between them. Known are four numbers:
the resonance, the damping at which the elasticity just touches |W3|, and real and imaginary part of the pole that a
lesser damping makes unstable with a linear controller for the rigid rotor. Seen from the sensor, a free rotor is its
total mass and the reduced mass μ = m1 m2/(m1 + m2) alone:

    z2/f = (c s + k)/(M s² (μ s² + c s + k)),

so that the resonance and the bound pin μ and k whatever the controller, the growth of the pole pins the total mass
M with the controller, its frequency is a check, and which of the two masses is the small one shows only through the
negative stiffness of the magnets. The controller is not known either: several are tried, each with both rotors. That
the rotor's mass is one of the range for which the controllers are made is a fifth fact, and rules most of them out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from magbear_cli.analysis.elastic_loop import (
    elastic_plant,
    elastic_poles,
    elasticity,
    elasticity_over_bound,
    fastest_growing,
    free_touching_damping,
    touching_damping,
)
from magbear_cli.errors import NumericsError, Status
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.rotor import FlexibleRotor
from magbear_cli.model.table import Column, Table
from magbear_cli.study.building import design_controller
from magbear_cli.study.outcome import CaseOutcome

Floats = NDArray[np.float64]

_PROCEDURE = {"method": "mu_dk", "d_order": 5, "iterations": 1, "channel_scaling": False, "fit_every_scale": True}
_PRINTED = _PROCEDURE | {"form": "as_printed", "gamma_tolerance": 1e-3}
DESIGNS: Mapping[str, Mapping[str, Any]] = {  # ASCII names: they stand in the results file
    "mu_dk as printed, 10 to 1e4 rad/s": _PRINTED | {"frequency_grid": [10.0, 1e4, 50.0]},
    "mu_dk as printed, 1 to 1e4 rad/s": _PRINTED | {"frequency_grid": [1.0, 1e4, 50.0]},
    "mu_dk as derived": _PROCEDURE | {"gamma_tolerance": 0.01},
    "mu_convex, complex mu": {"method": "mu_convex", "uncertainty": "complex"},
    "mu_convex, real mass": {"method": "mu_convex"},
    "fixed_order 1": {"method": "fixed_order", "order": 1, "max_order": 6},
    "hinf": {"method": "hinf"},
}
ROOM = np.array([0.02, 0.02, 10.0, 0.005])  # what a printed figure may be off: relative, relative, rad/s, relative
BOUND_ROOM = 1.05  # |Δ|/|W3| up to which the bound is kept at all frequencies
MASS_ROOM = 0.02  # what the rotor's mass may be outside of the range that the controllers are made for, relative
SPLITS = (0.08, 0.92)  # of the total mass at the sensor, to begin with
LOW, HIGH, POINTS = 10.0, 1e5, 400  # rad/s of the stored curves


@dataclass(frozen=True)
class Facts:
    """What is known of the rotor; the growing pole belongs to ``growing_damping_n_s_per_m``."""

    resonance_rad_s: float
    touching_damping_n_s_per_m: float
    growing_damping_n_s_per_m: float
    pole_real_rad_s: float
    pole_imag_rad_s: float

    @property
    def pole_rad_s(self) -> complex:
        """The growing pole."""
        return complex(self.pole_real_rad_s, self.pole_imag_rad_s)


@dataclass(frozen=True, eq=False)
class Fit:
    """The rotor that comes nearest to the facts with one controller, and what it gives in their place.

    ``spread`` is the standard deviation of (log m1, log m2, log k) when the facts are off by their room.
    """

    design: int
    bearing_mass_kg: float
    sensor_mass_kg: float
    stiffness_n_per_m: float
    given: Floats
    misfit: float
    spread: Floats
    covariance: Floats

    @property
    def total_mass_kg(self) -> float:
        """The rotor's mass."""
        return self.bearing_mass_kg + self.sensor_mass_kg

    @property
    def reduced_mass_kg(self) -> float:
        """m1 m2/(m1 + m2)."""
        return self.bearing_mass_kg * self.sensor_mass_kg / self.total_mass_kg

    def rotor(self, damping_n_s_per_m: float) -> FlexibleRotor:
        """The rotor with a damping."""
        return FlexibleRotor(self.sensor_mass_kg, self.stiffness_n_per_m, damping_n_s_per_m)

    def deviation(self, *shares: float) -> float:
        """The standard deviation of a product of powers of (m1, m2, k), relative."""
        weights = np.array(shares)
        return float(np.sqrt(weights @ self.covariance @ weights))


def identify_rotor_case(outcome: CaseOutcome, problem: ControlProblem) -> CaseOutcome:
    """The rotor of least misfit that keeps the bound, how well it is pinned, and the fits with every controller.

    Status ``ok`` when some controller has a rotor with every fact within its room, else ``not_achieved``. Tables:
    ``fits``, ``loops`` (the poles of each controller around the rotor that was found, for masses and dampings) and
    ``elasticity`` (plants, |Δ| and |W3| over frequency).
    """
    if problem.omega_c_rad_s is None:
        raise NumericsError("an elastic rotor is identified by its bound: give bandwidth.omega_c_rad_s")
    facts = Facts(**{key: value for key, value in outcome.inputs["controller"].items() if key != "method"})
    controllers = _controllers(problem)
    fits = [
        fit_rotor(problem, facts, controller, number, split)
        for number, controller in controllers.items()
        for split in SPLITS
    ]
    if not fits:
        raise NumericsError("no controller was found that the growing pole could belong to")
    kept = [fit for fit in fits if _bound_share(problem, fit) <= BOUND_ROOM] or fits
    best = min(kept, key=lambda fit: fit.misfit)
    tables = {
        "fits": _fit_table(problem, fits),
        "loops": _loop_table(problem, facts, best, controllers),
        "elasticity": _elasticity_table(problem, facts, best),
    }
    met = best.misfit <= 1.0
    sentence = "" if met else f"the best fit is {best.misfit:.2g} times further from a fact than its figure may be off"
    status = Status.OK if met else Status.NOT_ACHIEVED
    return replace(
        outcome, status=status, sentence=sentence, statistics=_statistics(problem, best, fits), tables=tables
    )


def _controllers(problem: ControlProblem) -> dict[int, StateSpace]:
    """The controllers of the designs that have one, by their number from 1."""
    found: dict[int, StateSpace] = {}
    for number, design in enumerate(DESIGNS.values(), 1):
        controller = design_controller(problem, dict(design)).controller
        if controller is not None:
            found[number] = controller
    return found


def fit_rotor(problem: ControlProblem, facts: Facts, controller: StateSpace, design: int, split: float) -> Fit:
    """The least squares fit of (m1, m2, k), begun with a share of the nominal mass at the sensor."""
    limit = problem.omega_c_rad_s or np.nan
    wanted = np.array([
        facts.resonance_rad_s, facts.touching_damping_n_s_per_m, facts.pole_real_rad_s, facts.pole_imag_rad_s,
    ])  # fmt: skip
    room = ROOM * np.array([wanted[0], wanted[1], 1.0, wanted[3]])

    def given(logs: Floats) -> Floats:
        m1, m2, k = (float(value) for value in np.exp(logs))
        reduced = m1 * m2 / (m1 + m2)
        rotor = FlexibleRotor(m2, k, facts.growing_damping_n_s_per_m)
        poles = elastic_poles(problem, controller, m1 + m2, rotor)
        pole = complex(poles[np.argmin(np.abs(poles - facts.pole_rad_s))])
        touching = free_touching_damping(reduced, k, limit)
        return np.array([np.sqrt(k / reduced), touching, pole.real, pole.imag])

    def misfit(logs: Floats) -> Floats:
        mass = float(np.exp(logs[:2]).sum())
        outside = mass / np.clip(mass, problem.family.first.mass_kg, problem.family.last.mass_kg) - 1.0
        facts_missed = np.nan_to_num((given(logs) - wanted) / room, nan=1e3)
        return np.append(facts_missed, outside / MASS_ROOM)

    mass = problem.nominal.mass_kg
    start = [(1.0 - split) * mass, split * mass, split * (1.0 - split) * mass * facts.resonance_rad_s**2]
    found = least_squares(misfit, np.log(start), bounds=(np.log([0.01, 0.01, 1e4]), np.log([50.0, 50.0, 1e8])))
    covariance = np.linalg.pinv(found.jac.T @ found.jac)
    m1, m2, k = (float(value) for value in np.exp(found.x))
    return Fit(
        design,
        m1,
        m2,
        k,
        given(found.x),
        float(np.abs(misfit(found.x)).max()),
        np.sqrt(np.diag(covariance)),
        covariance,
    )


def _statistics(problem: ControlProblem, best: Fit, fits: list[Fit]) -> dict[str, float]:
    mass = best.total_mass_kg
    share = best.sensor_mass_kg / mass
    try:
        touching = touching_damping(problem, mass, best.rotor(0.0))
    except NumericsError:
        touching = float(best.given[1])
    near = [fit for fit in fits if fit.misfit <= 2.0 * best.misfit + 1.0] or fits
    found = {
        "design": float(best.design),
        "misfit": best.misfit,
        "total_mass_kg": mass,
        "bearing_mass_kg": best.bearing_mass_kg,
        "sensor_mass_kg": best.sensor_mass_kg,
        "reduced_mass_kg": best.reduced_mass_kg,
        "stiffness_n_per_m": best.stiffness_n_per_m,
        "resonance_rad_s": float(best.given[0]),
        "touching_damping_n_s_per_m": touching,
        "pole_real_rad_s": float(best.given[2]),
        "pole_imag_rad_s": float(best.given[3]),
        "total_mass_deviation": best.deviation(1.0 - share, share, 0.0),
        "reduced_mass_deviation": best.deviation(share, 1.0 - share, 0.0),
        "stiffness_deviation": best.deviation(0.0, 0.0, 1.0),
    }
    for name in ("total_mass_kg", "reduced_mass_kg", "stiffness_n_per_m"):
        values = [getattr(fit, name) for fit in fits]
        found |= {f"{name}_least": min(values), f"{name}_largest": max(values)}
    return found | {"fits_within_twice_the_misfit": float(len(near))}


def _bound_share(problem: ControlProblem, fit: Fit) -> float:
    """The largest |Δ|/|W3| over all frequencies with the damping that touches it at the resonance."""
    return elasticity_over_bound(problem, fit.total_mass_kg, fit.rotor(float(fit.given[1])))[0]


def _fit_table(problem: ControlProblem, fits: list[Fit]) -> Table:
    """The family of fits; the share of the bound at all frequencies tells the two rotors of a pair apart."""
    shares = [fit.sensor_mass_kg / fit.total_mass_kg for fit in fits]
    columns = (
        ("design", [fit.design for fit in fits], "1", "controller, counted as in the title"),
        ("bearing_mass_kg", [fit.bearing_mass_kg for fit in fits], "kg", "mass at the magnets"),
        ("sensor_mass_kg", [fit.sensor_mass_kg for fit in fits], "kg", "mass at the sensor"),
        ("total_mass_kg", [fit.total_mass_kg for fit in fits], "kg", "mass of the rotor"),
        ("reduced_mass_kg", [fit.reduced_mass_kg for fit in fits], "kg", "m1 m2/(m1 + m2)"),
        ("stiffness_n_per_m", [fit.stiffness_n_per_m for fit in fits], "N/m", "stiffness between the masses"),
        ("resonance_rad_s", [fit.given[0] for fit in fits], "rad/s", "undamped resonance of the free rotor"),
        ("touching_damping_n_s_per_m", [fit.given[1] for fit in fits], "N s/m", "damping that touches the bound"),
        ("pole_real_rad_s", [fit.given[2] for fit in fits], "rad/s", "growing pole, real part"),
        ("pole_imag_rad_s", [fit.given[3] for fit in fits], "rad/s", "growing pole, imaginary part"),
        ("misfit", [fit.misfit for fit in fits], "1", "largest distance from a fact over what it may be off"),
        (
            "total_mass_deviation",
            [fit.deviation(1.0 - share, share, 0.0) for fit, share in zip(fits, shares, strict=True)],
            "1",
            "relative standard deviation of the mass",
        ),
        (
            "bound_share",
            [_bound_share(problem, fit) for fit in fits],
            "1",
            "largest |Delta|/|W3| over all frequencies, when touching",
        ),
    )
    names = "; ".join(f"{number} {name}" for number, name in enumerate(DESIGNS, 1))
    return _table(columns, f"the rotors that come nearest to the facts, for controllers {names}")


def _loop_table(problem: ControlProblem, facts: Facts, best: Fit, controllers: Mapping[int, StateSpace]) -> Table:
    """The rightmost oscillating pole of each controller around the rotor that was found, for masses of the range."""
    rows = []
    for number, controller in controllers.items():
        for mass in (problem.family.first.mass_kg, problem.nominal.mass_kg, problem.family.last.mass_kg):
            for damping in (facts.growing_damping_n_s_per_m, facts.touching_damping_n_s_per_m):
                poles = elastic_poles(problem, controller, mass, best.rotor(damping))
                fast = poles[np.abs(poles.imag) > 0.5 * facts.pole_imag_rad_s]
                pole = fastest_growing(fast if fast.size else poles)
                rows.append((number, mass, damping, pole.real, pole.imag, poles.real.max()))
    names = (
        ("design", "1", "controller, counted as in the table fits"),
        ("mass_kg", "kg", "mass of the rotor"),
        ("damping_n_s_per_m", "N s/m", "damping between the masses"),
        ("pole_real_rad_s", "rad/s", "pole of the bending, real part"),
        ("pole_imag_rad_s", "rad/s", "pole of the bending, imaginary part"),
        ("slowest_rad_s", "rad/s", "largest real part of all poles"),
    )
    columns = [(name, [row[place] for row in rows], unit, text) for place, (name, unit, text) in enumerate(names)]
    return _table(columns, "poles of linear loops around the elastic rotor")


def _elasticity_table(problem: ControlProblem, facts: Facts, best: Fit) -> Table:
    """The plant and the elasticity over frequency, beside the bound and its inverse."""
    omega = np.unique(np.append(np.geomspace(LOW, HIGH, POINTS), np.linspace(0.8, 1.2, POINTS) * best.given[0]))
    mass = best.total_mass_kg
    less, more = (
        best.rotor(damping) for damping in (facts.growing_damping_n_s_per_m, facts.touching_damping_n_s_per_m)
    )
    bound = problem.bandwidth_bound(omega)

    def gain(rotor: FlexibleRotor | None) -> Floats:
        return np.abs(frequency_response(elastic_plant(problem, mass, rotor), omega)[:, 0, 0])

    columns = (
        ("omega_rad_s", omega, "rad/s", "frequency"),
        ("rigid_plant_m_per_a", gain(None), "m/A", "rigid rotor"),
        ("less_damped_plant_m_per_a", gain(less), "m/A", "elastic rotor, lesser damping"),
        ("more_damped_plant_m_per_a", gain(more), "m/A", "elastic rotor, damping that touches the bound"),
        ("less_damped_delta", np.abs(elasticity(problem, mass, less, omega)), "1", "|Delta|, lesser damping"),
        ("more_damped_delta", np.abs(elasticity(problem, mass, more, omega)), "1", "|Delta|, touching damping"),
        ("bound", bound, "1", "|W3|, which |Delta| has to stay below"),
        ("inverse_bound", 1.0 / bound, "1", "1/|W3|, which |T| has to stay below"),
    )
    return _table(columns, "elasticity of the rotor as a multiplicative uncertainty")


def _table(columns: Any, title: str) -> Table:  # noqa: ANN401 - rows of name, values, unit and meaning
    made = (Column(name, np.asarray(values, dtype=float), unit, text) for name, values, unit, text in columns)
    return Table(tuple(made), title)

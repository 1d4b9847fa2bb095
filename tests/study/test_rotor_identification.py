"""A rotor that is known is identified from what is told of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from magbear_cli.analysis.elastic_loop import elastic_poles, fastest_growing, free_touching_damping
from magbear_cli.errors import Status
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.model.rotor import FlexibleRotor
from magbear_cli.study import rotor_identification
from magbear_cli.study.pipeline import run_case
from magbear_cli.study.plan import case_id
from magbear_cli.study.rotor_identification import Facts, fit_rotor

PROBLEM = ControlProblem.of_mass(62500.0, 25.0, (2.2, 4.5), RationalWeight.low_pass(18.0, 17.0), 2000.0)
LEAD = StateSpace.of([[-4000.0]], [[1.0]], [[-3.5e5 * (300.0 - 4000.0)]], [[-3.5e5]])


def told_of(rotor: FlexibleRotor, mass_kg: float) -> Facts:
    """What there is to know of a rotor with a loop around it."""
    reduced = rotor.sensor_mass_kg * rotor.bearing_mass_kg(mass_kg) / mass_kg
    pole = fastest_growing(elastic_poles(PROBLEM, LEAD, mass_kg, rotor))
    touching = free_touching_damping(reduced, rotor.stiffness_n_per_m, 2000.0)
    return Facts(rotor.resonance_rad_s(mass_kg), touching, rotor.damping_n_s_per_m, pole.real, pole.imag)


@pytest.mark.parametrize(("sensor_mass", "split"), [(0.19, 0.08), (2.3, 0.92)])
def test_a_known_rotor_is_found_again(sensor_mass: float, split: float) -> None:
    """From exact facts both masses and the stiffness come out, whichever mass is the small one."""
    rotor = FlexibleRotor(sensor_mass, 2.8e6, 20.0)
    fit = fit_rotor(PROBLEM, told_of(rotor, 2.5), LEAD, 1, split)
    assert fit.total_mass_kg == pytest.approx(2.5, rel=1e-4)
    assert fit.sensor_mass_kg == pytest.approx(sensor_mass, rel=1e-4)
    assert fit.stiffness_n_per_m == pytest.approx(2.8e6, rel=1e-4)
    assert fit.misfit < 1e-3


def test_the_reduced_mass_is_pinned_by_resonance_and_bound() -> None:
    """A wrong controller spoils the total mass and not the reduced mass."""
    facts = told_of(FlexibleRotor(0.19, 2.8e6, 20.0), 2.5)
    weaker = StateSpace(LEAD.a, LEAD.b, 0.85 * LEAD.c, 0.85 * LEAD.d)
    right, wrong = (fit_rotor(PROBLEM, facts, controller, 1, 0.08) for controller in (LEAD, weaker))
    assert wrong.reduced_mass_kg == pytest.approx(right.reduced_mass_kg, rel=0.05)
    assert abs(wrong.total_mass_kg / right.total_mass_kg - 1.0) > 0.05
    assert right.deviation(0.0, 0.0, 1.0) == pytest.approx(right.spread[2])


def test_the_case_of_the_thesis(resolved: Callable[..., dict[str, Any]], monkeypatch: pytest.MonkeyPatch) -> None:
    """With the procedure of the thesis the rotor is one of 2.2 kg whose facts are all within their room."""
    name = "mu_dk as printed, 1 to 1e4 rad/s"
    monkeypatch.setattr(rotor_identification, "DESIGNS", {name: rotor_identification.DESIGNS[name]})
    inputs = resolved(
        "bearing=thesis_thrust_half_switched",
        "mass_kg=[2.2, 4.5]",
        "performance=thesis_slow",
        "bandwidth.omega_c_rad_s=2000",
        "controller={method: rotor_identification}",
        simulate=[],
    )
    outcome = run_case(inputs, case_id(inputs), 0)
    found = outcome.statistics
    assert outcome.status is Status.OK
    assert found["total_mass_kg"] == pytest.approx(2.2, rel=0.02)
    assert found["reduced_mass_kg"] == pytest.approx(0.167, rel=0.01)
    assert found["touching_damping_n_s_per_m"] == pytest.approx(170.0, rel=0.02)
    assert found["pole_real_rad_s"] == pytest.approx(90.0, abs=10.0)
    assert found["pole_imag_rad_s"] == pytest.approx(3666.0, rel=0.005)
    loops = outcome.tables["loops"]
    at = (loops["mass_kg"] == 2.2) & (loops["damping_n_s_per_m"] == 100.0)
    assert loops["pole_real_rad_s"][at] > 0.0
    curves = outcome.tables["elasticity"]
    assert (curves["more_damped_delta"] <= 1.05 * curves["bound"]).all()
    assert (curves["less_damped_delta"] > curves["bound"]).any()
    assert np.isfinite(curves["less_damped_plant_m_per_a"]).all()

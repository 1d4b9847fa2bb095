"""From plain inputs to the objects of the numerics: every key arrives where it belongs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from magbear_cli.errors import Status
from magbear_cli.model.bearing import CurrentLaw
from magbear_cli.study.building import (
    build_bearing,
    build_family,
    build_problem,
    build_scenario,
    design_controller,
    scenario_entries,
)

Resolve = Callable[..., dict[str, Any]]

FULL_SCENARIO = (
    "simulate=[{step_m: 5e-6, masses_kg: [3.0, 4.5], model: linear, prefilter: {omega_rad_s: 2e4, zeta: 0.7}, "
    "sensor: {omega_rad_s: 4000, damping_rad_s: 560}, gravity_m_per_s2: 9.81, gravity_compensation: true, "
    "rotor: {sensor_mass_kg: 0.5, stiffness_n_per_m: 1e8, damping_n_s_per_m: 10}, current_limit_a: 10, "
    "disturbance: {force_n: 50, start_s: 1e-3, duration_s: 2e-3}, duration_s: 0.1, samples: 11}]"
)


def test_the_thesis_bearing_has_the_thesis_stiffnesses(resolved: Resolve) -> None:
    """k_z = 4 k0 i0²/z0³ = 62 500 N/m and k_i = 4 k0 i0/z0² = 50 N/A at the origin (thesis eqs. 2.2-2.4)."""
    problem = build_problem(resolved())
    assert problem.nominal.negative_stiffness_n_per_m == pytest.approx(62500.0, rel=1e-12)
    assert problem.nominal.current_stiffness_n_per_a == pytest.approx(50.0, rel=1e-12)
    ends = problem.family.first.mass_kg, problem.family.last.mass_kg
    assert (*ends, problem.omega_c_rad_s) == (3.0, 4.5, 20000.0)
    assert abs(complex(problem.performance(0.0))) == pytest.approx(10.0)


def test_the_operating_point_is_where_the_bearing_is_linearised(resolved: Resolve) -> None:
    """Off the middle of the gap the negative stiffness is larger."""
    problem = build_problem(resolved("operating_point.position_m=1e-4"))
    assert problem.nominal.negative_stiffness_n_per_m > 62500.0


def test_the_current_law_is_that_of_the_study(resolved: Resolve) -> None:
    """The half law halves k_i and leaves k_z."""
    inputs = resolved("bearing.current_law=half_switched")
    assert build_bearing(inputs).current_law is CurrentLaw.HALF_SWITCHED
    assert build_problem(inputs).nominal.current_stiffness_n_per_a == pytest.approx(25.0, rel=1e-12)


@pytest.mark.parametrize(("low", "high"), [(0.8, 1.25), (0.5, 3.0)])
def test_an_uncertain_force_constant_scales_both_stiffnesses(resolved: Resolve, low: float, high: float) -> None:
    """The first end is the lightest rotor on the strongest magnets, the last one the opposite."""
    family = build_family(resolved(f"uncertain={{force_constant: [{low}, {high}]}}"))
    for plant, mass, factor in ((family.first, 3.0, high), (family.last, 4.5, low)):
        assert plant.mass_kg == mass
        assert plant.negative_stiffness_n_per_m == pytest.approx(factor * 62_500.0, rel=1e-12)
        assert plant.current_stiffness_n_per_a == pytest.approx(factor * 50.0, rel=1e-12)


@pytest.mark.parametrize(("low", "high"), [(0.8, 1.25), (0.5, 3.0)])
def test_an_uncertain_stiffness_stands_about_its_middle(resolved: Resolve, low: float, high: float) -> None:
    """Both ends of the range are plants with the rotor's own mass, and the nominal one is in the middle of k_z."""
    family = build_family(resolved("mass_kg=3.6", f"uncertain={{negative_stiffness: [{low}, {high}]}}"))
    for plant, factor in ((family.first, low), (family.last, high), (family.nominal, 0.5 * (low + high))):
        assert plant.mass_kg == 3.6
        assert plant.negative_stiffness_n_per_m == pytest.approx(factor * 62_500.0, rel=1e-12)
        assert plant.current_stiffness_n_per_a == pytest.approx(50.0, rel=1e-12)


def test_the_older_form_means_the_same(resolved: Resolve) -> None:
    """``parameter`` and ``factor`` give the inputs of the newer key."""
    old = resolved("uncertain={parameter: negative_stiffness, factor: [0.8, 1.2]}")
    assert old == resolved("uncertain={negative_stiffness: [0.8, 1.2]}")


def test_every_plant_of_the_box_lies_between_the_ends(resolved: Resolve) -> None:
    """Mass, force constant and both stiffnesses uncertain at once: random plants of the box at random frequencies."""
    text = "uncertain={force_constant: [0.9, 1.2], negative_stiffness: [0.8, 1.1], current_stiffness: [0.95, 1.3]}"
    family, random = build_family(resolved(text)), np.random.default_rng(2)
    low, high = (3.0, 0.9, 0.8, 0.95), (4.5, 1.2, 1.1, 1.3)
    for mass, f, z, i in random.uniform(low, high, size=(300, 4)):
        omega = 10.0 ** random.uniform(-1.0, 6.0)
        rho = (mass * omega**2 + f * z * 62_500.0) / (f * i * 50.0)
        first, last = (float(family.current_per_displacement(omega, share)) for share in (0.0, 1.0))
        assert first <= rho <= last
        slow, fast = family.pole_range
        assert slow <= np.sqrt(f * z * 62_500.0 / mass) <= fast


def test_no_bandwidth_is_no_limit(resolved: Resolve) -> None:
    """Without ``bandwidth`` the problem has no W3."""
    assert build_problem(resolved("bandwidth=null")).omega_c_rad_s is None


def test_every_key_of_a_scenario_arrives(resolved: Resolve) -> None:
    """A scenario with every option has every option, once for each mass, beside the entry that it comes from."""
    inputs = resolved(FULL_SCENARIO, "operating_point.position_m=1e-5")
    scenarios = [build_scenario(entry, inputs["operating_point"]) for entry in scenario_entries(inputs)]
    assert [scenario.mass_kg for scenario in scenarios] == [3.0, 4.5]
    for scenario in scenarios:
        for key, value in inputs["simulate"][0].items():
            if key == "masses_kg":
                continue
            built = getattr(scenario, key)
            if isinstance(value, dict):
                assert {name: getattr(built, name) for name in value} == value
            else:
                assert built == value
        assert scenario.position_m == 1e-5


def test_what_is_left_out_of_a_scenario_stays_out(resolved: Resolve) -> None:
    """A bare step has neither filter nor sensor nor elastic rotor nor pulse."""
    inputs = resolved()
    (entry,) = scenario_entries(inputs)
    scenario = build_scenario(entry, inputs["operating_point"])
    assert (scenario.prefilter, scenario.sensor, scenario.rotor, scenario.disturbance) == (None, None, None, None)


@pytest.mark.parametrize("method", ["mu_convex", "fixed_order", "hinf", "mu_dk", "lqg", "lqg_ltr"])
def test_the_options_of_a_study_are_those_of_its_method(resolved: Resolve, method: str) -> None:
    """What the study file calls an option the method knows, with every default: nothing is dropped or made up."""
    from magbear_cli.synthesis import fixed_order, hinf, lqg, lqg_ltr, mu_convex, mu_dk

    modules: dict[str, Any] = {
        "mu_convex": mu_convex.MuConvexOptions,
        "fixed_order": fixed_order.FixedOrderOptions,
        "hinf": hinf.HinfOptions,
        "mu_dk": mu_dk.MuDkOptions,
        "lqg": lqg.LqgOptions,
        "lqg_ltr": lqg_ltr.LqgLtrOptions,
    }
    given = dict(resolved(f"controller.method={method}")["controller"].items())
    del given["method"]
    if method == "fixed_order":
        assert given.pop("max_order") == 6  # of the search for the order, above the method
    made = modules[method](**{key: tuple(value) if isinstance(value, list) else value for key, value in given.items()})
    assert {field: getattr(made, field) for field in made.__dataclass_fields__} == {
        key: tuple(value) if isinstance(value, list) else value for key, value in given.items()
    }


def test_a_stored_controller_is_taken_as_it_is(resolved: Resolve) -> None:
    """The matrices given are the controller's, to the last bit; a static gain has none but d."""
    problem = build_problem(resolved())
    matrices = {"a": [[-2e5]], "b": [[0.1]], "c": [[1.5e12]], "d": [[-7.6e6]]}
    design = design_controller(problem, {"method": "stored", "source": "k.json", **matrices})
    assert design.status is Status.OK
    assert design.controller is not None
    assert {name: getattr(design.controller, name).tolist() for name in "abcd"} == matrices
    gain = design_controller(
        problem, {"method": "stored", "source": "k.json", "a": [], "b": [], "c": [[]], "d": [[-1.0]]}
    )
    assert gain.controller is not None
    assert gain.controller.order == 0

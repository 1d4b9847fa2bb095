"""What a family is told to hold is what its problem holds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from magbear_cli.study.building import build_problem
from magbear_cli.study.members import Uncertainty, end_members, member_values, uncertainty

Resolve = Callable[..., dict[str, Any]]
OMEGA = np.geomspace(1.0, 1e6, 50)
FAMILIES = {
    Uncertainty.MASS: ("mass_kg=[3.0, 4.5]",),
    Uncertainty.NEGATIVE_STIFFNESS: ("mass_kg=3.6", "uncertain={parameter: negative_stiffness, factor: [0.4, 0.9]}"),
    Uncertainty.FORCE_CONSTANT: ("mass_kg=3.6", "uncertain={parameter: force_constant, factor: [0.8, 1.3]}"),
    Uncertainty.MASS_AND_FORCE_CONSTANT: (
        "mass_kg=[3.0, 4.5]",
        "uncertain={parameter: force_constant, factor: [0.8, 1.3]}",
    ),
}
POINT = "operating_point={position_m: 5.0e-5, current_a: 0.1}"


@pytest.mark.parametrize("kind", list(FAMILIES))
def test_the_end_members_are_the_ends_of_the_problem(resolved: Resolve, kind: Uncertainty) -> None:
    """At every frequency they have the plants of the lowest and the highest mass that stand for them."""
    inputs = resolved(*FAMILIES[kind], POINT)
    assert uncertainty(inputs) is kind
    problem, ends = build_problem(inputs), end_members(inputs)
    for member, mass in zip(ends, problem.end_masses_kg, strict=True):
        force = member.mass_kg * OMEGA**2 + member.negative_stiffness_n_per_m
        np.testing.assert_allclose(
            -member.current_stiffness_n_per_a / force, problem.plant(OMEGA, mass).real, rtol=1e-13
        )


@pytest.mark.parametrize("kind", list(FAMILIES))
def test_values_are_those_of_the_members(resolved: Resolve, kind: Uncertainty) -> None:
    """The plant with the value of a mass is the plant of that mass, in the whole range."""
    inputs = resolved(*FAMILIES[kind], POINT)
    problem, ends = build_problem(inputs), end_members(inputs)
    nominal = end_members({**inputs, "uncertain": None})[0]
    k_i, k_z = nominal.current_stiffness_n_per_a, nominal.negative_stiffness_n_per_m
    for mass in problem.mass.samples_kg(7):
        value = float(member_values(inputs, mass))
        plant = {
            Uncertainty.MASS: lambda v: -k_i / (v * OMEGA**2 + k_z),
            Uncertainty.NEGATIVE_STIFFNESS: lambda v: -k_i / (3.6 * OMEGA**2 + v),
            Uncertainty.FORCE_CONSTANT: lambda v: -k_i * v / (3.6 * OMEGA**2 + k_z * v),
            Uncertainty.MASS_AND_FORCE_CONSTANT: lambda v: -k_i / (v * OMEGA**2 + k_z),
        }[kind](value)
        np.testing.assert_allclose(plant, problem.plant(OMEGA, mass).real, rtol=1e-12)
    if kind is Uncertainty.NEGATIVE_STIFFNESS:
        assert [one.negative_stiffness_n_per_m for one in ends] == pytest.approx([0.9 * k_z, 0.4 * k_z])


def test_a_known_plant_is_one_member(resolved: Resolve) -> None:
    """It is stated once."""
    (member,) = end_members(resolved("mass_kg=3.6"))
    assert member.mass_kg == 3.6
    assert member.current_stiffness_n_per_a == pytest.approx(50.0)
    assert member.negative_stiffness_n_per_m == pytest.approx(62_500.0)

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
    Uncertainty.NEGATIVE_STIFFNESS: ("mass_kg=3.6", "uncertain={negative_stiffness: [0.4, 0.9]}"),
    Uncertainty.CURRENT_STIFFNESS: ("mass_kg=3.6", "uncertain={current_stiffness: [0.8, 1.1]}"),
    Uncertainty.FORCE_CONSTANT: ("mass_kg=3.6", "uncertain={force_constant: [0.8, 1.3]}"),
    Uncertainty.SEVERAL: (
        "mass_kg=[3.0, 4.5]",
        "uncertain={force_constant: [0.8, 1.3], current_stiffness: [0.9, 1.0]}",
    ),
}
POINT = "operating_point={position_m: 5.0e-5, current_a: 0.1}"


@pytest.mark.parametrize("kind", list(FAMILIES))
def test_the_kind_is_what_differs(resolved: Resolve, kind: Uncertainty) -> None:
    """Each study names what it leaves open, and the ends are those of its family."""
    inputs = resolved(*FAMILIES[kind], POINT)
    assert uncertainty(inputs) is kind
    assert end_members(inputs) == build_problem(inputs).family.ends


@pytest.mark.parametrize("kind", list(FAMILIES))
def test_values_are_those_of_the_members(resolved: Resolve, kind: Uncertainty) -> None:
    """The plant with the value of a member is that member, along the whole family."""
    inputs = resolved(*FAMILIES[kind], POINT)
    family = build_problem(inputs).family
    nominal = end_members({**inputs, "uncertain": None})[0]
    k_i, k_z = nominal.current_stiffness_n_per_a, nominal.negative_stiffness_n_per_m
    shares = family.shares(7)
    values = member_values(inputs, [family.member(float(share)) for share in shares])
    for share, value in zip(shares, values, strict=True):
        m, z, i = {
            Uncertainty.MASS: (value, k_z, k_i),
            Uncertainty.NEGATIVE_STIFFNESS: (3.6, value, k_i),
            Uncertainty.CURRENT_STIFFNESS: (3.6, k_z, value),
            Uncertainty.FORCE_CONSTANT: (3.6, value * k_z, value * k_i),
            Uncertainty.SEVERAL: (1.0, family.pole_squared(value), family.acceleration_per_current(value)),
        }[kind]
        rho = (m * OMEGA**2 + z) / i
        np.testing.assert_allclose(rho, family.current_per_displacement(OMEGA, share), rtol=1e-9)


def test_a_known_plant_is_one_member(resolved: Resolve) -> None:
    """It is stated once."""
    (member,) = end_members(resolved("mass_kg=3.6"))
    assert member.mass_kg == 3.6
    assert member.current_stiffness_n_per_a == pytest.approx(50.0)
    assert member.negative_stiffness_n_per_m == pytest.approx(62_500.0)

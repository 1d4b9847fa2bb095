"""The members of a case's family of plants, each with the mass and the stiffnesses that it has.

The plant is k_i/(m s² − k_z). A family has one uncertain number, and its members are told apart inside of magbear by a
mass (``model.problem``, decision 0014): the rotor's own where that is uncertain, an equivalent one where the magnets
are. What is handed over and drawn states the members themselves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magbear_cli.model.bearing import linearization
from magbear_cli.study.building import build_bearing

Floats = NDArray[np.float64]
Inputs = Mapping[str, Any]


class Uncertainty(StrEnum):
    """What the members of a family differ in."""

    MASS = "mass"
    NEGATIVE_STIFFNESS = "negative_stiffness"
    FORCE_CONSTANT = "force_constant"
    MASS_AND_FORCE_CONSTANT = "mass_and_force_constant"


@dataclass(frozen=True)
class Member:
    """One plant k_i/(m s² − k_z)."""

    mass_kg: float
    current_stiffness_n_per_a: float
    negative_stiffness_n_per_m: float


def uncertainty(inputs: Inputs) -> Uncertainty:
    """What the members of a case's family differ in; the mass where there is one member."""
    uncertain = inputs.get("uncertain")
    if uncertain is None:
        return Uncertainty.MASS
    if uncertain["parameter"] == "force_constant" and isinstance(inputs["mass_kg"], list):
        return Uncertainty.MASS_AND_FORCE_CONSTANT
    return Uncertainty(uncertain["parameter"])


def mass_ends_kg(inputs: Inputs) -> tuple[float, float]:
    """The lightest and the heaviest rotor."""
    mass = inputs["mass_kg"]
    return (float(mass[0]), float(mass[-1])) if isinstance(mass, list) else (float(mass), float(mass))


def end_members(inputs: Inputs) -> tuple[Member, ...]:
    """The two ends of the family, in the order of rising equivalent masses; one where nothing is uncertain.

    At every frequency (m ω² + k_z)/k_i of every member lies between those of the ends, and every value between them is
    that of a member.
    """
    point = inputs["operating_point"]
    linear = linearization(build_bearing(inputs), point["position_m"], point["current_a"])
    k_i, k_z = linear.current_stiffness_n_per_a, linear.negative_stiffness_n_per_m
    light, heavy = mass_ends_kg(inputs)
    low, high = (1.0, 1.0) if inputs.get("uncertain") is None else inputs["uncertain"]["factor"]
    if uncertainty(inputs) is Uncertainty.NEGATIVE_STIFFNESS:
        ends = Member(light, k_i, high * k_z), Member(heavy, k_i, low * k_z)
    else:
        ends = Member(light, high * k_i, high * k_z), Member(heavy, low * k_i, low * k_z)
    return tuple(dict.fromkeys(ends))


def member_values(inputs: Inputs, masses_kg: ArrayLike) -> Floats:
    """What members differ in, from the masses that stand for them in a case's outcome; of the same shape.

    The mass in kg, the negative stiffness in N/m, or the factor of the force constant. Where both the mass and the
    force constant are uncertain it is their quotient, the equivalent mass in kg, that tells members apart.
    """
    masses = np.asarray(masses_kg, dtype=float)
    kind = uncertainty(inputs)
    if kind is Uncertainty.NEGATIVE_STIFFNESS:
        ends = end_members(inputs)
        middle = 0.5 * (ends[0].negative_stiffness_n_per_m + ends[-1].negative_stiffness_n_per_m)
        return np.asarray(middle * float(inputs["mass_kg"]) / masses)
    if kind is Uncertainty.FORCE_CONSTANT:
        return np.asarray(float(inputs["mass_kg"]) / masses)
    return masses

"""The members of a case's family of plants, by what they differ in.

What is handed over and drawn states members by their own parameters: mass, negative stiffness and current stiffness.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magbear_cli.model.bearing import linearization
from magbear_cli.model.family import Plant
from magbear_cli.study.building import build_bearing, build_family
from magbear_cli.study.outcome import FrequencyStudy, PoleStudy, Summary

Floats = NDArray[np.float64]
Inputs = Mapping[str, Any]


class Uncertainty(StrEnum):
    """What the members of a family differ in."""

    MASS = "mass"
    NEGATIVE_STIFFNESS = "negative_stiffness"
    CURRENT_STIFFNESS = "current_stiffness"
    FORCE_CONSTANT = "force_constant"
    SEVERAL = "several"


def uncertainty(inputs: Inputs) -> Uncertainty:
    """What the members of a case's family differ in; the mass where there is one member."""
    kinds = [Uncertainty(name) for name in inputs.get("uncertain") or {}]
    if isinstance(inputs["mass_kg"], list):
        kinds.append(Uncertainty.MASS)
    if not kinds:
        return Uncertainty.MASS
    return kinds[0] if len(kinds) == 1 else Uncertainty.SEVERAL


def end_members(inputs: Inputs) -> tuple[Plant, ...]:
    """The two ends of the family; one where nothing is uncertain.

    At every frequency (m ω² + k_z)/k_i of every plant lies between those of the ends.
    """
    return build_family(inputs).ends


def members_of(study: FrequencyStudy | PoleStudy) -> list[Plant]:
    """The members that the rows of a study stand for."""
    columns = (study.masses_kg, study.negative_stiffness_n_per_m, study.current_stiffness_n_per_a)
    return [Plant(float(m), float(k_z), float(k_i)) for m, k_z, k_i in zip(*columns, strict=True)]


def worst_member(summary: Summary) -> Plant | None:
    """The member with the worst case; None where there is none."""
    values = (
        summary.worst_mass_kg,
        summary.worst_negative_stiffness_n_per_m,
        summary.worst_current_stiffness_n_per_a,
    )
    m, k_z, k_i = (np.nan if value is None else value for value in values)
    return Plant(m, k_z, k_i) if np.isfinite([m, k_z, k_i]).all() else None


def member_values(inputs: Inputs, members: Sequence[Plant]) -> Floats:
    """What members differ in, (k,): kg, N/m, N/A or the factor of the force constant.

    Where several parameters differ it is the share of the way from the first end to the last.
    """
    kind = uncertainty(inputs)
    if kind is Uncertainty.SEVERAL:
        family = build_family(inputs)
        ends = family.first, family.last
        by_a = abs(ends[0].pole_squared / ends[1].pole_squared - 1.0)
        by_b = abs(ends[0].acceleration_per_current / ends[1].acceleration_per_current - 1.0)
        quantity = Plant.pole_squared if by_a > by_b else Plant.acceleration_per_current
        first, last, *own = (quantity.__get__(plant) for plant in (*ends, *members))
        return np.asarray([(value - first) / (last - first) for value in own])
    if kind is Uncertainty.FORCE_CONSTANT:
        point = inputs["operating_point"]
        linear = linearization(build_bearing(inputs), point["position_m"], point["current_a"])
        return np.array([one.current_stiffness_n_per_a / linear.current_stiffness_n_per_a for one in members])
    name = {
        Uncertainty.MASS: "mass_kg",
        Uncertainty.NEGATIVE_STIFFNESS: "negative_stiffness_n_per_m",
        Uncertainty.CURRENT_STIFFNESS: "current_stiffness_n_per_a",
    }[kind]
    return np.array([float(getattr(one, name)) for one in members])

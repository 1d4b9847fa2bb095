"""Convex sets of K S within the specification."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import control_sensitivity
from magbear_cli.model.scaling import scale_problem
from magbear_cli.synthesis.control_set import ControlSet, Uncertainty, held_set, specification_level
from magbear_cli.synthesis.fixed_order import FixedOrderOptions, search_order

Maker = Callable[[float, float, float | None], ControlProblem]
Complexes = NDArray[np.complex128]
OMEGA = np.concatenate([[0.0], np.geomspace(0.01, 1e4, 120), [np.inf]])


@dataclass(frozen=True)
class Sampled:
    """A controller known by its response at OMEGA alone."""

    values: Complexes

    def response(self, omega_rad_s: NDArray[np.float64]) -> Complexes:
        """K."""
        assert omega_rad_s is OMEGA
        return self.values

    def controller(self) -> StateSpace:
        """There is none."""
        raise NotImplementedError


def _room(held: ControlSet, r: Complexes) -> NDArray[np.float64]:
    moduli = np.array([np.abs(modulus.offset + modulus.slope * r) for modulus in held.moduli])
    rows = [(row.offset + row.slope * r).real - (row.weights * moduli).sum(axis=0) for row in held.rows]
    return np.asarray(np.min(rows, axis=0))


@pytest.mark.parametrize("uncertainty", ["real", "complex"])
@pytest.mark.parametrize("omega_c", [2e4, None])
def test_what_the_set_holds_meets_the_specification(
    thrust_problem: Maker, uncertainty: Uncertainty, omega_c: float | None
) -> None:
    """The present K S is in the set, and random ones that are in it have a level of at most that of the set."""
    scaled, _ = scale_problem(thrust_problem(3.0, 4.5, omega_c))
    limited, _ = scale_problem(thrust_problem(3.0, 4.5, 2e4))
    lead = search_order(limited, FixedOrderOptions(1, uncertainty)).controller
    held = held_set(scaled, lead, OMEGA, 0.9, uncertainty)
    present = control_sensitivity(scaled, lead.response(OMEGA), OMEGA)
    assert _room(held, present).min() >= -1e-9
    plant = np.where(np.isfinite(OMEGA), scaled.plant(np.where(np.isfinite(OMEGA), OMEGA, 0.0), 0.5), 0.0)
    random, kept = np.random.default_rng(5), 0
    for size in np.geomspace(0.003, 1.0, 14):
        noise = random.normal(size=OMEGA.size) + 1j * random.normal(size=OMEGA.size)
        r = present + size * noise * np.abs(present)
        inside = _room(held, r) > 0
        level = specification_level(scaled, Sampled(r / (1.0 + plant * r)), OMEGA, uncertainty)
        assert level[inside].max(initial=0.0) <= 0.9 * (1.0 + 1e-6)
        kept += int(inside.sum())
    assert kept > 300

"""Proofs of sampled loops: they hold where nothing speaks against them, and fail where something does."""

from __future__ import annotations

import numpy as np
import pytest

from magbear_cli.analysis import sampled_proof
from magbear_cli.analysis.sampled_loop import SampledLoop, is_stable_on_samples, sampled_poles, sampled_worst_case
from magbear_cli.analysis.sampled_proof import prove_sampled_level, transformed
from magbear_cli.lti.sampled_system import bilinear
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.family import PlantFamily
from magbear_cli.model.held_plant import Sampling
from magbear_cli.model.problem import ControlProblem, RationalWeight

FAMILIES = [
    PlantFamily.of_ranges((3.0, 4.5), (62_500.0, 62_500.0), (50.0, 50.0)),
    PlantFamily.of_ranges((3.6, 3.6), (50_000.0, 75_000.0), (50.0, 50.0)),
    PlantFamily.of_ranges((3.0, 4.0), (55_000.0, 70_000.0), (45.0, 55.0)),
]


def _loop(problem: ControlProblem, controller: StateSpace, time: float, late: float) -> SampledLoop:
    return SampledLoop(problem, bilinear(controller, time), Sampling(time, late * time))


@pytest.mark.parametrize("late", [0.0, 0.37, 1.0, 1.5])
@pytest.mark.parametrize("family", FAMILIES, ids=["mass", "stiffness", "all three"])
def test_a_level_just_above_is_proven_and_one_below_refuted(
    good_lead: StateSpace, late: float, family: PlantFamily
) -> None:
    """The proof is within 0.1 % of the worst case that dense samples find, and below it says where it is exceeded."""
    weight = RationalWeight.low_pass(10.0, 200.0)
    problem = ControlProblem(family, weight, 20_000.0)
    loop = _loop(problem, good_lead, 2e-5, late)
    worst = sampled_worst_case(loop).level
    assert prove_sampled_level(loop, 1.001 * worst).proved
    refuted = prove_sampled_level(loop, 0.999 * worst)
    assert not refuted.proved
    assert "exceeded near" in refuted.sentence


def test_nothing_is_found_above_a_proven_level(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """Ten thousand random masses and frequencies stay below the level that was proven."""
    loop = _loop(quickstart, good_lead, 4e-5, 0.6)
    proof = prove_sampled_level(loop, sampled_worst_case(loop).level * 1.0005)
    assert proof.proved
    rng = np.random.default_rng(5)
    omega = 10.0 ** rng.uniform(0.0, np.log10(np.pi / 4e-5), 10_000)
    for part in omega.reshape(100, 100):
        assert loop.level(part, float(rng.uniform(0.0, 1.0))).max() < proof.level


def test_masses_between_stable_ends_are_not_forgotten(
    quickstart: ControlProblem, notch: StateSpace, good_lead: StateSpace
) -> None:
    """A loop that is stable at both ends and not between them is not proven at any level."""
    wide = ControlProblem.of_mass(62_500.0, 50.0, (2.0, 8.0), quickstart.performance, None)
    loop = _loop(wide, notch, 1e-6, 0.0)
    assert is_stable_on_samples(SampledLoop(_at(wide, 2.0), loop.controller, loop.sampling))
    assert is_stable_on_samples(SampledLoop(_at(wide, 8.0), loop.controller, loop.sampling))
    assert not prove_sampled_level(loop, 1e9).proved
    unstable = _loop(quickstart, good_lead, 3e-4, 1.0)
    assert "not stable" in prove_sampled_level(unstable, 10.0).sentence


def _at(problem: ControlProblem, mass_kg: float) -> ControlProblem:
    return ControlProblem.of_mass(62_500.0, 50.0, (mass_kg, mass_kg), problem.performance, None)


def test_the_transformed_quotient_is_the_controller(good_lead: StateSpace) -> None:
    """n/a at s = (z − 1)/(z + 1) is the response of the chain at z."""
    chain = bilinear(good_lead, 2e-5)
    num, den = transformed(chain)
    angles = np.array([0.01, 0.5, 2.0])
    s = 1j * np.tan(angles / 2.0)
    value = np.polyval([float(c) for c in num], s) / np.polyval([float(c) for c in den], s)
    np.testing.assert_allclose(value, chain.response(angles), rtol=1e-12)


@pytest.mark.parametrize("late", [0.0, 0.37, 2.0])
def test_the_exact_polynomial_has_the_poles_of_the_matrices(
    quickstart: ControlProblem, good_lead: StateSpace, late: float
) -> None:
    """Its roots, carried back to the plane of z, are the eigenvalues of the held plant with the chain around it."""
    loop = _loop(quickstart, good_lead, 2e-5, late)
    prover = sampled_proof._Prover.of(loop, transformed(loop.controller), 1.0)
    roots = np.roots([float(coefficient) for coefficient in prover.member()])
    poles = sampled_poles(loop, 0.0)
    np.testing.assert_allclose(np.sort_complex((1.0 + roots) / (1.0 - roots)), np.sort_complex(poles), atol=1e-6)

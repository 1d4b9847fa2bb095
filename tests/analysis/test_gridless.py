"""The proof that a stored controller reaches a level, for every mass and frequency."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from magbear_cli.analysis.gridless import prove_level
from magbear_cli.analysis.loop_functions import controller_response
from magbear_cli.lti.conversion import from_transfer_function
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.model.robust_performance import worst_level

ProblemMaker = Callable[[float, float, float | None], ControlProblem]
LeadMaker = Callable[[float, float, float], StateSpace]


def sampled_level(problem: ControlProblem, controller: StateSpace) -> float:
    """The worst case on a dense grid."""
    omega = np.concatenate([[0.0], np.geomspace(0.1, 1e8, 60_001), [np.inf]])
    return float(worst_level(problem, controller_response(controller, omega), omega)[0].max())


@pytest.fixture
def good_lead(lead: LeadMaker) -> StateSpace:
    """A first-order lead that holds 3.0-4.5 kg."""
    return lead(8.0e6, 700.0, 4.0e4)


@pytest.mark.parametrize(("low", "high", "omega_c"), [(3.0, 4.5, 20_000.0), (3.0, 4.5, None), (3.6, 3.6, 10_000.0)])
def test_what_is_sampled_is_proven_and_what_is_exceeded_is_refuted(
    thrust_problem: ProblemMaker, good_lead: StateSpace, low: float, high: float, omega_c: float | None
) -> None:
    """A part in ten thousand above the sampled worst case is proven, as much below it is refuted."""
    problem = thrust_problem(low, high, omega_c)
    level = sampled_level(problem, good_lead)
    proof = prove_level(problem, good_lead, level * 1.0001)
    assert proof.proved, proof.sentence
    refuted = prove_level(problem, good_lead, level * 0.9999)
    assert not refuted.proved
    assert refuted.sentence


def test_the_gain_at_the_frontier_matters(thrust_problem: ProblemMaker, good_lead: StateSpace) -> None:
    """A proof for a controller is none for the same with 1 % more or less gain where that makes it worse."""
    problem = thrust_problem(3.0, 4.5, 20_000.0)
    level = sampled_level(problem, good_lead) * 1.0002
    verdicts = [
        prove_level(problem, replace(good_lead, c=factor * good_lead.c, d=factor * good_lead.d), level).proved
        for factor in (0.99, 1.0, 1.01)
    ]
    assert verdicts[1]
    assert not all(verdicts)


def test_an_unstable_loop_is_refused_whatever_the_level(thrust_problem: ProblemMaker, lead: LeadMaker) -> None:
    """Too little gain leaves the rotor unheld."""
    proof = prove_level(thrust_problem(3.0, 4.5, 20_000.0), lead(1200.0, 500.0, 1e4), 1e6)
    assert not proof.proved
    assert "not stable" in proof.sentence


def test_a_loop_that_is_unstable_at_an_inner_mass_only_is_refused() -> None:
    """Stable at both ends of the mass range and unstable in between: no level is proven, however high."""
    den = [1.0, 1.21971094, 0.54683387, 0.35142409, -11.0863015]
    num = [-9.925, -6.8587843, -33.90209839, -3.88029778, 8.54349199]
    controller = from_transfer_function(num, den)
    weight = RationalWeight.low_pass(1.0, 1.0)

    def stable(mass: float) -> bool:
        roots = np.roots(np.polysub(np.polymul([mass, 0.0, -1.0], den), num))
        return bool(roots.real.max() < 0)

    assert stable(1.0)
    assert stable(2.0)
    assert not stable(1.5)
    for mass in (1.0, 2.0):
        assert prove_level(ControlProblem.of_mass(1.0, 1.0, (mass, mass), weight, 50.0), controller, 1e4).proved
    assert not prove_level(ControlProblem.of_mass(1.0, 1.0, (1.0, 2.0), weight, 50.0), controller, 1e4).proved


def test_a_hidden_unstable_mode_of_the_controller_is_seen(thrust_problem: ProblemMaker, good_lead: StateSpace) -> None:
    """A state that neither listens nor speaks but grows is part of the loop."""
    a = np.block([[good_lead.a, np.zeros((1, 1))], [np.zeros((1, 1)), np.array([[3.0]])]])
    hidden = StateSpace(a, np.vstack([good_lead.b, [[0.0]]]), np.hstack([good_lead.c, [[0.0]]]), good_lead.d)
    problem = thrust_problem(3.0, 4.5, 20_000.0)
    level = 1.01 * sampled_level(problem, good_lead)
    assert prove_level(problem, good_lead, level).proved
    assert not prove_level(problem, hidden, level).proved


def test_a_narrow_resonance_between_samples_is_found(thrust_problem: ProblemMaker, good_lead: StateSpace) -> None:
    """A notch of relative width 1e-6 in the controller, which a grid steps over, is refuted or left unproven."""
    centre, width = 1234.5678, 1e-3
    notch = from_transfer_function([1.0, 0.0, centre**2], [1.0, width, centre**2])
    series = StateSpace.of(
        np.block([[good_lead.a, np.zeros((1, 2))], [notch.b @ good_lead.c, notch.a]]),
        np.vstack([good_lead.b, notch.b @ good_lead.d]),
        np.hstack([notch.d @ good_lead.c, notch.c]),
        notch.d @ good_lead.d,
    )
    problem = thrust_problem(3.0, 4.5, 20_000.0)
    coarse = np.geomspace(1.0, 1e6, 600)
    sampled = worst_level(problem, controller_response(series, coarse), coarse)[0].max()
    assert not prove_level(problem, series, 1.02 * float(sampled)).proved


def test_a_controller_of_another_shape_is_refused(thrust_problem: ProblemMaker) -> None:
    """Two measurements are not one."""
    assert not prove_level(thrust_problem(3.0, 4.5, 2e4), StateSpace.gain([[1.0, 2.0]]), 1.0).proved

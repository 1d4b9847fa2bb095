"""Uncertain magnets, alone or with the mass: the same exactness, the same proofs, and brute force agrees."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from magbear_cli.analysis.loop_functions import controller_response
from magbear_cli.analysis.verification import verify
from magbear_cli.errors import Status
from magbear_cli.kernels.structured_singular_value import mu_upper_bound
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.generalized_plant import build_generalized_plant
from magbear_cli.model.robust_performance import (
    control_sensitivity,
    interconnection,
    open_interconnection,
    worst_level,
)
from magbear_cli.study.building import build_problem
from magbear_cli.study.outcome import CaseOutcome
from magbear_cli.study.pipeline import run_case
from magbear_cli.study.plan import case_id
from magbear_cli.study.proving import is_proof

Resolve = Callable[..., dict[str, Any]]
Floats = NDArray[np.float64]

LEAD = StateSpace.of([[-2e5]], [[1.0]], [[1.5e12]], [[-7.6e6]])
STIFFNESS = ("mass_kg=3.6", "uncertain={negative_stiffness: [0.4, 1.6]}")
FORCE = ("mass_kg=3.6", "uncertain={force_constant: [0.8, 1.2]}")
ALL = ("mass_kg=[3.0, 4.5]", "uncertain={negative_stiffness: [0.8, 1.2], current_stiffness: [0.9, 1.1]}")
OMEGA = np.geomspace(1.0, 1e7, 3000)

either = pytest.mark.parametrize("uncertain", [STIFFNESS, FORCE, ALL], ids=["stiffness", "force constant", "all"])


def _level_of(force: float, stiffness: float, controller: StateSpace, mass_kg: float = 3.6) -> Floats:
    """|W1 S| + |W3 T| from the definitions, for a bearing with these factors on k_i and k_z."""
    response = controller_response(controller, OMEGA)
    plant = -force * 50.0 / (mass_kg * OMEGA**2 + stiffness * 62_500.0)
    sensitivity = 1.0 / (1.0 - response * plant)
    w1 = np.abs(2000.0 / (1j * OMEGA + 200.0))
    level = w1 * np.abs(sensitivity) + (OMEGA / 20_000.0) ** 2 * np.abs(response * plant * sensitivity)
    return np.asarray(level, dtype=float)


def _brute_force(uncertain: tuple[str, str], controller: StateSpace) -> Floats:
    """The worst over 41 members of the family, at every frequency."""
    if uncertain is ALL:  # corners and inner points of the box, many of them on the path between the two ends
        share = np.linspace(0.0, 1.0, 41)
        inverse = (1 - share) / 3.0 + share / 4.5
        a, b = (1 - share) * 0.8 / 3.0 + share * 1.2 / 4.5, (1 - share) * 1.1 / 3.0 + share * 0.9 / 4.5
        path = np.column_stack([b / inverse, a / inverse, 1.0 / inverse])
        box = np.random.default_rng(8).uniform((0.9, 0.8, 3.0), (1.1, 1.2, 4.5), size=(60, 3))
        corners = [(i, z, m) for i in (0.9, 1.1) for z in (0.8, 1.2) for m in (3.0, 4.5)]
        levels = [_level_of(i, z, controller, m) for i, z, m in [*path, *box, *corners]]
    elif uncertain is FORCE:
        levels = [_level_of(f, f, controller) for f in np.linspace(0.8, 1.2, 41)]
    else:
        levels = [_level_of(1.0, f, controller) for f in np.linspace(0.4, 1.6, 41)]
    return np.asarray(np.max(levels, axis=0), dtype=float)


@pytest.fixture(scope="module", params=[STIFFNESS, FORCE, ALL], ids=["stiffness", "force constant", "all"])
def designed(request: pytest.FixtureRequest, resolved: Resolve) -> tuple[tuple[str, str], CaseOutcome]:
    """The best controller for each kind of uncertain magnets."""
    inputs = resolved(*request.param, "controller={method: mu_convex}", simulate=[])
    return request.param, run_case(inputs, case_id(inputs), 0)


@either
def test_the_closed_form_is_the_worst_member(resolved: Resolve, uncertain: tuple[str, str]) -> None:
    """No member of the family is above the closed form, and the nearest of them comes close."""
    problem = build_problem(resolved(*uncertain))
    response = controller_response(LEAD, OMEGA)
    level, brute = worst_level(problem, response, OMEGA)[0], _brute_force(uncertain, LEAD)
    assert np.all(brute <= level * (1 + 1e-9))
    assert np.all(brute >= level * 0.995)


@either
def test_three_forms_of_the_uncertain_loop_have_one_mu(resolved: Resolve, uncertain: tuple[str, str]) -> None:
    """Closed form by hand, Youla form and generalised plant agree, and mu is nowhere below the real worst case."""
    problem = build_problem(resolved(*uncertain))
    omega = np.geomspace(1.0, 1e6, 60)
    response = controller_response(LEAD, omega)
    by_hand = mu_upper_bound(interconnection(problem, response, omega))[0]
    p11, p12, p21 = open_interconnection(problem, omega)
    ks = control_sensitivity(problem, response, omega)
    youla = p11 + ks[:, None, None] * p12[:, :, None] * p21[:, None, :]
    np.testing.assert_allclose(mu_upper_bound(youla)[0], by_hand, rtol=1e-6)
    plant = build_generalized_plant(problem)
    system, n = plant.system, 3
    resolvent = np.linalg.solve(1j * omega[:, None, None] * np.eye(system.order) - system.a, system.b + 0j)
    whole = system.c @ resolvent + system.d
    gain = response / (1.0 - response * whole[:, n, n])
    loop = whole[:, :n, :n] + gain[:, None, None] * whole[:, :n, n:] * whole[:, n:, :n]
    np.testing.assert_allclose(mu_upper_bound(loop)[0], by_hand, rtol=1e-6)
    real = worst_level(problem, response, omega)[0]
    assert np.all(by_hand >= np.minimum(real, 1.0) * (1 - 1e-6))  # above 1 mu shrinks the uncertainty too
    end = mu_upper_bound(interconnection(problem, LEAD.d[0].astype(complex), np.array([np.inf])))[0][0]
    far = np.array([1e9])
    assert mu_upper_bound(interconnection(problem, controller_response(LEAD, far), far))[0][0] == pytest.approx(
        end, rel=1e-3
    )


def test_the_optimum_is_proven_from_both_sides(designed: tuple[tuple[str, str], CaseOutcome]) -> None:
    """A verified controller, brute force at its level, and a checked certificate within 1 % below."""
    uncertain, outcome = designed
    summary = outcome.summary
    assert outcome.status is Status.OK
    assert outcome.controller is not None
    assert summary.worst_case is not None
    assert summary.lower_bound is not None
    assert 0.99 * summary.worst_case < summary.lower_bound < summary.worst_case
    assert _brute_force(uncertain, outcome.controller).max() == pytest.approx(summary.worst_case, rel=2e-3)
    problem = build_problem(outcome.inputs)
    assert outcome.impossibility is not None
    assert is_proof(problem, outcome.impossibility)
    assert verify(problem, outcome.controller, summary.worst_case).verified


def test_an_unstable_member_is_seen(resolved: Resolve) -> None:
    """A gain that holds the nominal stiffness and not 1.6 times as much is called unstable, with its pole."""
    weak = {"method": "stored", "source": "the test", "a": [[-2e5]], "b": [[1.0]], "c": [[2.4e10]], "d": [[-121_600.0]]}
    outcome = run_case(resolved(*STIFFNESS, controller=weak, simulate=[]), "x", 0)
    assert outcome.status is Status.UNSTABLE
    assert run_case(resolved("mass_kg=3.6", controller=weak, simulate=[]), "x", 0).status is not Status.UNSTABLE


def test_wider_magnets_are_harder(resolved: Resolve) -> None:
    """More uncertainty never helps: the best level rises with the range of the stiffness."""
    levels = []
    for spread in (0.2, 0.5, 0.8):
        text = f"uncertain={{negative_stiffness: [{1 - spread}, {1 + spread}]}}"
        inputs = resolved("mass_kg=3.6", text, "controller={method: fixed_order, order: 2}", simulate=[])
        levels.append(run_case(inputs, "x", 0).summary.worst_case or np.nan)
    assert levels == sorted(levels)

"""A case from its inputs to its outcome: what is told of a loop is true of the controller that is stored with it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from magbear_cli.errors import Status
from magbear_cli.store.results import read_results, write_results
from magbear_cli.study.building import METHODS
from magbear_cli.study.outcome import CaseOutcome, StudyResults
from magbear_cli.study.pipeline import run_case
from magbear_cli.study.plan import case_id

Resolve = Callable[..., dict[str, Any]]
OutcomeOf = Callable[[str], CaseOutcome]

LEAD = {"a": [[-2e5]], "b": [[1.0]], "c": [[1.5e12]], "d": [[-7.6e6]]}
CONTROLLERS = {
    "mu_convex": "controller={method: mu_convex, max_order: 4}",
    "mu_convex complex": "controller={method: mu_convex, uncertainty: complex, max_order: 8}",
    "fixed_order": "controller={method: fixed_order}",
    "fixed_order least current": "controller={method: fixed_order, minimise: ks_peak}",
    "hinf": "controller={method: hinf}",
    "mu_dk": "controller={method: mu_dk, d_order: 1, iterations: 0, channel_scaling: false}",
    "hinf as printed": "controller={method: hinf, form: as_printed}",
    "lqg": "controller={method: lqg}",
    "lqg_ltr": "controller={method: lqg_ltr}",
    "pole_placement": "controller={method: pole_placement, omega_rad_s: 900}",
    "eigenstructure": "controller={method: eigenstructure}",
    "lqr": "controller={method: lqr}",
    "stored": "",
}

every_method = pytest.mark.parametrize("name", CONTROLLERS)


@pytest.fixture(scope="session")
def outcome_of(resolved: Resolve) -> OutcomeOf:
    """A function from a name above to the outcome of that case, computed once."""

    @cache
    def outcome(name: str) -> CaseOutcome:
        inputs = resolved(CONTROLLERS[name]) if CONTROLLERS[name] else resolved(controller=stored(**LEAD))
        return run_case(inputs, case_id(inputs), 0)

    return outcome


def stored(**matrices: object) -> dict[str, Any]:
    """The inputs of a controller that exists already."""
    return {"method": "stored", "source": "the test", **matrices}


def test_every_method_has_a_case_here() -> None:
    """No method of the pipeline is left out of the tests below."""
    assert {name.split()[0] for name in CONTROLLERS} == set(METHODS)


@every_method
def test_every_method_gives_a_controller_that_holds_every_mass(outcome_of: OutcomeOf, name: str) -> None:
    """On the thesis's bearing each design is stable over the range, its poles say so, and its step ends."""
    outcome = outcome_of(name)
    assert outcome.status in {Status.OK, Status.NOT_ACHIEVED}
    assert outcome.controller is not None
    assert outcome.poles is not None
    assert outcome.poles.poles_rad_s.shape == (outcome.poles.masses_kg.size, outcome.controller.order + 2)
    assert outcome.poles.poles_rad_s.real.max() < 0.0
    assert outcome.summary.max_pole_real_rad_s == outcome.poles.poles_rad_s.real.max()
    assert [(step.mass_kg, step.time_s.size) for step in outcome.steps] == [(3.6, 21)]
    assert (outcome.sentence == "") == (outcome.status is Status.OK)


@every_method
def test_the_bounds_of_mu_lie_on_both_sides(outcome_of: OutcomeOf, name: str) -> None:
    """The lower bound is nowhere above the upper one, and the exact real worst case is nowhere above mu."""
    outcome = outcome_of(name)
    frequency, summary = outcome.frequency, outcome.summary
    assert frequency is not None
    assert (frequency.mu_lower <= frequency.mu_upper * (1 + 1e-9)).all()
    assert summary.peak_mu_lower is not None
    assert summary.peak_mu is not None
    assert summary.peak_mu_lower <= summary.peak_mu
    assert frequency.mu_upper.max() <= summary.peak_mu * (1 + 1e-9)
    # below one, mu is the level that holds for more masses than the range, and complex ones among them
    assert ((frequency.worst_case <= frequency.mu_upper * (1 + 1e-6)) | (frequency.mu_upper > 1.0)).all()


@every_method
def test_the_worst_case_is_that_of_the_stored_matrices(outcome_of: OutcomeOf, name: str) -> None:
    """Straight from the definitions, on masses × frequencies, nothing is worse, and something is nearly as bad."""
    outcome = outcome_of(name)
    brute = brute_force(outcome)
    assert outcome.summary.worst_case is not None
    assert brute.max() <= outcome.summary.worst_case * (1 + 1e-6)
    assert brute.max() >= outcome.summary.worst_case * (1 - 5e-3)


@every_method
def test_verified_means_ok_and_a_level_of_one(outcome_of: OutcomeOf, name: str) -> None:
    """``verified`` and ``ok`` go together, and never with a worst case above one."""
    outcome = outcome_of(name)
    assert outcome.summary.verified == (outcome.status is Status.OK)
    if outcome.summary.verified:
        assert brute_force(outcome).max() <= 1.001
    else:
        assert outcome.summary.worst_case is not None
        assert outcome.summary.worst_case > 1.0
        assert f"{outcome.summary.worst_case:.4g}" in outcome.sentence


@every_method
def test_the_curves_obey_the_identities_of_a_loop(outcome_of: OutcomeOf, name: str) -> None:
    """S + T = 1 and K S is K times S, for every sample mass and frequency."""
    frequency = outcome_of(name).frequency
    assert frequency is not None
    S, T = frequency.sensitivity, frequency.complementary_sensitivity
    assert np.abs(S + T - 1.0).max() < 1e-9 * max(1.0, np.abs(S).max())
    assert np.allclose(frequency.control_sensitivity_a_per_m, frequency.controller_a_per_m * S, rtol=1e-9)
    assert frequency.masses_kg.tolist()[::2] == [3.0, 4.5]


@every_method
def test_an_outcome_is_read_as_it_was_written(outcome_of: OutcomeOf, name: str, tmp_path: Path) -> None:
    """Through the results file and back nothing changes."""
    results = StudyResults("small", "magbear: 1", (outcome_of(name),), {}, {})
    write_results(tmp_path / "results.h5", results)
    first = (tmp_path / "results.h5").read_bytes()
    again = read_results(tmp_path / "results.h5")
    assert again.outcomes[0].status is results.outcomes[0].status
    assert repr(again.outcomes[0].summary) == repr(
        results.outcomes[0].summary
    )  # NaN equals nothing, but looks the same
    assert again.outcomes[0].inputs == results.outcomes[0].inputs
    assert again.outcomes[0].controller is not None
    assert outcome_of(name).controller is not None
    write_results(tmp_path / "results.h5", again)
    assert (tmp_path / "results.h5").read_bytes() == first


@pytest.mark.parametrize("name", ["fixed_order", "hinf", "lqg"])
def test_the_same_case_gives_the_same_bytes(outcome_of: OutcomeOf, name: str, tmp_path: Path) -> None:
    """Computed again, by a process with another history, a case ends with the same file to the last bit."""
    first = outcome_of(name)
    second = run_case(first.inputs, first.case_id, first.index)
    for number, outcome in enumerate([first, second]):
        write_results(tmp_path / f"{number}.h5", StudyResults("small", "", (outcome,), {}, {}))
    assert (tmp_path / "0.h5").read_bytes() == (tmp_path / "1.h5").read_bytes()


def test_a_controller_judged_again_has_the_same_figures(outcome_of: OutcomeOf, resolved: Resolve) -> None:
    """The matrices of a design, given back as a stored controller, are judged as the design was."""
    first = outcome_of("fixed_order")
    assert first.controller is not None
    matrices = {name: getattr(first.controller, name).tolist() for name in "abcd"}
    again = run_case(resolved(controller=stored(**matrices)), "again", 0)
    assert again.status is first.status
    assert again.summary.worst_case == first.summary.worst_case
    assert again.summary.peak_mu == first.summary.peak_mu


@pytest.mark.parametrize(
    ("matrices", "says"),
    [
        ({"a": [[-1e3]], "b": [[1.0]], "c": [[0.0]], "d": [[1e6]]}, "a closed-loop pole at"),
        ({"a": [], "b": [], "c": [[]], "d": [[0.0]]}, "a closed-loop pole at"),
        ({"a": [], "b": [], "c": [[]], "d": [[-1e6]]}, "not stable for every mass"),
        ({"a": [[-2e5, 0.0], [0.0, 1e3]], "b": [[1.0], [0.0]], "c": [[1.5e12, 1.0]], "d": [[-7.6e6]]}, "1000 rad/s"),
    ],
    ids=["wrong sign", "no control", "no damping", "hidden unstable pole"],
)
def test_an_unstable_loop_is_called_unstable(resolved: Resolve, matrices: dict[str, Any], says: str) -> None:
    """A controller that does not hold the rotor is neither ok nor merely not good enough."""
    outcome = run_case(resolved(controller=stored(**matrices)), "x", 0)
    assert outcome.status is Status.UNSTABLE
    assert says in outcome.sentence
    assert not outcome.summary.verified
    assert (outcome.summary.worst_case, outcome.summary.peak_mu, outcome.summary.disk_margin) == (None, None, None)


@pytest.mark.parametrize(
    ("matrices", "says"),
    [
        ({**LEAD, "a": [[float("nan")]]}, "not finite"),
        ({**LEAD, "d": [[float("inf")]]}, "finite"),
        ({**LEAD, "b": [[1.0], [2.0]]}, "are not those of a controller"),
        ({**LEAD, "a": [[1.0, 2.0], [3.0]]}, "are not those of a controller"),
        ({**LEAD, "a": "fast"}, "are not those of a controller"),
        ({**LEAD, "b": [[1.0, 2.0]], "d": [[0.0, 0.0]]}, "does not map one position to one current"),
    ],
    ids=["nan", "inf", "sizes", "ragged", "text", "two inputs"],
)
def test_matrices_that_are_none_are_a_failure_with_a_sentence(
    resolved: Resolve, matrices: dict[str, Any], says: str
) -> None:
    """What is no controller is a failed case that names its source, without figures."""
    outcome = run_case(resolved(controller=stored(**matrices)), "x", 0)
    assert outcome.status is Status.FAILED
    assert says in outcome.sentence
    assert "the test" in outcome.sentence
    assert outcome.controller is None
    assert outcome.summary.worst_case is None


missing_the_limit = pytest.mark.parametrize(
    "name", ["mu_convex complex", "fixed_order", "fixed_order least current", "hinf", "lqg"]
)


@missing_the_limit
def test_what_was_not_found_is_not_called_impossible(resolved: Resolve, name: str) -> None:
    """A little above where linear control ends, methods that do not seek the exact optimum fail, which is no proof."""
    outcome = run_case(resolved(CONTROLLERS[name], "bandwidth.omega_c_rad_s=5120"), "x", 0)
    assert outcome.status is Status.NOT_ACHIEVED
    assert outcome.sentence
    assert not outcome.summary.verified


@missing_the_limit
def test_what_is_impossible_is_proven_for_every_method(resolved: Resolve, name: str) -> None:
    """At a bandwidth limit far below the plant's own speed the methods give up, and a certificate says why."""
    outcome = run_case(resolved(CONTROLLERS[name], "bandwidth.omega_c_rad_s=200"), "x", 0)
    assert outcome.status is Status.INFEASIBLE
    assert outcome.impossibility is not None
    assert outcome.sentence.startswith("proven")
    assert not outcome.summary.verified


def test_hinf_without_a_penalty_says_why(resolved: Resolve) -> None:
    """Without a bandwidth limit H-infinity has no penalty on the current: a failed case with the remedy."""
    outcome = run_case(resolved(CONTROLLERS["hinf"], "bandwidth=null"), "x", 0)
    assert outcome.status is Status.FAILED
    assert "D12" in outcome.sentence
    assert outcome.controller is None


def test_a_step_into_the_stator_ends_there(resolved: Resolve) -> None:
    """A step of 390 µm in a gap of 400 µm is a touch-down with a time and a place, and has no settling time."""
    outcome = run_case(resolved("controller={method: fixed_order}", "simulate.0.step_m=390e-6"), "x", 0)
    (step,) = outcome.steps
    assert step.touched_down
    assert step.end == "touched_down"
    assert abs(step.position_m[-1]) == pytest.approx(4e-4, rel=1e-3)
    assert (step.settling_time_s, step.overshoot, step.rise_time_s, step.final_error_m) == (None, None, None, None)
    assert step.sentence
    assert outcome.status is Status.OK


def test_every_mass_of_every_scenario_is_simulated(resolved: Resolve) -> None:
    """The steps come in the order of the study, each with the resolved entry it was made from."""
    twice = "simulate=[{step_m: 5e-6, samples: 5}, {step_m: 1e-5, samples: 5, masses_kg: [4.5], model: linear}]"
    outcome = run_case(resolved(twice), "x", 0)
    told = [(step.mass_kg, step.step_m, step.model) for step in outcome.steps]
    assert told[:1] == [(3.0, 5e-6, "nonlinear")]
    assert told[2:] == [(4.5, 5e-6, "nonlinear"), (4.5, 1e-5, "linear")]
    assert all(step.scenario["mass_kg"] == step.mass_kg and "masses_kg" not in step.scenario for step in outcome.steps)


def test_no_simulation_is_no_step(resolved: Resolve) -> None:
    """A case without ``simulate`` has a verdict and no steps."""
    outcome = run_case(resolved(simulate=[]), "x", 3)
    assert (outcome.steps, outcome.index) == ((), 3)
    assert outcome.status is Status.NOT_ACHIEVED


def test_one_mass_is_a_range_of_one(resolved: Resolve) -> None:
    """With a known mass mu, its bounds and the exact worst case are one number."""
    summary = run_case(resolved("mass_kg=3.6", "simulate=null"), "x", 0).summary
    assert summary.worst_case is not None
    assert summary.peak_mu == pytest.approx(summary.worst_case, rel=1e-9)
    assert summary.peak_mu_lower == pytest.approx(summary.worst_case, rel=1e-6)
    assert summary.worst_mass_kg == 3.6


def brute_force(outcome: CaseOutcome) -> NDArray[np.float64]:
    """|W1 S| + |W3 T| from the inputs and the stored matrices, for masses × frequencies, and its limit at infinity."""
    bearing, controller, weight = outcome.inputs["bearing"], outcome.controller, outcome.inputs["performance"]
    assert controller is not None
    k0, i0, z0 = bearing["force_constant_n_m2_per_a2"], bearing["bias_current_a"], bearing["air_gap_m"]
    k_z, k_i = 4 * k0 * i0**2 / z0**3, 4 * k0 * i0 / z0**2
    s = 1j * np.geomspace(1e-1, 1e8, 1500)
    low, high = outcome.inputs["mass_kg"]
    mass = np.linspace(low, high, 31)[:, None]
    resolvent = np.linalg.solve(s[:, None, None] * np.eye(controller.order) - controller.a, controller.b)
    K = (controller.c @ resolvent)[:, 0, 0] + controller.d[0, 0]
    G = k_i / (mass * s**2 - k_z)
    S = 1 / (1 - K * G)
    omega_c = outcome.inputs["bandwidth"]["omega_c_rad_s"]
    level = np.abs(np.polyval(weight["num"], s) / np.polyval(weight["den"], s) * S) + np.abs(
        s**2 / omega_c**2 * K * G * S
    )
    return np.append(level.max(axis=0), k_i * abs(controller.d[0, 0]) / (low * omega_c**2))

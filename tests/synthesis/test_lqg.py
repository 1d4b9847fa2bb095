"""LQG: the gains of the thesis, the separation of poles, and optimality."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.errors import NumericsError, Status
from magbear_cli.lti.connection import feedback
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.synthesis.lqg import LqgOptions, design_lqg, kalman_gain, lqr_gain, rotor_matrices


def _problem(k_i: float = 50.0, mass: float = 2.0, k_z: float = 62500.0) -> ControlProblem:
    return ControlProblem.of_mass(k_z, k_i, (mass, mass), RationalWeight.low_pass(10.0, 200.0))


@pytest.mark.parametrize(
    ("r", "k_i", "gain"),
    [
        (3e-9, 50.0, (1.955e4, 69.98)),  # section 2.3.1, where 1.955 is misprinted as 1.995
        (7.5e-10, 50.0, (3.779e4, 127.9)),  # program A.1
        (7.5e-10, 25.0, (3.910e4, 140.0)),  # the same with the half-switched current law
    ],
)
def test_feedback_gains_of_the_thesis(r: float, k_i: float, gain: tuple[float, float]) -> None:
    """The published weights give the published gains to their four digits."""
    found = lqr_gain(_problem(k_i), np.diag([1.0, 1e-5]), r)
    np.testing.assert_allclose(found.gain, gain, rtol=3e-4)
    assert found.residual < 1e-12


def test_filter_gain_of_the_thesis() -> None:
    """Ξ = 1 and Θ = 1e-15 give H = [5.629e3, 1.584e7] (section 2.3.1)."""
    statistics = design_lqg(_problem()).statistics
    assert statistics["filter_gain_position_per_s"] == pytest.approx(5.629e3, rel=1e-4)
    assert statistics["filter_gain_speed_per_s2"] == pytest.approx(1.584e7, rel=1e-3)
    assert statistics["gain_position_a_per_m"] == pytest.approx(1.955e4, rel=1e-3)


@settings(deadline=None, max_examples=40)
@given(
    st.floats(-12.0, -6.0), st.floats(-18.0, -10.0), st.floats(0.1, 50.0), st.floats(1e3, 1e7), st.floats(5.0, 500.0)
)
def test_poles_separate(r: float, theta: float, mass: float, k_z: float, k_i: float) -> None:
    """The loop's poles are those of the state feedback and those of the filter, and all are stable."""
    problem = _problem(k_i, mass, k_z)
    options = LqgOptions(r=10.0**r, theta=10.0**theta)
    design = design_lqg(problem, options)
    assert design.status is Status.OK
    assert design.controller is not None
    assert np.isnan(design.level)
    a, b, c = rotor_matrices(problem)
    force = np.array([[0.0], [1.0 / mass]])
    k = lqr_gain(problem, np.diag(options.q), options.r).gain[None, :]
    h = kalman_gain(problem, force @ force.T, options.theta).gain[:, None]
    expected = np.concatenate([np.linalg.eigvals(a - b @ k), np.linalg.eigvals(a - h @ c)])
    found = feedback(StateSpace(a, b, c, np.zeros((1, 1))), design.controller).poles()
    assert found.real.max() < 0
    np.testing.assert_allclose(np.poly(found).real, np.poly(expected).real, rtol=1e-6)


def test_the_controller_pushes_back() -> None:
    """With u = K y a stabilising controller answers a positive position with a negative current."""
    controller = design_lqg(_problem()).controller
    assert controller is not None
    assert controller(0.0)[0, 0].real < -62500.0 / 50.0


def test_the_cost_is_least() -> None:
    """Any other pair of gains has a higher cost under the same noise: the optimum is one."""
    problem, options = _problem(), LqgOptions()
    a, b, c = rotor_matrices(problem)
    force = np.array([[0.0], [0.5]])
    best = design_lqg(problem, options)
    k = lqr_gain(problem, np.diag(options.q), options.r).gain[None, :]
    h = kalman_gain(problem, force @ force.T, options.theta).gain[:, None]

    def cost(k: np.ndarray, h: np.ndarray) -> float:
        loop = np.block([[a, -b @ k], [h @ c, a - b @ k - h @ c]])
        noise = np.zeros((4, 4))
        noise[:2, :2], noise[2:, 2:] = options.xi * force @ force.T, options.theta * h @ h.T
        units = np.array([1.0, 1e-3, 1.0, 1e-3])  # speeds in m/ms keep the linear system well scaled
        loop, noise = loop * units[:, None] / units, noise * np.outer(units, units)
        identity = np.eye(4)
        system = np.kron(loop, identity) + np.kron(identity, loop)
        covariance = np.linalg.solve(system, -noise.ravel()).reshape(4, 4) / np.outer(units, units)
        return float(
            np.trace(np.diag(options.q) @ covariance[:2, :2]) + options.r * (k @ covariance[2:, 2:] @ k.T)[0, 0]
        )

    assert cost(k, h) == pytest.approx(best.statistics["quadratic_cost"], rel=1e-6)
    for factor in (0.9, 1.1):
        assert cost(k * factor, h) > cost(k, h)
        assert cost(k, h * factor) > cost(k, h)


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"q": (-1.0, 0.0)}, "q"),
        ({"r": 0.0}, "r"),
        ({"xi": -1.0}, "xi"),
        ({"theta": float("nan")}, "theta"),
        ({"q": (float("inf"), 0.0)}, "q"),
    ],
)
def test_weights_of_the_wrong_sign_are_refused(options: dict[str, float], name: str) -> None:
    """Each bad weight is named."""
    with pytest.raises(NumericsError, match=f"^{name} must"):
        LqgOptions(**options)  # type: ignore[arg-type]


def test_weights_beyond_double_precision_fail_with_a_sentence() -> None:
    """Weights that no double can relate end in status failed, or in gains that stabilise."""
    for options in (LqgOptions(r=1e-300), LqgOptions(theta=1e-300), LqgOptions(r=1e300, xi=0.0)):
        design = design_lqg(_problem(), options)
        assert design.status is Status.OK or design.sentence

"""The sum of first-order terms against extended precision, and where it must not be trusted."""

from __future__ import annotations

from collections.abc import Callable

import mpmath
import numpy as np
import pytest

from magbear_cli.lti import frequency
from magbear_cli.lti.balancing import with_balanced_states
from magbear_cli.lti.connection import series
from magbear_cli.lti.conversion import from_transfer_function, from_zeros_poles_gain
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.modal import accurate_difference, accurate_product, modal_form, split
from magbear_cli.lti.state_space import StateSpace


def test_the_two_ways_agree(random_system: Callable[..., StateSpace], monkeypatch: pytest.MonkeyPatch) -> None:
    """At many frequencies the terms add up to what solving gives at each."""
    omega = np.geomspace(1e-3, 1e4, 400)
    systems = [
        random_system(seed, order, inputs=2, outputs=3, decades=5.0) for seed, order in ((1, 3), (2, 8), (3, 20))
    ]
    monkeypatch.setattr(frequency, "MANY", 0)
    added_up = [frequency_response(system, omega) for system in systems]
    monkeypatch.setattr(frequency, "MANY", 10**9)
    for system, response in zip(systems, added_up, strict=True):
        size = np.abs(response).max(axis=(1, 2), keepdims=True)
        assert (np.abs(response - frequency_response(system, omega)) < 1e-10 * size).all()


def test_the_error_is_as_estimated_in_extended_precision() -> None:
    """A chain of near cancellations over six decades, mixed by a full change of states, is right to 1e-9."""
    zeros, poles = -np.geomspace(2.0, 5e5, 20) * (1.0 + 0.01j), -np.geomspace(2.1, 6e5, 20)
    chain = from_zeros_poles_gain(np.append(zeros, zeros.conj()), np.append(poles, 1.5 * poles), 1.0)
    mixed = np.eye(40) + 0.1 * np.random.default_rng(0).normal(size=(40, 40))
    system = with_balanced_states(
        StateSpace(mixed @ chain.a @ np.linalg.inv(mixed), mixed @ chain.b, chain.c @ np.linalg.inv(mixed), chain.d)
    )
    omega = np.geomspace(1.0, 1e6, 7)
    modes = modal_form(system)
    assert modes is not None
    response, estimate = modes.response(omega)
    with mpmath.workdps(50):
        a, b, c = (mpmath.matrix(matrix.tolist()) for matrix in (system.a, system.b, system.c))
        for at, point in enumerate(omega):
            exact = complex((c * mpmath.lu_solve(mpmath.mpc(0, point) * mpmath.eye(40) - a, b))[0])
            assert abs(response[at, 0, 0] - exact) <= 20.0 * estimate[at]
            assert abs(response[at, 0, 0] - exact) <= 1e-9 * abs(exact)


def test_a_defective_matrix_has_no_modes_that_are_trusted() -> None:
    """Five equal poles have no modal form worth trusting, and the response is that of solving."""
    system = from_transfer_function([1.0], np.poly([-1.0] * 5))
    omega = np.geomspace(0.01, 100.0, 2000)
    modes = modal_form(with_balanced_states(system))
    assert modes is None or (modes.response(omega)[1] > 1e-3).all()
    np.testing.assert_allclose(frequency_response(system, omega)[:, 0, 0], (1j * omega + 1.0) ** -5, rtol=1e-10)


def test_a_pole_on_the_axis_is_not_trusted() -> None:
    """The estimate is infinite where jω is a pole."""
    system = series(from_transfer_function([1.0], [1.0, 0.0]), from_transfer_function([1.0], [1.0, 3.0]))
    modes = modal_form(with_balanced_states(system))
    assert modes is not None
    assert np.isinf(modes.response(np.array([0.0]))[1][0])
    response = frequency_response(system, np.concatenate([[0.0], np.geomspace(1.0, 2.0, 20_000)]))
    assert np.isinf(response[0, 0, 0])
    assert np.isfinite(response[1:]).all()


def test_differences_of_products_are_right_to_the_last_digit() -> None:
    """A B − F G loses nothing where the two products agree to fifteen digits."""
    generator = np.random.default_rng(5)
    a = generator.normal(size=(8, 8)) + 1j * 1e-6 * generator.normal(size=(8, 8))
    b = generator.normal(size=(8, 8)) + 1j * generator.normal(size=(8, 8))
    c = a @ b
    with mpmath.workdps(60):
        wide = [mpmath.matrix([[mpmath.mpc(value) for value in row] for row in part.tolist()]) for part in (a, b, c)]
        exact = np.array((wide[0] * wide[1] - wide[2]).tolist(), dtype=complex)
    np.testing.assert_allclose(
        accurate_difference(accurate_product(split(a, 1), split(b, 0)), split(c, 1)), exact, atol=1e-27
    )


@pytest.mark.parametrize("seed", range(40))
def test_equal_poles_of_several_channels_are_answered_without_a_warning(seed: int) -> None:
    """Like channels, mixed by a rotation: there is a form that responds as solving does, or none."""
    generator = np.random.default_rng(seed)
    k, m = int(generator.integers(1, 5)), int(generator.integers(2, 4))
    q = np.linalg.qr(generator.standard_normal((m * k, m * k)))[0]
    a = q.T @ np.kron(np.eye(m), generator.standard_normal((k, k))) @ q
    b, c = generator.standard_normal((m * k, m)), generator.standard_normal((m, m * k))
    form = modal_form(StateSpace(a, b, c, np.zeros((m, m))))
    if form is None:
        return
    omega = np.array([0.1, 3.0])
    response, error = form.response(omega)
    expected = np.array([c @ np.linalg.solve(1j * w * np.eye(m * k) - a, b) for w in omega])
    assert (np.abs(response - expected).max(axis=(1, 2)) <= 10.0 * error + 1e-9 * np.abs(expected).max()).all()

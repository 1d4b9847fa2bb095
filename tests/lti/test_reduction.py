"""Reduced systems obey their error bounds and keep what they promise to keep."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from magbear_cli.errors import NumericsError
from magbear_cli.lti.connection import parallel
from magbear_cli.lti.conversion import from_transfer_function, from_zeros_poles_gain
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.norm import hinf_norm
from magbear_cli.lti.reduction import (
    balanced_residualization,
    balanced_truncation,
    hankel_singular_values,
)
from magbear_cli.lti.state_space import StateSpace

OMEGA = np.concatenate([[0.0], np.geomspace(1e-4, 1e8, 300), [np.inf]])
Reduction = Callable[[StateSpace, int], StateSpace]
reductions = pytest.mark.parametrize("reduce", [balanced_truncation, balanced_residualization])


def test_hankel_values_of_a_lag() -> None:
    """The lag g/(s + p) has the one Hankel singular value g/(2p)."""
    np.testing.assert_allclose(hankel_singular_values(from_transfer_function([6.0], [1.0, 4.0])), [0.75])


def test_hankel_values_do_not_depend_on_the_states(random_system: Callable[..., StateSpace]) -> None:
    """Any change of states leaves the Hankel singular values."""
    system = random_system(4, 7, 2, 2)
    t = np.random.default_rng(5).standard_normal((7, 7)) + 3 * np.eye(7)
    changed = StateSpace.of(np.linalg.solve(t, system.a @ t), np.linalg.solve(t, system.b), system.c @ t, system.d)
    np.testing.assert_allclose(hankel_singular_values(changed), hankel_singular_values(system), rtol=1e-7)


@reductions
def test_error_bound(reduce: Reduction, random_system: Callable[..., StateSpace]) -> None:
    """The largest error is at least the first value cut and at most twice the sum of all."""
    for seed in range(5):
        system = random_system(seed, 9, 2, 2, decades=3.0)
        values = hankel_singular_values(system)
        for order in (2, 5, 8):
            reduced = reduce(system, order)
            assert reduced.order == order
            error, _ = hinf_norm(parallel(system, StateSpace(reduced.a, reduced.b, -reduced.c, -reduced.d)))
            assert values[order] * (1 - 1e-6) <= error <= 2 * values[order:].sum() * (1 + 1e-6)


@reductions
def test_33_states_over_six_decades(reduce: Reduction) -> None:
    """The bound holds at the accuracy of the arithmetic for a 33-state chain over six decades."""
    system = from_zeros_poles_gain(-np.geomspace(2.0, 5e5, 32), -np.geomspace(1.0, 1e6, 33), 1e6)
    values = hankel_singular_values(system)
    full = frequency_response(system, OMEGA)
    for order in (8, 16, 24):
        error = np.abs(frequency_response(reduce(system, order), OMEGA) - full).max()
        assert error <= 2 * values[order:].sum() + 1e-9 * values[0]


def test_ends_are_kept(random_system: Callable[..., StateSpace]) -> None:
    """Truncation keeps the gain at ω = ∞, residualisation that at 0."""
    system = random_system(8, 8, 2, 1)
    zero, infinity = frequency_response(system, [0.0, np.inf])
    np.testing.assert_allclose(frequency_response(balanced_truncation(system, 3), np.inf)[0], infinity)
    np.testing.assert_allclose(frequency_response(balanced_residualization(system, 3), 0.0)[0], zero, rtol=1e-8)


@reductions
def test_unstable_poles_are_kept(reduce: Reduction, random_system: Callable[..., StateSpace]) -> None:
    """Unstable poles and poles on the axis survive, and the difference to the original is stable and small."""
    odd = from_transfer_function([1.0, 2.0], np.poly([0.0, 3.0, 1 + 2j, 1 - 2j]).real)
    system = parallel(random_system(2, 6), odd)
    reduced = reduce(system, 8)
    kept = reduced.poles()[reduced.poles().real > -1e-6]
    np.testing.assert_allclose(np.sort_complex(kept), np.sort_complex(odd.poles()), atol=1e-6)
    stable_values = hankel_singular_values(system)
    difference = frequency_response(reduced, OMEGA[1:]) - frequency_response(system, OMEGA[1:])
    assert np.abs(difference).max() <= 2 * stable_values[4:].sum() * (1 + 1e-3)


@reductions
def test_states_that_do_not_matter_go(reduce: Reduction) -> None:
    """A cancelled pole is not kept, and asking for more states than matter gives those that do."""
    system = from_transfer_function(np.poly([-3.0]), np.poly([-3.0, -2.0]))
    reduced = reduce(system, 2)
    assert reduced.order <= 2
    np.testing.assert_allclose(
        frequency_response(reduced, OMEGA), frequency_response(system, OMEGA), rtol=1e-6, atol=1e-12
    )
    assert reduce(StateSpace.gain([[2.0]]), 0).d[0, 0] == 2.0


@reductions
def test_refuses_to_lose_an_unstable_pole(reduce: Reduction) -> None:
    """An order below the number of unstable poles is an error."""
    with pytest.raises(NumericsError, match="not stable"):
        reduce(from_transfer_function([1.0], [1.0, 0.0, -4.0]), 0)


def _with_pole(pole_rad_s: float, *, rounded: bool) -> StateSpace:
    """An integrator whose pole is put somewhere, two real poles and two light pairs.

    In modal form, or with all entries of A mixed by a rotation, which rounds them at the size of the fastest pole.
    """
    fast = from_transfer_function(
        np.poly([-110.0, -150.0, -600 + 1500j, -600 - 1500j, -700 + 4000j, -700 - 4000j]).real,
        np.poly([-2500.0, -5000.0, -500 + 1800j, -500 - 1800j, -650 + 4200j, -650 - 4200j]).real,
    )
    slow = StateSpace.of([[pole_rad_s]], [[1.0]], [[9.0]], [[0.0]])
    system = parallel(slow, StateSpace(fast.a, fast.b, -5e4 * fast.c, -5e4 * fast.d))
    if not rounded:
        return system
    q = np.linalg.qr(np.random.default_rng(3).standard_normal((system.order, system.order)))[0]
    return StateSpace(q.T @ system.a @ q, q.T @ system.b, system.c @ q, system.d)


@reductions
@pytest.mark.parametrize("rounded", [False, True])
def test_an_integrator_moved_by_rounding_costs_no_other_state(reduce: Reduction, *, rounded: bool) -> None:
    """Wherever rounding has put the integrator's pole, the reduction is that of the exact integrator."""
    omega = np.geomspace(1.0, 1e6, 200)
    expected = frequency_response(reduce(_with_pole(0.0, rounded=False), 6), omega)
    for pole in (-1e-16, -1e-14, -1e-13, -1e-12, -1e-11, -1e-10, -1e-9, 1e-13):
        reduced = reduce(_with_pole(pole, rounded=rounded), 6)
        assert reduced.order == 6
        np.testing.assert_allclose(frequency_response(reduced, omega), expected, rtol=1e-5)


@reductions
def test_a_double_integrator_moved_by_rounding_is_kept(reduce: Reduction) -> None:
    """Rounding moves the two poles far more than one, to both sides or along the axis."""
    system = from_zeros_poles_gain([-1.0, -3.0, -50.0, -700.0], [0.0, 0.0, -800.0, -5e3, -3e4, -4e4], 1e9)
    omega = np.geomspace(1.0, 1e6, 200)
    expected = frequency_response(reduce(system, 5), omega)
    generator = np.random.default_rng(4)
    for _ in range(10):
        q = np.linalg.qr(generator.standard_normal((6, 6)))[0]
        mixed = StateSpace(q.T @ system.a @ q, q.T @ system.b, system.c @ q, system.d)
        reduced = reduce(mixed, 5)
        assert reduced.order == 5
        np.testing.assert_allclose(frequency_response(reduced, omega), expected, rtol=1e-4)

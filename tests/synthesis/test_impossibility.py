"""The search for proofs of impossibility."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from magbear_cli.model.impossibility_certificate import ImpossibilityCertificate
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.synthesis.impossibility import ImpossibilityOptions, find_impossibility

ProblemMaker = Callable[[float, float, float | None], ControlProblem]


def lag_sum(poles: tuple[float, ...], coefficients: tuple[float, ...], s: complex) -> complex:
    """c0 + Σ c_k p_k/(s + p_k)."""
    lags = sum(c * p / (s + p) for c, p in zip(coefficients[1:], poles, strict=True))
    return coefficients[0] + lags


def all_x_coefficients(certificate: ImpossibilityCertificate) -> tuple[float, ...]:
    """The coefficients of G_X with the derived one, which makes Σ c_k/p_k vanish."""
    poles, free = certificate.x_poles_rad_s, certificate.x_coefficients[1:]
    rest = -poles[0] * sum(c / p for c, p in zip(free, poles[1:], strict=True))
    return (certificate.x_coefficients[0], rest, *free)


def test_a_measure_and_a_force_exist_at_every_frequency(thrust_problem: ProblemMaker) -> None:
    """By brute force over R and P, the found functions satisfy the dual conditions where they are tried."""
    problem = thrust_problem(3.0, 4.5, 1e4)
    level = 0.625
    certificate = find_impossibility(problem, level).certificate
    assert certificate is not None
    x_coefficients = all_x_coefficients(certificate)
    for omega in np.geomspace(10.0, 1e6, 40):
        g_x = lag_sum(certificate.x_poles_rad_s, x_coefficients, 1j * omega)
        g_y = lag_sum(certificate.y_poles_rad_s, certificate.y_coefficients, 1j * omega)
        w1, w3 = float(problem.performance_bound(omega)), float(problem.bandwidth_bound(omega))
        measure = np.geomspace(1e-7, 1e4, 200_000) * abs(g_x) / level
        force = np.geomspace(1e-7, 1e4, 200_000) * abs(g_y) / level
        measure = measure[np.abs(g_x - level * measure) <= w3 * measure]
        force = force[np.abs(g_y + level * force) <= w1 * force]
        if measure.size < 2 or force.size < 2:  # an interval narrower than the search's step says nothing
            continue
        least, most = (1 + mass * omega**2 / 62_500.0 for mass in (3.0, 4.5))
        assert force.min() / measure.max() <= most
        assert force.max() / measure.min() >= least


def test_nothing_is_found_where_a_controller_exists(thrust_problem: ProblemMaker) -> None:
    """Above the least worst case there is no such pair of functions."""
    assert find_impossibility(thrust_problem(3.0, 4.5, 1e4), 0.65).certificate is None


@pytest.mark.parametrize(
    "change",
    [
        {"omega_c_rad_s": None},
        {"performance": RationalWeight((1.0,), (1.0, 1.0, 1.0, 1.0, 1.0))},
        {"performance": RationalWeight((1.0, 1.0), (1.0,))},
        {"performance": RationalWeight((1.0,), (1.0, -1.0))},
    ],
)
def test_problems_outside_of_the_theorem_have_no_certificate(
    thrust_problem: ProblemMaker, change: dict[str, RationalWeight | None]
) -> None:
    """No bandwidth limit, a weight that falls too fast, an improper or an unstable one: none is even sought."""
    assert find_impossibility(replace(thrust_problem(3.0, 4.5, 1e4), **change), 0.1).certificate is None  # type: ignore[arg-type]


def test_too_few_lags_find_nothing_rather_than_something_false(thrust_problem: ProblemMaker) -> None:
    """A basis that cannot hold the functions gives None."""
    assert find_impossibility(thrust_problem(3.0, 4.5, 1e4), 0.63, ImpossibilityOptions(2.0, 2)).certificate is None

"""The checker of proofs of impossibility: it accepts what is proven and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.analysis.certificate import check_certificate
from magbear_cli.errors import NumericsError
from magbear_cli.model.family import PlantFamily
from magbear_cli.model.impossibility_certificate import ImpossibilityCertificate
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.synthesis.impossibility import find_impossibility

ProblemMaker = Callable[[float, float, float | None], ControlProblem]


def thrust(
    low_kg: float, high_kg: float, omega_c: float | None, weight: RationalWeight | None = None
) -> ControlProblem:
    """The thrust bearing, for the module's certificates."""
    performance = weight or RationalWeight.low_pass(10.0, 200.0)
    return ControlProblem.of_mass(62_500.0, 50.0, (low_kg, high_kg), performance, omega_c)


@pytest.fixture(scope="module")
def at_the_limit() -> tuple[ControlProblem, ImpossibilityCertificate]:
    """3.0-4.5 kg at 5040 rad/s, about 1 % below what a controller reaches, with its certificate of level 1."""
    problem = thrust(3.0, 4.5, 5040.0)
    certificate = find_impossibility(problem).certificate
    assert certificate is not None
    return problem, certificate


def test_a_true_certificate_is_proven(at_the_limit: tuple[ControlProblem, ImpossibilityCertificate]) -> None:
    """What the search found at 5040 rad/s holds for all frequencies, ends included."""
    check = check_certificate(*at_the_limit)
    assert check.valid
    assert "proven for all frequencies" in check.sentence
    assert check.boxes < 10_000


@pytest.mark.parametrize(
    ("low", "high", "omega_c", "lower_bound"),
    [
        (3.0, 4.5, 20_000.0, 0.3955),
        (3.0, 4.5, 10_000.0, 0.6315),
        (3.0, 4.0, 10_000.0, 0.612),
        (3.0, 3.5, 7000.0, 0.7515),
    ],
)
def test_the_lower_bounds_are_within_one_percent_of_the_designs(
    low: float, high: float, omega_c: float, lower_bound: float
) -> None:
    """At the four points of the exact table the dual proves a level less than 1 % below that of a controller."""
    problem = thrust(low, high, omega_c)
    certificate = find_impossibility(problem, lower_bound).certificate
    assert certificate is not None
    assert check_certificate(problem, certificate).valid


def masses(low_kg: float, high_kg: float) -> PlantFamily:
    """Another range of the mass on the same magnets."""
    return PlantFamily.of_ranges((low_kg, high_kg), (62_500.0, 62_500.0), (50.0, 50.0))


def test_it_holds_for_every_harder_problem(at_the_limit: tuple[ControlProblem, ImpossibilityCertificate]) -> None:
    """A certificate is one for smaller ω_c, for a wider range and for larger weights too."""
    problem, certificate = at_the_limit
    assert check_certificate(replace(problem, omega_c_rad_s=4000.0), certificate).valid
    assert check_certificate(replace(problem, family=masses(2.9, 4.6)), certificate).valid
    heavier = replace(problem, performance=RationalWeight.low_pass(10.5, 200.0))
    assert check_certificate(heavier, certificate).valid


def test_it_holds_for_no_problem_that_a_controller_meets(
    at_the_limit: tuple[ControlProblem, ImpossibilityCertificate],
) -> None:
    """At 5200 rad/s, at 7000, for 3.0-4.0 kg and for a smaller weight there are controllers, and no proof passes."""
    problem, certificate = at_the_limit
    for easier in (
        replace(problem, omega_c_rad_s=5200.0),
        replace(problem, omega_c_rad_s=7000.0),
        replace(problem, family=masses(3.0, 4.0)),
        replace(problem, performance=RationalWeight.low_pass(9.5, 200.0)),
    ):
        check = check_certificate(easier, certificate)
        assert not check.valid
        assert check.sentence


def test_a_perturbed_coefficient_is_rejected(at_the_limit: tuple[ControlProblem, ImpossibilityCertificate]) -> None:
    """Each coefficient moved by 1 % (or each pole) leaves no proof: they cancel far more closely than that."""
    problem, certificate = at_the_limit
    for name in ("x_coefficients", "y_coefficients", "x_poles_rad_s", "y_poles_rad_s"):
        values = getattr(certificate, name)
        for index in range(1, len(values), 6):
            numbers = certificate.numbers()
            numbers[name] = [*values[:index], values[index] * 1.01, *values[index + 1 :]]
            perturbed = ImpossibilityCertificate.of_numbers(numbers)
            assert not check_certificate(problem, perturbed).valid, (name, index)


def test_a_higher_level_is_rejected(at_the_limit: tuple[ControlProblem, ImpossibilityCertificate]) -> None:
    """The same functions do not prove 5 % more, and certainly not infinity."""
    problem, certificate = at_the_limit
    assert not check_certificate(problem, replace(certificate, level=1.05)).valid
    assert not check_certificate(problem, replace(certificate, level=1e300)).valid


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(1e-4, 10.0))
def test_random_functions_prove_nothing_where_a_controller_exists(seed: int, size: float) -> None:
    """Whatever the numbers, a problem with a verified controller (3.0-4.5 kg, 6000 rad/s) passes no certificate."""
    rng = np.random.default_rng(seed)
    poles = tuple(np.sort(rng.uniform(1.0, 1e5, size=5)))
    x = (1.0, *(size * rng.normal(size=4)))
    y = (-abs(float(rng.normal())) - 0.1, *(size * rng.normal(size=5)))
    certificate = ImpossibilityCertificate(1.0, poles, tuple(map(float, x)), poles, tuple(map(float, y)))
    assert not check_certificate(thrust(3.0, 4.5, 6000.0), certificate).valid


@pytest.mark.parametrize(
    "weight",
    [
        RationalWeight((0.3, 600.0), (1.0, 60.0)),
        RationalWeight((6.0e5,), (1.0, 400.0, 9.0e4)),
        RationalWeight((1.0e8,), (1.0, 900.0, 3.0e5, 2.0e7)),
    ],
    ids=["biproper", "second order", "third order"],
)
def test_weights_of_every_fall_off_have_certificates(weight: RationalWeight) -> None:
    """|W1| constant, 1/s² and 1/s³ at infinity: each end has its own limit, and each is proven."""
    problem = thrust(3.0, 4.0, 900.0, weight)
    certificate = find_impossibility(problem).certificate
    assert certificate is not None
    assert check_certificate(problem, certificate).valid


def test_a_fixed_mass_has_certificates_too() -> None:
    """With one mass R/P is given, and the proof is the classical one."""
    problem = thrust(2.0, 2.0, 4400.0)
    certificate = find_impossibility(problem).certificate
    assert certificate is not None
    assert check_certificate(problem, certificate).valid
    assert not check_certificate(replace(problem, omega_c_rad_s=4500.0), certificate).valid


def test_problems_outside_of_the_theorem_are_refused(
    at_the_limit: tuple[ControlProblem, ImpossibilityCertificate],
) -> None:
    """No bandwidth limit, a weight that falls too fast, functions that do not fit the fall-off: refused in words."""
    problem, certificate = at_the_limit
    assert "bandwidth" in check_certificate(replace(problem, omega_c_rad_s=None), certificate).sentence
    steep = RationalWeight((1.0,), (1.0, 1.0, 1.0, 1.0, 1.0))
    assert "fall off" in check_certificate(replace(problem, performance=steep), certificate).sentence
    second = RationalWeight((6.0e5,), (1.0, 400.0, 9.0e4))
    assert "do not fit" in check_certificate(replace(problem, performance=second), certificate).sentence


def test_a_certificate_survives_its_plain_numbers(
    at_the_limit: tuple[ControlProblem, ImpossibilityCertificate],
) -> None:
    """Written as JSON values and read back it is the same, and still a proof."""
    problem, certificate = at_the_limit
    again = ImpossibilityCertificate.of_numbers(certificate.numbers())
    assert again == certificate
    assert check_certificate(problem, again).valid


@pytest.mark.parametrize(
    ("level", "x_poles", "x", "y_poles", "y"),
    [
        (0.0, (1.0, 2.0), (1.0, 1.0), (1.0,), (1.0, 1.0)),
        (1.0, (2.0, 1.0), (1.0, 1.0), (1.0,), (1.0, 1.0)),
        (1.0, (-1.0, 1.0), (1.0, 1.0), (1.0,), (1.0, 1.0)),
        (1.0, (1.0, 2.0), (1.0, 1.0, 1.0), (1.0,), (1.0, 1.0)),
        (1.0, (1.0, 2.0), (1.0, float("nan")), (1.0,), (1.0, 1.0)),
        (1.0, (1.0, 2.0), (1.0, 1.0), (1.0,), (1.0, 1.0, 1.0)),
    ],
)
def test_numbers_that_are_no_certificate_are_refused(
    level: float, x_poles: tuple[float, ...], x: tuple[float, ...], y_poles: tuple[float, ...], y: tuple[float, ...]
) -> None:
    """A level that is not positive, poles out of order or unstable, lengths that do not fit, NaN."""
    with pytest.raises(NumericsError):
        ImpossibilityCertificate(level, x_poles, x, y_poles, y)

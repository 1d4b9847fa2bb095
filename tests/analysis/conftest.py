"""The thrust bearing with its bounds, and controllers whose loops are known."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from magbear_cli.lti.conversion import from_transfer_function
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, RationalWeight

ProblemMaker = Callable[[float, float, float | None], ControlProblem]
LeadMaker = Callable[[float, float, float], StateSpace]


@pytest.fixture
def thrust_problem() -> ProblemMaker:
    """The thesis's bearing (k_z = 62 500 N/m, k_i = 50 N/A) with W1 = 2000/(s + 200), by mass range and ω_c."""

    def make(low_kg: float, high_kg: float, omega_c_rad_s: float | None) -> ControlProblem:
        performance = RationalWeight.low_pass(10.0, 200.0)
        return ControlProblem.of_mass(62_500.0, 50.0, (low_kg, high_kg), performance, omega_c_rad_s)

    return make


@pytest.fixture
def lead() -> LeadMaker:
    """K = −gain (s + zero)/(s + pole)."""

    def make(gain: float, zero_rad_s: float, pole_rad_s: float) -> StateSpace:
        return from_transfer_function([-gain, -gain * zero_rad_s], [1.0, pole_rad_s])

    return make


@pytest.fixture
def quickstart(thrust_problem: ProblemMaker) -> ControlProblem:
    """3.0-4.5 kg at ω_c = 20 000 rad/s."""
    return thrust_problem(3.0, 4.5, 20_000.0)


@pytest.fixture
def good_lead(lead: LeadMaker) -> StateSpace:
    """A lead found by direct search on the exact worst case of the quickstart: 0.4193."""
    return lead(7_764_165.0, 72.0, 17_995.0)


@pytest.fixture
def notch() -> StateSpace:
    """A lead with a pole-zero pair near 330 rad/s, stable with 2 kg and 8 kg and unstable with the masses between."""
    pole, zero, damping = 326.4234, 326.4234 * 1.02, 0.02
    num = [
        -6344.722 / 300.0 / zero**2,
        -6344.722 * (2 * damping / zero / 300.0 + 1 / zero**2),
        -6344.722 * (1 / 300.0 + 2 * damping / zero),
        -6344.722,
    ]
    fast = 20.0 * pole
    den = [
        1 / fast / pole**2,
        2 * damping / pole / fast + 1 / pole**2,
        1 / fast + 2 * damping / pole,
        1.0,
    ]
    return from_transfer_function(num, den)


@pytest.fixture
def slow_pi() -> StateSpace:
    """An exact integrator with a zero near 1 rad/s, a lag of 1 to 10 rad/s and a derivative, by partial fractions."""
    return StateSpace.of(
        [[0.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -20000.0]],
        [[1.0], [1.0], [1.0]],
        [[-24150.0, 1035.0, 7303653880.079476]],
        [[-367482.69400397385]],
    )


@pytest.fixture
def narrow_peak() -> ControlProblem:
    """The thrust bearing with W1 = (0.5 s + 50)/(s + 0.05) and a peak of 1 % damping at 300 rad/s upon it."""
    weight = RationalWeight((0.5, 80.0, 48_000.0, 4_500_000.0), (1.0, 6.05, 90_000.3, 4_500.0))
    return ControlProblem.of_mass(62_500.0, 50.0, (3.0, 4.5), weight, 20_000.0)


@pytest.fixture
def blind_to_the_peak() -> StateSpace:
    """A controller of order 4 designed on a grid that met no point of the narrow peak, and told to reach 0.5765."""
    return StateSpace.of(
        [
            [-17171.522326502425, 2327.7245056180363, 83.75229253488511, -1566.6799946898109],
            [114.94077361957427, -150.24941405657174, 14.909248024413781, -278.8941043731836],
            [11.150060953456999, 40.19700910656441, -3.8669912506877426, -27.054683602644726],
            [1184.8707819099511, 4271.5696182602105, 153.69247837886604, -62874.989136687465],
        ],
        [
            [4719.2688754487535],
            [840.1053634281666],
            [81.49611068873975],
            [8660.254037844386],
        ],
        [
            [5964266.343607892, -873887.6459950792, -33218.04913257515, 1580425.996405279],
        ],
        [
            [-1831468.49552254],
        ],
    )

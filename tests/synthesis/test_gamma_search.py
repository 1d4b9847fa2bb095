"""The search for the least H-infinity norm: a published figure, and norms that the loops really have."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.linalg import block_diag

from magbear_cli.errors import NumericsError
from magbear_cli.lti.connection import lower_lft
from magbear_cli.lti.conversion import from_transfer_function
from magbear_cli.lti.norm import hinf_norm
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.synthesis.gamma_search import Ports, search_gamma, with_unit_penalty

SCHERER = StateSpace.of(
    [[0, 10, 2], [-1, 1, 0], [0, 2, -5]],
    [[1, 0], [0, 1], [1, 0]],
    [[1, 0, 0], [0, 0, 0], [0, 1, 0]],
    [[0, 0], [0, 1], [2, 0]],
)


def test_the_seventh_example_of_scherer_gahinet_and_chilali() -> None:
    """Least H-infinity norm 9.508 (IEEE T. Automatic Control 42, 1997, example 7), reached and not undercut."""
    search = search_gamma(SCHERER, 1e-5)
    assert search.best is not None
    assert search.best.norm == pytest.approx(9.508, abs=5e-4)
    assert search.failed_gamma == pytest.approx(search.best.norm, rel=1e-4)
    loop = lower_lft(SCHERER, search.best.controller)
    assert loop.poles().real.max() < 0
    assert hinf_norm(loop)[0] == pytest.approx(search.best.norm, rel=1e-6)


def test_two_loops_side_by_side_have_the_norm_of_the_worse() -> None:
    """With two measurements and two controls the least norm of two separate plants is the larger of theirs."""
    doubled = StateSpace.of(*(np.kron(np.eye(2), matrix) for matrix in (SCHERER.a, SCHERER.b, SCHERER.c, SCHERER.d)))
    inputs, outputs = [0, 2, 1, 3], [0, 1, 3, 4, 2, 5]  # controls and measurements last
    plant = StateSpace(doubled.a, doubled.b[:, inputs], doubled.c[outputs], doubled.d[np.ix_(outputs, inputs)])
    search = search_gamma(plant, 1e-4, ports=Ports(2, 2))
    assert search.best is not None
    assert (search.best.controller.inputs, search.best.controller.outputs) == (2, 2)
    assert search.best.norm == pytest.approx(9.508, rel=1e-3)


def test_every_control_gets_a_unit_of_its_own() -> None:
    """After the change of units every column of D12 is one long, and a control that costs nothing keeps its unit."""
    d = np.array([[0.0, 3.0, 0.0], [0.0, 4.0, 0.0], [1.0, 0.0, 0.0]])
    plant = StateSpace(np.eye(1), np.ones((1, 3)), np.ones((3, 1)), d)
    scaled, units = with_unit_penalty(plant, Ports(1, 2))
    assert units == pytest.approx([0.2, 1.0])
    assert np.linalg.norm(scaled.d[:2, 1]) == pytest.approx(1.0)
    assert scaled.b[0] == pytest.approx([1.0, 0.2, 1.0])


def test_a_plant_outside_the_method_is_refused() -> None:
    """A control without a price ends in a sentence before SLICOT is called."""
    free = StateSpace(SCHERER.a, SCHERER.b, SCHERER.c, np.zeros((3, 2)))
    with pytest.raises(NumericsError, match="penalty"):
        search_gamma(free, 1e-3)


def _mixed_sensitivity(plant: StateSpace, weights: list[StateSpace], control_weight: float) -> StateSpace:
    """Y = w − G u with the errors (W1 y, w2 u); the disturbance enters at the measurement only."""
    n, p, m = plant.order, plant.outputs, plant.inputs
    a_w, b_w, c_w, d_w = (block_diag(*parts) for parts in zip(*((w.a, w.b, w.c, w.d) for w in weights), strict=True))
    k = a_w.shape[0]
    return StateSpace(
        np.block([[plant.a, np.zeros((n, k))], [-b_w @ plant.c, a_w]]),
        np.block([[np.zeros((n, p)), plant.b], [b_w, np.zeros((k, m))]]),
        np.block([[-d_w @ plant.c, c_w], [np.zeros((m, n + k))], [-plant.c, np.zeros((p, k))]]),
        np.block(
            [[d_w, np.zeros((p, m))], [np.zeros((m, p)), control_weight * np.eye(m)], [np.eye(p), np.zeros((p, m))]]
        ),
    )


def _limit(bandwidth_rad_s: float, degree: int = 1) -> StateSpace:
    """((s/M + ω)/(s + ω A)) with M = 1.5 and A = 1e-4; of degree two its square with the root of M."""
    root = 1.0 / degree
    num, den = np.poly1d([1.0 / 1.5**root, bandwidth_rad_s]), np.poly1d([1.0, bandwidth_rad_s * 1e-4])
    return from_transfer_function((num**degree).coeffs, (den**degree).coeffs)


def _disturbance_process() -> StateSpace:
    """Skogestad and Postlethwaite, example 2.11: 200/((10 s + 1)(0.05 s + 1)²)."""
    return from_transfer_function([200.0], np.polymul([10.0, 1.0], np.polymul([0.05, 1.0], [0.05, 1.0])))


def _two_by_two() -> StateSpace:
    """Skogestad and Postlethwaite, example 3.8: [[1, 1], [1 + 2 s, 2]]/((0.2 s + 1)(s + 1))."""
    a, b = np.array([[-6.0, -5.0], [1.0, 0.0]]), np.array([[5.0], [0.0]])  # 5/(s² + 6 s + 5), states s and 1
    c = np.array([[0.0, 1.0, 0.0, 1.0], [2.0, 1.0, 0.0, 2.0]])
    return StateSpace(np.kron(np.eye(2), a), np.kron(np.eye(2), b), c, np.zeros((2, 2)))


STABLE_PLANTS: dict[str, tuple[Callable[[], StateSpace], float]] = {
    "python-control 973, W2 = 0.1": (
        lambda: _mixed_sensitivity(
            from_transfer_function([1.0, 1.0], [1.0, 0.5, 4.0]),
            [from_transfer_function([2.0, -2.2, 1.0], [3.0, 0.2, 0.01])],
            0.1,
        ),
        0.6758,
    ),
    "2.11": (lambda: _mixed_sensitivity(_disturbance_process(), [_limit(10.0)], 1.0), 1.366),
    "2.11, squared weight": (lambda: _mixed_sensitivity(_disturbance_process(), [_limit(10.0, 2)], 1.0), 2.208),
    "3.8, 0.25 and 0.25 rad/s": (lambda: _mixed_sensitivity(_two_by_two(), [_limit(0.25), _limit(0.25)], 1.0), 2.795),
    "3.8, 0.25 and 25 rad/s": (lambda: _mixed_sensitivity(_two_by_two(), [_limit(0.25), _limit(25.0)], 1.0), 2.916),
    "3.8, 25 and 0.25 rad/s": (lambda: _mixed_sensitivity(_two_by_two(), [_limit(25.0), _limit(0.25)], 1.0), 6.723),
}


@pytest.mark.parametrize("name", STABLE_PLANTS)
def test_the_least_norm_on_a_stable_plant(name: str) -> None:
    """Published figures, and those of python-control: the filter's Riccati solution is zero, and no refusal."""
    make, least = STABLE_PLANTS[name]
    plant = make()
    channels = plant.inputs // 2
    search = search_gamma(plant, 1e-5, ports=Ports(channels, channels))
    assert search.best is not None
    assert search.best.norm == pytest.approx(least, rel=3e-4)
    assert lower_lft(plant, search.best.controller).poles().real.max() < 0

"""H-infinity at one level: what it promises on good plants, and a zoo of bad ones that must end in a sentence."""

from __future__ import annotations

import faulthandler
import sys
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.hinf import SLICOT_SAYS, HinfAnswer, hinf_controller, require_hinf_plant

Matrix = NDArray[np.float64]
Plant = tuple[Matrix, Matrix, Matrix, Matrix]


@pytest.fixture(autouse=True)
def end_a_hang() -> Iterator[None]:
    """A hang in compiled code ends the test process instead of waiting for ever."""
    faulthandler.dump_traceback_later(120, exit=True)
    yield
    faulthandler.cancel_dump_traceback_later()


def _plant(a: object, b: object, c: object, d: object) -> Plant:
    return np.array(a, float), np.array(b, float), np.array(c, float), np.array(d, float)


def _good(omega_c: float = 3310.0, corner: float = 200.0, k_z: float = 31250.0) -> Plant:
    """The bearing with W1 = 2000/(s + corner) and W3 = s²/omega_c², in seconds."""
    return _plant(
        [[0.0, 1.0, 0.0], [k_z, 0.0, 0.0], [2000.0, 0.0, -corner]],
        [[0.0, 0.0], [0.0, omega_c**2], [2000.0, 0.0]],
        [[0.0, 0.0, 1.0], [k_z / omega_c**2, 0.0, 0.0], [1.0, 0.0, 0.0]],
        [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]],
    )


def _with(plant: Plant, which: int, entry: tuple[int, int], value: float) -> Plant:
    matrices = [matrix.copy() for matrix in plant]
    matrices[which][entry] = value
    return matrices[0], matrices[1], matrices[2], matrices[3]


def _issue_152() -> Plant:
    """The plant of python-control issue 152, on which its H-infinity synthesis runs for ever."""
    return _plant(
        [[-0.01, -0.992], [0.0, -0.75]],
        [[0.992, 0.0], [0.0, 1.0]],
        [[1.0, -0.8], [0.0, -1.0]],
        [[0.8, 0.0], [1.0, 0.0]],
    )


def _issue_973() -> Plant:
    """Mixed sensitivity without a control weight, as in python-control issue 973."""
    return _plant(
        [[-1 / 15, 1 / 300, 1.0, -1.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -0.5, 4.0], [0.0, 0.0, -1.0, 0.0]],
        [[-1.0, 0.0], [0.0, 0.0], [0.0, 1.0], [0.0, 0.0]],
        [[7 / 9, 149 / 450, -2 / 3, 2 / 3], [0.0, 0.0, -1.0, 1.0]],
        [[2 / 3, 0.0], [1.0, 0.0]],
    )


def _issue_367() -> Plant:
    """A spring-mass-damper with its errors free of the control, as in python-control issue 367."""
    return _plant(
        [[-12.0, -20.0], [1.0, 0.0]], [[-1.0, -1.0], [0.0, 0.0]], [[1.0, 1.0], [1.0, 1.0]], [[0.0, 0.0], [1.0, 0.0]]
    )


def _unreachable() -> Plant:
    return _plant(np.diag([1.0, -2.0]), [[1.0, 0.0], [1.0, 1.0]], [[1.0, 1.0], [0.0, 0.0], [1.0, 1.0]], _PENALTIES)


def _unseen() -> Plant:
    return _plant(np.diag([1.0, -2.0]), [[1.0, 1.0], [1.0, 1.0]], [[1.0, 1.0], [0.0, 0.0], [0.0, 1.0]], _PENALTIES)


def _free_second_control() -> Plant:
    b = [[1.0, 0.0, 1.0, 1.0], [0.0, 1.0, 1.0, -1.0]]
    return _plant(-np.eye(2), b, [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]], [[0, 0, 1, 0], [0, 0, 2, 0], [1, 0, 0, 0]])


def _noiseless_second_measurement() -> Plant:
    c = [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, -1.0]]
    return _plant(-np.eye(2), [[1, 0, 1], [0, 1, 1]], c, [[0, 0, 1], [0, 0, 0], [1, 0, 0], [2, 0, 0]])


def _zero_at_three_rad_s(*, of_control: bool) -> Plant:
    """The transfer (s² + 9)/(s + 1)² from control to error, or from disturbance to measurement."""
    a = [[-2.0, -1.0], [1.0, 0.0]]
    if of_control:
        return _plant(a, [[0.0, 1.0], [1.0, 0.0]], [[-2.0, 8.0], [1.0, 0.0]], [[0.0, 1.0], [1.0, 0.0]])
    return _plant(a, [[1.0, 1.0], [0.0, 0.0]], [[1.0, 0.0], [-2.0, 8.0]], [[0.0, 1.0], [1.0, 0.0]])


def _parallel_double_integrators() -> Plant:
    """The same unstable plant realised twice, as in issue 13 of Octave's control package."""
    one = np.array([[0.0, 1.0], [0.0, 0.0]])
    a = np.block([[one, np.zeros((2, 2))], [np.zeros((2, 2)), one]])
    b, c = [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.0, 1.0]], [[1, 0, 1, 0], [0, 0, 0, 0], [1, 0, 1, 0]]
    return _plant(a, b, c, _PENALTIES)


def _of_order(n: int) -> Plant:
    generator = np.random.default_rng(n)
    a = generator.standard_normal((n, n)) - 0.5 * np.sqrt(n) * np.eye(n)
    return _plant(a, generator.standard_normal((n, 2)), generator.standard_normal((3, n)), _PENALTIES)


_PENALTIES = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]]

REFUSED: dict[str, tuple[Callable[[], Plant], str]] = {
    "nan in A": (lambda: _with(_good(), 0, (1, 1), np.nan), "not finite"),
    "infinity in B": (lambda: _with(_good(), 1, (1, 1), np.inf), "not finite"),
    "nan in D": (lambda: _with(_good(), 3, (0, 0), np.nan), "not finite"),
    "python-control 152": (_issue_152, r"no penalty on the control signal \(D12 = 0\): add a bandwidth limit or a"),
    "python-control 973": (_issue_973, r"no penalty on the control signal \(D12 = 0\)"),
    "python-control 367": (_issue_367, r"no penalty on the control signal \(D12 = 0\)"),
    "octave-control 13": (_parallel_double_integrators, "control does not reach the mode at 0 rad/s"),
    "unreachable unstable mode": (_unreachable, "control does not reach the mode at 1 rad/s"),
    "unseen unstable mode": (_unseen, "measurement does not see the mode at 1 rad/s"),
    "a control that costs nothing": (_free_second_control, "some control costs nothing"),
    "a measurement without noise": (_noiseless_second_measurement, "free of noise"),
    "no measurement noise": (lambda: _with(_good(), 3, (2, 0), 0.0), r"no disturbance on the measurement \(D21 = 0\)"),
    "zero of the control on the axis": (
        lambda: _zero_at_three_rad_s(of_control=True),
        "control to errors .* ±3j rad/s",
    ),
    "zero of the disturbance on the axis": (
        lambda: _zero_at_three_rad_s(of_control=False),
        "disturbance to measurement .* ±3j rad/s",
    ),
    "integrator as a weight": (lambda: _good(corner=0.0), "measurement does not see the mode at 0 rad/s"),
    "unstable weight": (lambda: _good(corner=-5.0), "measurement does not see the mode at 5 rad/s"),
    "no states": (
        lambda: (np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((3, 0)), np.array(_PENALTIES)),
        "the plant has no states",
    ),
}

ANSWERED: dict[str, Callable[[], Plant]] = {
    "stiffness 1e12 too large": lambda: _good(k_z=3e16),
    "stiffness 1e12 too small": lambda: _good(k_z=3e-8),
    "bandwidth beyond double precision": lambda: _good(omega_c=1e12),
    "bandwidth far below the rotor": lambda: _good(omega_c=1e-3),
    "micrometres and kilonewtons": lambda: (
        _good()[0] * np.array([1.0, 1e-9, 1e6]) / np.array([[1.0], [1e-9], [1e6]]),
        _good()[1] / np.array([[1.0], [1e-9], [1e6]]),
        _good()[2] * np.array([1.0, 1e-9, 1e6]),
        _good()[3],
    ),
    "repeated poles and a cancellation": lambda: _plant(
        [[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, -1.0]],
        [[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]],
        [[1.0, 1.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
        _PENALTIES,
    ),
    "order 30": lambda: _of_order(30),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_bad_plant_is_refused_in_plain_words(name: str) -> None:
    """A plant that breaks an assumption of the method never reaches SLICOT; the sentence says which and what to do."""
    make, sentence = REFUSED[name]
    plant = make()
    controls = 2 if name == "a control that costs nothing" else 1
    measurements = 2 if name == "a measurement without noise" else 1
    with pytest.raises(NumericsError, match=sentence):
        hinf_controller(*plant, measurements=measurements, controls=controls, gamma=10.0)


@pytest.mark.parametrize("name", ANSWERED)
@pytest.mark.parametrize("gamma", [1e-3, 1.0, 1e3, 1e100])
def test_a_hard_plant_gets_an_answer(name: str, gamma: float) -> None:
    """However badly scaled or large, a plant gets finite matrices or a sentence, at any level."""
    try:
        answer = hinf_controller(*ANSWERED[name](), measurements=1, controls=1, gamma=gamma)
    except NumericsError:
        return
    assert answer.is_solved == (answer.sentence == "")
    assert all(np.isfinite(matrix).all() for matrix in (answer.a, answer.b, answer.c, answer.d))
    if answer.is_solved:
        assert answer.a.shape[0] == ANSWERED[name]()[0].shape[0]


def test_states_in_other_units_make_no_difference() -> None:
    """The bearing in micrometres and kilonewtons has the same controller as in SI units."""
    first = hinf_controller(*_good(), measurements=1, controls=1, gamma=1.05)
    other = hinf_controller(*ANSWERED["micrometres and kilonewtons"](), measurements=1, controls=1, gamma=1.05)
    responses = [k.c @ np.linalg.solve(500j * np.eye(3) - k.a, k.b) + k.d for k in (first, other)]
    np.testing.assert_allclose(responses[1], responses[0], rtol=1e-3)


def test_the_edge_of_the_least_level() -> None:
    """Above the least level the loop is stable; below it there is no controller or one whose loop is unstable.

    SLICOT returns controllers, and no error, for levels that nothing can reach: the reason to close every loop.
    """
    plant = _good()
    for gamma in (0.5, 0.9, 0.99, 0.999):
        answer = hinf_controller(*plant, measurements=1, controls=1, gamma=gamma)
        assert not answer.is_solved or np.linalg.eigvals(_closed(plant, answer)[0]).real.max() >= 0
    for gamma in (1.001, 1.01, 1.1, 2.0):
        answer = hinf_controller(*plant, measurements=1, controls=1, gamma=gamma)
        assert np.linalg.eigvals(_closed(plant, answer)[0]).real.max() < 0


def test_a_stable_loop_stays_below_gamma() -> None:
    """Closed with the returned controller, a random plant that is stable stays below gamma on a dense grid."""
    stable = 0
    for seed in range(12):
        generator = np.random.default_rng(seed)
        matrices = [generator.standard_normal(shape) for shape in ((4, 4), (4, 2), (3, 4))]
        plant = (matrices[0], matrices[1], matrices[2], np.array(_PENALTIES))
        for gamma in (10.0, 1000.0):
            answer = hinf_controller(*plant, measurements=1, controls=1, gamma=gamma)
            if not answer.is_solved:
                continue
            a, b, c, d = _closed(plant, answer)
            if np.linalg.eigvals(a).real.max() >= 0:
                continue
            stable += 1
            for omega in np.geomspace(1e-3, 1e3, 200):
                assert np.linalg.norm(c @ np.linalg.solve(1j * omega * np.eye(8) - a, b) + d) < gamma
    assert stable >= 12


def _closed(plant: Plant, answer: HinfAnswer) -> Plant:
    """The loop of a plant with one control, one measurement and no D22."""
    a, b, c, d = plant
    u_x, u_w = answer.d @ c[-1:], answer.d @ d[-1:, :-1]
    return (
        np.block([[a + b[:, -1:] @ u_x, b[:, -1:] @ answer.c], [answer.b @ c[-1:], answer.a]]),
        np.vstack([b[:, :-1] + b[:, -1:] @ u_w, answer.b @ d[-1:, :-1]]),
        np.hstack([c[:-1] + d[:-1, -1:] @ u_x, d[:-1, -1:] @ answer.c]),
        d[:-1, :-1] + d[:-1, -1:] @ u_w,
    )


@pytest.mark.parametrize("code", range(1, 10))
def test_every_code_of_slicot_has_its_sentence(code: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each way in which SLICOT can stop is told in its own words."""
    import slycot
    from slycot.exceptions import SlycotArithmeticError

    def stop(*_: object, **__: object) -> None:
        raise SlycotArithmeticError("stopped", code)

    monkeypatch.setattr(slycot, "sb10fd", stop)
    answer = hinf_controller(*_good(), measurements=1, controls=1, gamma=2.0)
    assert not answer.is_solved
    assert answer.sentence == SLICOT_SAYS[code]
    assert len(set(SLICOT_SAYS.values())) == len(SLICOT_SAYS)


def _answering(entry: float, rcond: float) -> Callable[..., tuple[Matrix, ...]]:
    matrices = np.full((3, 3), entry), np.zeros((3, 1)), np.zeros((1, 3)), np.zeros((1, 1))
    return lambda *_, **__: (*matrices, np.full(4, rcond))


def test_what_slicot_returns_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """Matrices that are not finite do not count as solved."""
    import slycot

    monkeypatch.setattr(slycot, "sb10fd", _answering(np.nan, 1.0))
    answer = hinf_controller(*_good(), measurements=1, controls=1, gamma=2.0)
    assert not answer.is_solved
    assert "not finite" in answer.sentence


def test_a_condition_number_is_no_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    """SLICOT's estimate is zero where a Riccati equation has the solution zero; the caller measures the loop."""
    import slycot

    monkeypatch.setattr(slycot, "sb10fd", _answering(0.0, 0.0))
    answer = hinf_controller(*_good(), measurements=1, controls=1, gamma=2.0)
    assert answer.is_solved
    assert (answer.rcond == 0.0).all()


def test_refuses_impossible_sizes_and_levels() -> None:
    """A plant without controls, with too few errors, or a level that is no positive number is refused."""
    with pytest.raises(NumericsError, match="at least one control"):
        require_hinf_plant(*_good(), measurements=1, controls=0)
    with pytest.raises(NumericsError, match="as many errors"):
        require_hinf_plant(*_good(), measurements=3, controls=1)
    for gamma in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(NumericsError, match="gamma must be"):
            hinf_controller(*_good(), measurements=1, controls=1, gamma=gamma)


@pytest.mark.parametrize("exponent", [-150, 150])
def test_numbers_near_the_ends_of_double_precision(exponent: int) -> None:
    """Entries of 1e-150 or 1e150 end in a sentence or finite matrices, without a warning."""
    generator = np.random.default_rng(3)
    plant = tuple(generator.standard_normal(shape) for shape in ((3, 3), (3, 2), (3, 3)))
    penalties = np.array(_PENALTIES) * 10.0 ** (-exponent)
    try:
        answer = hinf_controller(
            plant[0], plant[1] * 10.0**exponent, plant[2], penalties, measurements=1, controls=1, gamma=1.0
        )
    except NumericsError:
        return
    assert answer.is_solved == (answer.sentence == "")


def test_without_slicot_there_is_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    """A library that cannot be loaded is named, with the remedy."""
    monkeypatch.setitem(sys.modules, "slycot", None)
    with pytest.raises(NumericsError, match="install slycot again"):
        hinf_controller(*_good(), measurements=1, controls=1, gamma=2.0)

"""Each margin is the perturbation at which a pole reaches the axis, and no smaller one does."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce

import numpy as np
import pytest
from mpmath import eye, mp, mpc, mpf
from mpmath import matrix as mp_matrix

from magbear_cli.analysis.frequency_grid import closed_frequency_grid
from magbear_cli.analysis.loop_functions import loop_functions
from magbear_cli.analysis.margins import Margins, disk_margin, gain_margins, stability_margins
from magbear_cli.analysis.pole_family import pole_family
from magbear_cli.lti.conversion import from_transfer_function
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, RationalWeight

ProblemMaker = Callable[[float, float, float | None], ControlProblem]


def _times(controller: StateSpace, factor: float) -> StateSpace:
    return StateSpace(controller.a, controller.b, factor * controller.c, factor * controller.d)


@pytest.fixture
def filtered_lead() -> StateSpace:
    """A lead behind a second-order roll-off, so that the gain may not rise without end."""
    return from_transfer_function([-400.0, -8e4], np.polymul([1e-4, 1.0], [5e-5, 1.0]))


def _judge(problem: ControlProblem, controller: StateSpace) -> Margins:
    return stability_margins(problem, controller, closed_frequency_grid(problem, controller))


def test_the_loop_with_the_gain_margins_is_on_the_edge(quickstart: ControlProblem, filtered_lead: StateSpace) -> None:
    """Just inside both gain margins all masses are stable; just outside one is not."""
    masses = quickstart.family.shares(9)
    grid = closed_frequency_grid(quickstart, filtered_lead)
    low, high = gain_margins(quickstart, filtered_lead, grid)
    assert 0 < low < 1 < high < np.inf
    for factor, stable in ((low * 1.001, True), (low * 0.999, False), (high * 0.999, True), (high * 1.001, False)):
        worst = pole_family(quickstart, _times(filtered_lead, factor), masses).max_real_rad_s
        assert (worst < 0) is stable


def test_the_gain_of_a_lead_may_rise_without_end(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """No frequency makes a lead real, so only the fall to k_z/(k_i |K(0)|) matters."""
    margins = _judge(quickstart, good_lead)
    assert margins.gain_high == np.inf
    assert margins.gain_low == pytest.approx(62_500.0 / (50.0 * 7_764_165.0 * 72.0 / 17_995.0), rel=1e-9)


def test_the_phase_margin_is_the_least_over_masses(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """Against crossovers read off a very dense grid for 41 masses: K G e^{-jφ} = 1."""
    omega = np.geomspace(1e2, 1e6, 200_001)
    response = np.polyval([-7_764_165.0, -7_764_165.0 * 72.0], 1j * omega) / (1j * omega + 17_995.0)
    phases, delays = [], []
    for share in quickstart.family.shares(41):
        gain = response * quickstart.plant(omega, share)
        for place in np.flatnonzero(np.diff(np.sign(np.abs(gain) - 1.0))):
            angle = np.angle(gain[place])
            phases.append(abs(angle))
            delays.append(np.mod(angle, 2 * np.pi) / omega[place])
    margins = _judge(quickstart, good_lead)
    assert margins.phase_deg == pytest.approx(np.degrees(min(phases)), rel=1e-3)
    assert margins.delay_s == pytest.approx(min(delays), rel=1e-3)


def test_a_delay_at_its_margin_is_on_the_edge(thrust_problem: ProblemMaker, good_lead: StateSpace) -> None:
    """1 − K G e^{-jωτ} has a zero on the axis for the margin τ of a known mass, and none for a smaller delay."""
    problem = thrust_problem(3.0, 3.0, None)
    delay = _judge(problem, good_lead).delay_s
    omega = np.geomspace(1e2, 1e5, 400_001)
    gain = loop_functions(problem, good_lead, omega, 0.0).controller_a_per_m * problem.plant(omega, 0.0)
    assert np.abs(1 - gain * np.exp(-1j * omega * delay)).min() < 1e-3
    assert np.abs(1 - gain * np.exp(-0.9j * omega * delay)).min() > 1e-2


def test_the_disk_margin_is_the_peak_of_s_minus_t(quickstart: ControlProblem, good_lead: StateSpace) -> None:
    """Against 201 masses on a dense grid; never above 2, the value of a loop without gain."""
    omega = np.geomspace(1.0, 1e6, 4001)
    loop = loop_functions(quickstart, good_lead, omega, quickstart.family.shares(201))
    peak = np.abs(loop.sensitivity - loop.complementary_sensitivity).max()
    margin = disk_margin(quickstart, good_lead, closed_frequency_grid(quickstart, good_lead))
    assert margin == pytest.approx(2.0 / peak, rel=1e-4)
    assert margin <= 2.0 / peak * (1 + 1e-9)


def test_the_disk_margin_guarantees_gain_and_phase(quickstart: ControlProblem, filtered_lead: StateSpace) -> None:
    """Gains in [(2 − α)/(2 + α), (2 + α)/(2 − α)] and phases to 2 atan(α/2) are inside the other margins."""
    margins = _judge(quickstart, filtered_lead)
    assert margins.gain_low <= (2 - margins.disk) / (2 + margins.disk)
    assert margins.gain_high >= (2 + margins.disk) / (2 - margins.disk)
    assert margins.phase_deg >= np.degrees(2 * np.arctan(margins.disk / 2))


def test_an_integrator_lets_the_gain_fall_to_little(quickstart: ControlProblem) -> None:
    """A pole of K at zero is no point of the grid; the lower gain margin comes from elsewhere."""
    controller = from_transfer_function([-7.7e6, -7.7e6 * 72.0, -7.7e6 * 72.0 * 5.0], [1.0, 18_000.0, 0.0])
    low, high = gain_margins(quickstart, controller, closed_frequency_grid(quickstart, controller))
    masses = quickstart.family.shares(5)
    assert 0 < low < 1
    assert high == np.inf
    assert pole_family(quickstart, _times(controller, 1.001 * low), masses).max_real_rad_s < 0
    assert pole_family(quickstart, _times(controller, 0.999 * low), masses).max_real_rad_s > 0


def test_a_pole_of_the_controller_within_rounding_of_zero_is_no_crossing() -> None:
    """A published PID for 193.39e3 N/m; its realisation has the integrator's pole at +4.7e-14 rad/s."""
    problem = ControlProblem.of_mass(193_390.0, 1.0, (1.9595, 1.9595), RationalWeight((0.4, 100.0), (1.0, 1.0)), None)
    controller = StateSpace.of(
        [[-3769.9111843077517, -2.0165954228029636e-13], [-1000.0000000000001, -6.5308094019741775e-15]],
        [[-100000.00000000001], [0.0]],
        [[-284340.7698244116, -119.68337036821178]],
        [[-7898965.28868138]],
    )
    margins = _judge(problem, controller)
    assert margins.gain_low == pytest.approx(0.551048, abs=5e-7)
    assert margins.gain_low <= (2 - margins.disk) / (2 + margins.disk)


def test_an_exact_integrator_is_no_crossing(slow_pi: StateSpace, thrust_problem: ProblemMaker) -> None:
    """Im K = 0 at 35.58 rad/s alone, where the gain may fall to 0.583023."""
    margins = _judge(thrust_problem(3.6, 3.6, None), slow_pi)
    assert margins.gain_low == pytest.approx(0.5830233602892902, rel=1e-9)
    assert margins.gain_high == np.inf


def test_an_integrator_in_the_weight_does_not_hide_the_gain_at_rest(good_lead: StateSpace) -> None:
    """K(0) limits the gain of a lead, though the grid of a problem with W1 = 1/s does not begin at ω = 0."""
    problem = ControlProblem.of_mass(62_500.0, 50.0, (3.0, 4.5), RationalWeight((1.0,), (1.0, 0.0)), None)
    expected = 62_500.0 / (50.0 * 7_764_165.0 * 72.0 / 17_995.0)
    assert _judge(problem, good_lead).gain_low == pytest.approx(expected, rel=1e-12)


def _random_controllers(count: int) -> list[tuple[StateSpace, ControlProblem]]:
    """Controllers with none to two integrators that hold random bearings; half of them with poles moved by rounding.

    A lead, fast lags, a zero for each integrator, and for most of them a slow lag, with which the real part of K near
    ω = 0 may be small.
    """
    generator = np.random.default_rng(12)
    found: list[tuple[StateSpace, ControlProblem]] = []
    while len(found) < count:
        integrators = len(found) % 3
        lead = 10.0 ** generator.uniform(1.3, 2.3)
        gain = 10.0 ** generator.uniform(3.1, 4.0)
        tops, bottoms = [[-gain / lead, -gain]], [[1.0]]
        bottoms += [[1.0 / speed, 1.0] for speed in 10.0 ** generator.uniform(3.0, 5.0, int(generator.integers(1, 4)))]
        tops += [[1.0, speed] for speed in 10.0 ** generator.uniform(-0.5, 1.5, integrators)]
        bottoms += [[1.0, 0.0]] * integrators
        if generator.random() < 0.7:
            speed = 10.0 ** generator.uniform(-1.0, 1.0)
            tops.append([1.0, speed * 10.0 ** generator.uniform(0.3, 1.2)])
            bottoms.append([1.0, speed])
        num, den = (reduce(lambda one, other: list(np.polymul(one, other)), factors) for factors in (tops, bottoms))
        controller = from_transfer_function(num, den)
        if len(found) // 3 % 2:
            change = np.linalg.qr(generator.standard_normal((controller.order,) * 2))[0]
            a, b, c = change.T @ controller.a @ change, change.T @ controller.b, controller.c @ change
            controller = StateSpace(a, b, c, controller.d)
        low = float(generator.uniform(2.0, 4.0))
        mass = (low, low * float(generator.uniform(1.0, 1.5)))
        problem = ControlProblem.of_mass(62_500.0, 50.0, mass, RationalWeight((0.4, 4.0), (1.0, 0.01)), None)
        if pole_family(problem, controller, problem.family.shares(5)).max_real_rad_s < 0:
            found.append((controller, problem))
    return found


def _exact_transfer_function(controller: StateSpace) -> tuple[list[mpf], list[mpf]]:
    """(num, den) by descending powers of s from the matrices as they are (Faddeev and Le Verrier)."""
    a, b, c = (mp_matrix(part.tolist()) for part in (controller.a, controller.b, controller.c))
    direct, n = mpf(float(controller.d[0, 0])), controller.order
    den, num, adjugate = [mpf(1)], [direct], eye(n)
    for k in range(1, n + 1):
        product = a * adjugate
        den.append(-sum(product[i, i] for i in range(n)) / k)
        num.append((c * adjugate * b)[0] + direct * den[-1])
        adjugate = product + den[-1] * eye(n)
    return num, den


def _value(coefficients: list[mpf], s: mpc) -> mpc:
    return reduce(lambda value, coefficient: value * s + coefficient, coefficients)


def _roots(coefficients: list[mpf]) -> list[mpc]:
    """The roots other than zero, as eigenvalues of the companion matrix."""
    first, last = (next(i for i, value in enumerate(row) if value) for row in (coefficients, coefficients[::-1]))
    trimmed = coefficients[first : len(coefficients) - last]
    n = len(trimmed) - 1
    companion = mp_matrix(n, n)
    for k in range(n):
        companion[0, k] = -trimmed[k + 1] / trimmed[0]
        if k:
            companion[k, k - 1] = mpf(1)
    return list(mp.eig(companion, left=False, right=False)) if n else []


def _exact_gain_margins(problem: ControlProblem, controller: StateSpace) -> tuple[float, float]:
    """From the roots in ω² of Im n(jω) a(−jω)/ω and from ω = 0, in 60 digits."""
    with mp.workdps(60):
        num, den = _exact_transfer_function(controller)
        degree = len(den) - 1
        odd = [mpf(0)] * (2 * degree + 1)  # of n(s) a(−s), whose odd powers of s make the imaginary part
        for i, top in enumerate(num):
            for k, bottom in enumerate(den):
                odd[i + k] += top * bottom * (-1) ** (degree - k)
        powers = [(2 * degree - place, value) for place, value in enumerate(odd) if place % 2]
        squares = _roots([value * (-1) ** ((power - 1) // 2) for power, value in powers])
        reals = [mp.re(root) for root in squares if abs(mp.im(root)) < mpf(10) ** -30 * abs(root)]
        omegas = [mp.sqrt(real) for real in reals if real > 0] + ([mpf(0)] if den[-1] else [])
        factors = []
        for omega in omegas:
            response = _value(num, mpc(0, omega)) / _value(den, mpc(0, omega))
            for plant in problem.family.ends:
                force = -plant.current_stiffness_n_per_a * mp.re(response)
                stiffness = plant.mass_kg * omega**2 + plant.negative_stiffness_n_per_m
                factors += [float(stiffness / force)] if force > 0 else []
        low, high = [factor for factor in factors if factor < 1], [factor for factor in factors if factor >= 1]
        return max(low, default=0.0), min(high, default=float("inf"))


def test_gain_margins_are_those_of_the_exact_polynomial() -> None:
    """200 random controllers with none to two integrators, in companion form and with poles that rounding has moved."""
    for controller, problem in _random_controllers(200):
        found = gain_margins(problem, controller, closed_frequency_grid(problem, controller))
        np.testing.assert_allclose(found, _exact_gain_margins(problem, controller), rtol=1e-6, atol=1e-6)


def test_no_margin_is_tighter_than_the_disk_allows() -> None:
    """The disk margin α promises gains from (2 − α)/(2 + α) to its inverse and phases up to 2 atan(α/2)."""
    for controller, problem in _random_controllers(200):
        margins = _judge(problem, controller)
        least = (2 - margins.disk) / (2 + margins.disk)
        assert margins.gain_low <= least * (1 + 1e-9)
        assert margins.gain_high >= (1 - 1e-9) / least
        assert margins.phase_deg >= np.degrees(2 * np.arctan(margins.disk / 2)) * (1 - 1e-9)

"""Sampled systems in sections: Tustin's rule, what rounding does to them, and their usual forms."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

from magbear_cli.errors import NumericsError
from magbear_cli.lti.conversion import from_zeros_poles_gain
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.sampled_system import SampledSystem, bilinear, paired
from magbear_cli.lti.state_space import StateSpace

TIME = 2.0e-5
ANGLES = np.array([1e-4, 0.01, 0.3, 1.0, 2.0, 3.1])


def _system() -> StateSpace:
    """Eight states: two light pairs of poles with zeros near by, and real poles from slow to very fast."""
    zeros = [-3.3e5, -5.6e3 - 6.5e3j, -5.6e3 + 6.5e3j, -1477.0, -592 - 1058j, -592 + 1058j, -118 - 9.6j, -118 + 9.6j]
    poles = [-3.5e5, -2.3e4, -5.2e3 - 5.9e3j, -5.2e3 + 5.9e3j, -1486.0, -591 - 1057j, -591 + 1057j, -196.0]
    return from_zeros_poles_gain(zeros, poles, -9.6e6)


@pytest.mark.parametrize("prewarp", [0.0, 2.0e4])
def test_sections_together_are_tustins_rule(prewarp: float) -> None:
    """The chain, its matrices in z and its second-order sections respond as python-control's own rule does."""
    system = _system()
    chain = bilinear(system, TIME, prewarp)
    own = control.ss(system.a, system.b, system.c, system.d)
    rule = control.sample_system(own, TIME, method="bilinear", prewarp_frequency=prewarp or None)
    expected = control.frequency_response(rule, ANGLES / TIME).complex
    np.testing.assert_allclose(chain.response(ANGLES), expected, rtol=1e-6)
    shifted = chain.shifted
    through_matrices = [shifted(np.exp(1j * angle))[0, 0] for angle in ANGLES]
    np.testing.assert_allclose(through_matrices, chain.response(ANGLES), rtol=1e-9)
    z = np.exp(1j * ANGLES)[:, None]
    rows = chain.second_order_sections()
    values = np.prod([np.polyval(row[:3], z) / np.polyval(row[3:], z) for row in rows], axis=0)[:, 0]
    np.testing.assert_allclose(values, chain.response(ANGLES), rtol=1e-6)


def test_the_prewarped_frequency_keeps_its_response() -> None:
    """At the frequency of the prewarping the sampled response is the continuous one."""
    system, omega = _system(), 2.0e4
    continuous = frequency_response(system, [omega])[0, 0, 0]
    assert bilinear(system, TIME, omega).response(omega * TIME) == pytest.approx(continuous, rel=1e-10)
    assert abs(bilinear(system, TIME).response(omega * TIME) / continuous - 1.0) > 1e-3


@pytest.mark.parametrize("time", [1e-6, 2e-5, 5e-4])
def test_the_recursion_is_exact_to_rounding(time: float) -> None:
    """Against the same recursion in 50 digits the error stays below 1e-13 of the peak, however fast the sampling."""
    chain = bilinear(_system(), time)
    signal = 1e-5 * np.sin(0.001 * np.arange(120.0) ** 2)
    with mp.workdps(50):
        states = [[mpf(0)] * section.order for section in chain.sections]
        exact = []
        for sample in signal:
            e = mpf(float(sample))
            for place, section in enumerate(chain.sections):
                x = states[place]
                a, b, c = section.a.tolist(), section.b[:, 0].tolist(), section.c[0].tolist()
                states[place] = [x[i] + sum(a[i][j] * x[j] for j in range(len(x))) + b[i] * e for i in range(len(x))]
                e = sum(c[j] * x[j] for j in range(len(x))) + float(section.d[0, 0]) * e
            exact.append(float(e))
    error = np.abs(chain.output(signal) - exact).max()
    assert error < 1e-13 * np.abs(exact).max()


def test_a_zero_that_nearly_cancels_a_pole_stands_in_its_section() -> None:
    """No section of the eight-state controller has a gain a hundred times that of its direct path, or of one."""
    chain = bilinear(_system(), TIME)
    grid = np.geomspace(1e-4, np.pi, 300)
    for section in chain.sections[:-1]:
        gain = np.abs(SampledSystem((section,), TIME).response(grid))
        assert 0.4 < gain.max() < 2.5
        assert gain.min() > 0.01


@st.composite
def _roots(draw: st.DrawFn, most: int) -> list[complex]:
    pairs = draw(st.lists(st.tuples(st.floats(-1e4, -1.0), st.floats(1.0, 1e4)), max_size=most // 2))
    real = draw(st.lists(st.floats(-1e5, -1.0), max_size=most - 2 * len(pairs)))
    return [complex(s, w) for s, w in pairs] + [complex(s, -w) for s, w in pairs] + [complex(s) for s in real]


@settings(max_examples=60, deadline=None)
@given(_roots(7), st.data())
def test_every_root_finds_one_place(poles: list[complex], data: st.DataObject) -> None:
    """Groups hold all poles and zeros once, conjugates together, at most two poles and no more zeros than poles."""
    zeros = data.draw(_roots(len(poles)))
    groups = paired(np.array(zeros, dtype=complex), np.array(poles, dtype=complex))
    for own, around in groups:
        assert own.size <= around.size <= 2
        for roots in (own, around):
            assert np.isclose(roots.sum().imag, 0.0)
    for part, given_roots in ((0, zeros), (1, poles)):
        found = np.concatenate([group[part] for group in groups])
        assert sorted(found, key=lambda z: (z.real, z.imag)) == sorted(given_roots, key=lambda z: (z.real, z.imag))
    assert sum(around.size == 1 for _, around in groups) <= 1


@pytest.mark.parametrize("time", [2e-6, 2e-5, 1e-4])
@pytest.mark.parametrize(
    "system",
    [
        # a scanning stage: two integrators, zeros at -10, -40 and -600 rad/s, in companion form
        StateSpace.of(
            [[-20000.0, -0.0, -0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            [[1.0], [0.0], [0.0]],
            [[774e9, -1216e9, -9600e9]],
            [[-4e7]],
        ),
        from_zeros_poles_gain([-10.0, -40.0], [0.0, 0.0], -3.0),
        from_zeros_poles_gain([], [0.0, 0.0], -3.0),
        from_zeros_poles_gain([-1.0, -2.0, -30.0], [0.0, 0.0, 0.0, -1e3], -3.0),
        from_zeros_poles_gain([-1.0], [-1e-9, -1e-9], -3.0),
    ],
)
def test_a_double_integrator_has_an_image(system: StateSpace, time: float) -> None:
    """Sections and matrices in z respond as s = (2/T)(z − 1)/(z + 1) says, and poles at zero stay at δ = 0."""
    chain = bilinear(system, time)
    expected = frequency_response(system, 2.0 / time * np.tan(ANGLES / 2.0))[:, 0, 0]
    np.testing.assert_allclose(chain.response(ANGLES), expected, rtol=1e-9)
    whole = chain.incremental
    np.testing.assert_allclose([whole(np.exp(1j * angle) - 1.0)[0, 0] for angle in ANGLES], expected, rtol=1e-6)
    assert chain.has_integrator == bool((np.abs(system.poles()) == 0.0).any())


def test_a_gain_stays_a_gain() -> None:
    """A controller without states answers each sample at once."""
    chain = bilinear(StateSpace.gain([[-3.0]]), TIME)
    assert chain.order == 0
    np.testing.assert_array_equal(chain.output([1.0, -2.0]), [-3.0, 6.0])
    np.testing.assert_array_equal(chain.second_order_sections(), [[-3.0, 0.0, 0.0, 1.0, 0.0, 0.0]])


def test_what_cannot_be_sampled_is_refused() -> None:
    """Prewarping beyond half the sampling frequency, and a pole at the rule's own speed."""
    with pytest.raises(NumericsError, match="needs a sample time below"):
        bilinear(_system(), TIME, 2.0e5)
    with pytest.raises(NumericsError, match="no image"):
        bilinear(StateSpace.of([[2.0 / TIME]], [1.0], [1.0], [[1.0]]), TIME)

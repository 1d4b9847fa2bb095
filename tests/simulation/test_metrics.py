"""The figures of a response are those of the formula when there is one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from magbear_cli.simulation.metrics import peak_magnitude, step_metrics

TIMES = np.linspace(0.0, 30.0, 6001)


def _second_order(t: float, zeta: float) -> float:
    damped = np.sqrt(1.0 - zeta**2)
    return float(1.0 - np.exp(-zeta * t) * (np.cos(damped * t) + zeta / damped * np.sin(damped * t)))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("zeta", [0.3, 0.5, 0.7])
def test_second_order_step(zeta: float, sign: float) -> None:
    """Overshoot is exp(−πζ/√(1−ζ²)); rise and settling are where the formula crosses 10, 90 and 100 ± 2 %."""
    rest = sign * 2e-6
    curve = CubicSpline(TIMES, [rest * _second_order(t, zeta) for t in TIMES])
    metrics = step_metrics(curve, 0.9 * rest, rest, 1.0)
    assert metrics.overshoot == pytest.approx(np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2)), rel=1e-5)
    peak = np.pi / np.sqrt(1.0 - zeta**2)
    rise = [brentq(lambda t, part=part: _second_order(t, zeta) - part, 0.0, peak) for part in (0.1, 0.9)]
    assert metrics.rise_time_s == pytest.approx(rise[1] - rise[0], rel=1e-6)
    outside = max(t for t in TIMES if abs(_second_order(t, zeta) - 1.0) > 0.02)
    assert metrics.settling_time_s == pytest.approx(outside, abs=TIMES[1])
    assert metrics.final_error_m == pytest.approx(0.1 * rest, rel=5e-3)
    assert metrics.peak_current_a == 1.0


def test_pulse() -> None:
    """A deviation that decays without changing sides has no overshoot; it has settled at 2 % of its peak."""
    curve = CubicSpline(TIMES, TIMES * np.exp(-TIMES))
    metrics = step_metrics(curve, 0.0, 0.0, 1.0)
    assert metrics.overshoot == pytest.approx(0.0, abs=1e-9)
    assert metrics.rise_time_s is None
    settled = metrics.settling_time_s
    assert settled is not None
    assert settled * np.exp(-settled) == pytest.approx(0.02 * np.exp(-1.0), rel=1e-5)


def test_pulse_that_swings_through() -> None:
    """The overshoot of a pulse's response is its other side over its peak."""
    curve = CubicSpline(TIMES, np.exp(-0.3 * TIMES) * np.sin(TIMES))
    expected = np.exp(-0.3 * np.pi)
    assert step_metrics(curve, 0.0, 0.0, 1.0).overshoot == pytest.approx(expected, rel=1e-5)


def test_what_has_not_settled_has_no_settling_time() -> None:
    """A swing that goes on, and one that enters the band at the very end, have not settled."""
    swing = CubicSpline(TIMES, 1.0 + 0.1 * np.sin(TIMES))
    assert step_metrics(swing, 1.0, 1.0, 1.0).settling_time_s is None
    slow = CubicSpline(TIMES, 1.0 - np.exp(-TIMES / 7.55))
    assert step_metrics(slow, 1.0, 1.0, 1.0).settling_time_s is None
    assert step_metrics(slow, 2.0, 2.0, 1.0).rise_time_s is None


def test_no_motion() -> None:
    """A rotor that nothing moves has settled from the start; one that ignores its command has not."""
    still = CubicSpline(TIMES, np.zeros_like(TIMES))
    assert step_metrics(still, 0.0, 0.0, 0.0).settling_time_s == 0.0
    ignored = step_metrics(still, 1e-5, 0.0, 0.0)
    assert ignored.settling_time_s is None
    assert ignored.final_error_m == -1e-5


def test_peak_between_the_breaks() -> None:
    """The largest magnitude is found inside a piece, and only up to the end given."""
    curve = CubicSpline(np.linspace(0.0, 2.0, 5), -np.sin(np.pi * np.linspace(0.0, 2.0, 5) / 2.2))
    fine = np.abs(curve(np.linspace(0.0, 2.0, 20001))).max()
    assert peak_magnitude(curve, 2.0) == pytest.approx(fine, rel=1e-7)
    assert peak_magnitude(curve, 0.5) == pytest.approx(abs(float(curve(0.5))))

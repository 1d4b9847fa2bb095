"""The linear loop by matrix exponentials alone: its exact response, its poles, and how long it takes to settle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from magbear_cli.errors import NumericsError
from magbear_cli.simulation.loop import DEMAND, MAGNETS, SENSOR, Loop

Floats = NDArray[np.float64]

LONGEST_S = 10.0  # a duration that is chosen is never longer
HORIZON_POINTS = 800
NOTHING = 1e-12  # of the gap: a motion that is only rounding
QUIET = 0.005  # of the response: a quarter of the 2 % that count as settled
INVISIBLE = 50.0  # time constants of growth after which an unstable mode that was moved at all fills the gap
MARGIN = 1.5  # what is simulated over what the linear loop needs: the nonlinear one may be slower


@dataclass(frozen=True, eq=False)
class LinearLoop:
    """x' = A x + B pulse with the force law replaced by its slopes, without limit and stator; outputs C x.

    The last two states are constant: the height of the step, and one for the weight. Shapes: a (n, n), b (n,),
    c (4, n), start (n,).
    """

    a: Floats
    b: Floats
    c: Floats
    start: Floats
    loop: Loop

    def poles_rad_s(self) -> NDArray[np.complex128]:
        """The poles of the closed loop, prefilter included."""
        return np.asarray(np.linalg.eigvals(self.a[:-2, :-2]), dtype=complex)

    @property
    def is_stable(self) -> bool:
        """Whether every pole is in the left half-plane."""
        return bool(self.poles_rad_s().real.max() < 0.0)

    def rest(self) -> float:
        """The deviation (m) at the sensor where the loop comes to rest when every pulse is over; NaN if nowhere."""
        try:
            state = np.linalg.solve(self.a[:-2, :-2], -self.a[:-2, -2:] @ self.start[-2:])
        except np.linalg.LinAlgError:
            return float("nan")
        return float(self.c[SENSOR] @ np.append(state, self.start[-2:]))


def linearize(loop: Loop) -> LinearLoop:
    """The loop with the magnets replaced by their slopes at the operating point.

    Raises
    ------
    NumericsError
        when the controller's numbers are so large that the loop's are not finite.
    """
    k_z, k_i = loop.magnets.slopes
    order = loop.b.size
    a, c = np.zeros((order + 1, order + 1)), np.hstack([loop.c, np.zeros((4, 1))])
    with np.errstate(over="ignore", invalid="ignore"):
        a[:order, :order] = loop.a + np.outer(loop.b, k_z * loop.c[MAGNETS] + k_i * loop.c[DEMAND])
    if not loop.scenario.gravity_compensation:
        a[:order, order] = -loop.b * loop.magnets.weight_n
    if not np.isfinite(a).all():
        raise NumericsError("the linear loop of this controller and this bearing has numbers beyond double precision")
    return LinearLoop(a, np.append(loop.b, 0.0), c, np.append(loop.start, 1.0), loop)


def linear_response(linear: LinearLoop, times_s: Floats) -> tuple[Floats, Floats]:
    """Deviation at the sensor (m) and control current (A) of the linear loop at ascending times from 0 to the end.

    Exact up to rounding, each (samples,); entries too large for a double are infinite or NaN. Few different widths
    between the times make it quick: each costs one matrix exponential.
    """
    times, duration_s = times_s, float(times_s[-1])
    outputs = np.empty((times.size, 4))
    state = linear.start
    now = 0.0
    flows: dict[float, Floats] = {}
    with np.errstate(all="ignore"):
        for start_s, end_s, pulse_n in linear.loop.scenario.segments(duration_s):
            inside = np.flatnonzero((times >= start_s) & (times < end_s))
            generator = _with_pulse(linear, pulse_n)
            flows.clear()
            for index in inside:
                state = _advance(generator, state, times[index] - now, flows)
                outputs[index] = linear.c @ state
                now = times[index]
            state = _advance(generator, state, end_s - now, flows)
            now = end_s
        outputs[-1] = linear.c @ state
    return outputs[:, SENSOR], linear.loop.magnets.standing_current_a + outputs[:, DEMAND]


def _with_pulse(linear: LinearLoop, pulse_n: float) -> Floats:
    """A with a constant pulse of force put on the state that is one."""
    a = linear.a.copy()
    a[:, -1] += linear.b * pulse_n
    return a


def _advance(generator: Floats, state: Floats, width_s: float, flows: dict[float, Floats]) -> Floats:
    """The state one width later; equal widths, up to rounding of the times, share their exponential."""
    if width_s <= 0.0:
        return state
    key = float(f"{width_s:.9e}")
    if key not in flows:
        flows[key] = expm(width_s * generator)
    return np.asarray(flows[key] @ state)


def choose_duration(linear: LinearLoop) -> float:
    """A duration in s in which the linear loop settles, or in which an unstable one reaches the stator.

    Half as long again as the linear response takes to come within half a percent of its rest; the response itself
    is looked at, so that a slow pole that it does not show costs nothing. At least twenty times the time constant of
    the prefilter, at most ten seconds, rounded up to two digits.
    """
    rates = linear.poles_rad_s().real
    growth = float(rates.max())
    contact = _contact_time(linear, growth) if growth >= 0.0 or not np.isfinite(linear.rest()) else None
    if contact is None:
        slowest = float(min(-rates[rates < 0.0], default=1.0 / LONGEST_S))
        wanted = MARGIN * _quiet_time(linear, slowest)
    else:
        wanted = MARGIN * contact
    prefilter = linear.loop.scenario.prefilter
    if prefilter is not None:
        wanted = max(wanted, 20.0 / prefilter.omega_rad_s)
    return _rounded_up(min(wanted, LONGEST_S))


def _quiet_time(linear: LinearLoop, slowest_rad_s: float) -> float:
    """When the stable linear response comes to rest: sampled over ever shorter spans, until the samples resolve it."""
    pulse = linear.loop.scenario.disturbance
    over = 0.0 if pulse is None else pulse.end_s
    span = over + min(20.0 / slowest_rad_s, LONGEST_S)
    rest = linear.rest()
    quiet = span
    for _ in range(20):
        position, _ = linear_response(linear, np.linspace(0.0, span, HORIZON_POINTS + 1))
        size = abs(rest) if linear.loop.scenario.step_m != 0.0 else float(np.abs(position).max())
        if size <= NOTHING * linear.loop.magnets.bearing.air_gap_m:
            return span
        loud = np.flatnonzero(np.abs(position - rest) > QUIET * size)
        last = int(loud[-1]) + 1 if loud.size else 1
        quiet = span * min(last, HORIZON_POINTS) / HORIZON_POINTS
        if last > HORIZON_POINTS // 8 or quiet <= over:
            break
        span = max(4.0 * quiet, 1.05 * over)
    return quiet


def _contact_time(linear: LinearLoop, growth_rad_s: float) -> float | None:
    """When the linear response of an unstable loop leaves the gap; None when its unstable modes never show."""
    below, above = linear.loop.magnets.gap_m
    longest = min(INVISIBLE / growth_rad_s, LONGEST_S) if growth_rad_s > 0.0 else LONGEST_S
    span = longest / 1024
    while span <= longest:
        position, _ = linear_response(linear, np.linspace(0.0, span, HORIZON_POINTS + 1))
        out = np.flatnonzero(~((below < position) & (position < above)))
        if out.size:
            return span * float(out[0]) / HORIZON_POINTS
        span *= 2.0
    return None


def _rounded_up(number: float) -> float:
    """The number, rounded up to two significant digits."""
    unit = 10.0 ** (np.floor(np.log10(number)) - 1.0)
    return float(np.ceil(number / unit * (1.0 - 1e-12)) * unit)

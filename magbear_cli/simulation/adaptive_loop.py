"""The loop of the adaptive law as one differential equation between two switchings, in numbers that are quick to take.

Rotor, sensor, prefilter and reference model are linear: x' = A x + b f with f the net force at the magnets; the
states that are speeds are divided by ω of the reference model, so that all of them are metres. To x come the three
coefficients of the estimate (C0 in A, C1 in A/m and A s/m). What is measured has a relative degree of two or more, so
that its speed is an exact output and not a difference.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import hypot

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.lti.connection import append, series
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.adaptive_law import AdaptiveLaw, Trigger
from magbear_cli.model.bearing import Bearing, force_in_floats
from magbear_cli.model.filters import Prefilter
from magbear_cli.model.rotor import rotor_dynamics
from magbear_cli.simulation.loop import Magnets
from magbear_cli.simulation.scenario import StepScenario

Floats = NDArray[np.float64]
Derivative = Callable[[float, Floats], Floats]

AT_MAGNETS, AT_SENSOR, MEASURED, SPEED, COMMAND, MODEL, MODEL_SPEED = range(7)  # the outputs
COEFFICIENTS = 3  # C0, C1 over the position, C1 over the speed


@dataclass(frozen=True, eq=False)
class AdaptiveLoop:
    """x' = A x + b f + command·step, outputs C x, with the law and the magnets that close it.

    Shapes: a (n, n), b (n,), command (n,), c (7, n), feed (7,): what of the step reaches the outputs at once. The first
    ``driven`` states are moved by the force alone, the others by the step alone.
    """

    a: Floats
    b: Floats
    command: Floats
    c: Floats
    feed: Floats
    driven: int
    law: AdaptiveLaw
    magnets: Magnets

    @property
    def scenario(self) -> StepScenario:
        """What is done to the loop."""
        return self.magnets.scenario

    @property
    def order(self) -> int:
        """The number of states, coefficients of the estimate aside."""
        return self.b.size

    def outputs(self, states: Floats) -> Floats:
        """The seven outputs of states (n + 3, k): (7, k)."""
        step = self.scenario.step_m * self.feed[:, None]
        return np.asarray(self.c @ states[: self.order] + step, dtype=float)

    def demand_a(self, states: Floats, centre: tuple[float, float]) -> Floats:
        """The demanded deviation of the current, of states (n + 3, k): (k,)."""
        out, law = self.outputs(states), self.law
        c0, cz, cv = states[self.order :]
        return np.asarray(
            law.feedforward_a_per_m * out[COMMAND]
            - law.gain_position_a_per_m * out[MEASURED]
            - law.gain_speed_a_s_per_m * out[SPEED]
            - c0
            - cz * (out[MEASURED] - centre[0])
            - cv * (out[SPEED] - centre[1]),
            dtype=float,
        )

    def error_norm(self, states: Floats) -> Floats:
        """‖e‖ as the trigger takes it, of states (n + 3, k): (k,)."""
        out = self.outputs(states)
        position = out[MODEL] - out[MEASURED]
        if self.law.trigger is Trigger.POSITION:
            return np.asarray(np.abs(position), dtype=float)
        return np.asarray(np.hypot(position, out[MODEL_SPEED] - out[SPEED]), dtype=float)

    @property
    def learning(self) -> tuple[float, float]:
        """−γ b bᵀP: from the errors of position and speed to the rate of the estimate's constant while it adapts."""
        from_position, from_speed = (-self.law.adaptation_gain * self.law.lyapunov[1]).tolist()
        return from_position, from_speed

    @cached_property
    def net_force(self) -> Callable[[float, float], float]:
        """The net force without the pulse, in N, over deviations of position and demand; infinite outside the gap."""
        magnets, scenario = self.magnets, self.scenario
        standing, load = magnets.standing_current_a, magnets.held_load_n + magnets.weight_n
        limit = np.inf if scenario.current_limit_a is None else scenario.current_limit_a
        if magnets.is_linear:
            (k_z, k_i), weight, at = magnets.slopes, magnets.weight_n, scenario.current_a

            def linear(position_m: float, demand_a: float) -> float:
                current = min(limit, max(-limit, standing + demand_a))
                return k_z * position_m + k_i * (current - at) - weight

            return linear
        pull, place = force_in_floats(magnets.bearing), scenario.position_m

        def exact(position_m: float, demand_a: float) -> float:
            return pull(place + position_m, min(limit, max(-limit, standing + demand_a))) - load

        return exact

    def derivative(self, *, pulse_n: float, centre: tuple[float, float], adapting: bool) -> Derivative:
        """d/dt of (x, C0, C1) over (t, states), for one state of the switch and of the pulse."""
        law, n, force = self.law, self.order, self.net_force
        step = self.scenario.step_m
        stacked = np.vstack([self.a, self.c])
        constant = np.concatenate([self.command, self.feed]) * step
        b, (z_i, v_i) = self.b, centre
        k_z, k_v, feedforward = law.gain_position_a_per_m, law.gain_speed_a_s_per_m, law.feedforward_a_per_m
        from_position, from_speed = self.learning if adapting else (0.0, 0.0)
        slopes = 1.0 if law.taylor_order else 0.0

        def rates(_: float, states: Floats) -> Floats:
            flow = stacked @ states[:n] + constant
            at_magnets, _at_sensor, y, v, r, y_m, v_m = flow[n:].tolist()
            c0, c_z, c_v = states[n:].tolist()
            away, faster = y - z_i, v - v_i
            demand = feedforward * r - k_z * y - k_v * v - c0 - c_z * away - c_v * faster
            answer = np.empty(n + COEFFICIENTS)
            answer[:n] = flow[:n] + b * (force(at_magnets, demand) + pulse_n)
            learned = from_position * (y_m - y) + from_speed * (v_m - v)
            answer[n:] = (learned, slopes * learned * away, slopes * learned * faster)
            return answer

        return rates

    def distance_to_inner(self, state: Floats) -> float:
        """‖e‖ − (rho − sigma) of one state: the adaptation ends where it passes zero downwards."""
        return self._norm(state) - self.law.inner_m

    def distance_to_outer(self, state: Floats) -> float:
        """‖e‖ − (rho + sigma) of one state: the adaptation begins where it passes zero upwards."""
        return self._norm(state) - self.law.outer_m

    def _norm(self, state: Floats) -> float:
        out = self.c @ state[: self.order] + self.scenario.step_m * self.feed
        position = float(out[MODEL] - out[MEASURED])
        if self.law.trigger is Trigger.POSITION:
            return abs(position)
        return hypot(position, float(out[MODEL_SPEED] - out[SPEED]))


def close_adaptive_loop(bearing: Bearing, law: AdaptiveLaw, scenario: StepScenario) -> AdaptiveLoop:
    """The loop of an adaptive law around a bearing.

    Raises
    ------
    NumericsError
        when the operating point is not inside the gap or the standing current is beyond the limit.
    """
    magnets = Magnets(bearing, scenario)
    limit, standing = scenario.current_limit_a, magnets.standing_current_a
    if limit is not None and abs(standing) > limit:
        raise NumericsError(f"the weight needs {standing:.4g} A, beyond the current limit of {limit:.4g} A")
    one = StateSpace.gain([[1.0]])
    rotor = _in_metres(rotor_dynamics(scenario.mass_kg, scenario.rotor), law.omega_rad_s)
    sensor = one if scenario.sensor is None else scenario.sensor.state_space()
    both = StateSpace.gain([[1.0, 0.0], [0.0, 1.0], [0.0, 1.0]])  # at the magnets, at the sensor, and into the sensor
    felt = series(series(rotor, both), append(StateSpace.gain(np.eye(2)), sensor))
    prefilter = one if scenario.prefilter is None else scenario.prefilter.state_space()
    twice = StateSpace.gain([[1.0], [1.0]])
    wanted = series(series(prefilter, twice), append(one, Prefilter(law.omega_rad_s, law.zeta).state_space()))
    system = append(felt, wanted)  # inputs: force, step; outputs: at magnets, at sensor, y, r, y_m
    speed = system.c @ system.a  # of y and of y_m, neither of which feels force or step at once
    c = np.vstack([system.c[:3], speed[2], system.c[3:], speed[4]])
    feed = np.concatenate([system.d[:3, 1], [0.0], system.d[3:, 1], [0.0]])
    return AdaptiveLoop(system.a, system.b[:, 0], system.b[:, 1], c, feed, felt.order, law, magnets)


def _in_metres(rotor: StateSpace, omega_rad_s: float) -> StateSpace:
    """The rotor with its speeds divided by a frequency."""
    scale = np.ones(rotor.order)
    scale[1::2] = omega_rad_s
    return StateSpace(
        rotor.a * scale[None, :] / scale[:, None], rotor.b / scale[:, None], rotor.c * scale[None, :], rotor.d
    )

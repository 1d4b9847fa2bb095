"""The closed loop as a linear system and one scalar function of two of its outputs: the net force on the rotor.

Everything but the magnets is linear: prefilter, rotor, sensor and controller make one system

    x' = A x + B f,   (z_magnets, z_sensor, command, demand) = C x,

and f = force(z_magnets, demand) closes it: the amplifier's limit, the magnets and the load. The last state is constant
and holds the height of the step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.lti.balancing import with_balanced_states
from magbear_cli.lti.connection import append, series
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.bearing import Bearing, balancing_current, force_and_slopes, linearization
from magbear_cli.model.rotor import rotor_dynamics
from magbear_cli.simulation.scenario import StepScenario

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

MAGNETS, SENSOR, COMMAND, DEMAND = range(4)  # the outputs


@dataclass(frozen=True)
class Magnets:
    """The net force on the rotor, without the pulse, over the deviations of position and current demand."""

    bearing: Bearing
    scenario: StepScenario

    @cached_property
    def weight_n(self) -> float:
        """The rotor's weight."""
        return self.scenario.mass_kg * self.scenario.gravity_m_per_s2

    @cached_property
    def slopes(self) -> tuple[float, float]:
        """k_z and k_i at the operating point."""
        linear = linearization(self.bearing, self.scenario.position_m, self.scenario.current_a)
        return linear.negative_stiffness_n_per_m, linear.current_stiffness_n_per_a

    @cached_property
    def is_linear(self) -> bool:
        """Whether the force law is replaced by its slopes."""
        return self.scenario.model == "linear"

    @cached_property
    def held_load_n(self) -> float:
        """The load from outside that holds the rotor at the operating point."""
        return linearization(self.bearing, self.scenario.position_m, self.scenario.current_a).force_n

    @cached_property
    def standing_current_a(self) -> float:
        """The control current at rest: that of the operating point, and what balances gravity if that is asked for."""
        current = self.scenario.current_a
        if not self.scenario.gravity_compensation or self.weight_n == 0.0:
            return current
        if self.is_linear:
            return current + self.weight_n / self.slopes[1]
        return balancing_current(self.bearing, self.held_load_n + self.weight_n, self.scenario.position_m)

    @property
    def gap_m(self) -> tuple[float, float]:
        """The deviations at which the rotor touches the stator, below and above."""
        return -self.bearing.air_gap_m - self.scenario.position_m, self.bearing.air_gap_m - self.scenario.position_m

    @cached_property
    def load_n(self) -> float:
        """What the force of the magnets is diminished by: the weight, and in the exact law what held the rotor."""
        return self.weight_n if self.is_linear else self.held_load_n + self.weight_n

    def current(self, demand_a: Floats) -> Floats:
        """The control current that the amplifier gives for a demanded deviation."""
        limit = self.scenario.current_limit_a
        current = self.standing_current_a + demand_a
        return current if limit is None else np.clip(current, -limit, limit)

    def force(self, position_m: Floats, demand_a: Floats) -> tuple[Floats, Floats, Floats]:
        """The net force in N, and its slopes to position and demand; zero slope to a demand beyond the limit."""
        return self.force_between(position_m, self.standing_current_a + demand_a, self.load_n)

    def force_between(
        self, position_m: Floats, wanted_a: Floats, load_n: float | Floats
    ) -> tuple[Floats, Floats, Floats]:
        """The same with the wanted current itself, before the limit, and for another load: arrays that broadcast."""
        limit = self.scenario.current_limit_a
        current = wanted_a if limit is None else np.clip(wanted_a, -limit, limit)
        if self.is_linear:
            k_z, k_i = self.slopes
            force = k_z * position_m + k_i * (current - self.scenario.current_a) - load_n
            stiffness, gain = np.full_like(force, k_z), np.full_like(force, k_i)
        else:
            force, stiffness, gain = force_and_slopes(self.bearing, self.scenario.position_m + position_m, current)
            force = force - load_n
        if limit is not None:
            gain = np.where(np.abs(wanted_a) <= limit, gain, 0.0)
        return force, stiffness, gain


@dataclass(frozen=True, eq=False)
class Loop:
    """x' = A x + B f, outputs C x, f = magnets.force(outputs) + pulse; ``start`` is the state at t = 0.

    Shapes: a (n, n), b (n,), c (4, n), start (n,). States are scaled to comparable size.
    """

    a: Floats
    b: Floats
    c: Floats
    start: Floats
    magnets: Magnets

    @property
    def scenario(self) -> StepScenario:
        """What is done to the loop."""
        return self.magnets.scenario


@dataclass(frozen=True, eq=False)
class Fleet:
    """Loops with one linear part and one force law, marched through time together.

    They may differ in the rotor's mass, which divides b, in the weight, and in the start.

    Parameters
    ----------
    loops : at least one

    Raises
    ------
    NumericsError
        when their linear parts, bearings or scenarios differ otherwise.
    """

    loops: tuple[Loop, ...]

    def __post_init__(self) -> None:
        """Refuse loops that do not belong together."""
        first = self.loops[0]
        for loop in self.loops[1:]:
            same = replace(loop.scenario, mass_kg=first.scenario.mass_kg) == first.scenario
            alike = np.array_equal(loop.a, first.a) and np.array_equal(loop.c, first.c)
            if not (same and alike and loop.magnets.bearing == first.magnets.bearing and first.scenario.rotor is None):
                raise NumericsError("only loops that differ in a rigid rotor's mass are simulated together")

    @property
    def one(self) -> Loop:
        """A loop whose linear part and force law are those of all."""
        return self.loops[0]

    @cached_property
    def shares(self) -> Floats:
        """The factors (k,) of b."""
        return np.array([self._share(loop) for loop in self.loops])

    @cached_property
    def standing_current_a(self) -> Floats:
        """The control currents at rest, (k,)."""
        return np.array([loop.magnets.standing_current_a for loop in self.loops])

    @cached_property
    def load_n(self) -> Floats:
        """The loads, (k,)."""
        return np.array([loop.magnets.load_n for loop in self.loops])

    def force(self, rows: Indices, position_m: Floats, demand_a: Floats) -> tuple[Floats, Floats, Floats]:
        """Net forces and their slopes of some of the loops, arrays (rows, points)."""
        wanted = self.standing_current_a[rows, None] + demand_a
        return self.one.magnets.force_between(position_m, wanted, self.load_n[rows, None])

    def _share(self, loop: Loop) -> float:
        return self.loops[0].scenario.mass_kg / loop.scenario.mass_kg


def close_loop(bearing: Bearing, controller: StateSpace, scenario: StepScenario) -> Loop:
    """The loop of a controller around a bearing: the demand is K (measured position − filtered command).

    Raises
    ------
    NumericsError
        when the controller does not have one input and one output, the operating point is not inside the gap, the
        standing current is beyond the limit, or the controller's numbers are too large for the loop.
    """
    if (controller.inputs, controller.outputs) != (1, 1):
        raise NumericsError(
            f"a controller has one input and one output, not {controller.inputs} and {controller.outputs}"
        )
    magnets = Magnets(bearing, scenario)
    limit, standing = scenario.current_limit_a, magnets.standing_current_a
    if limit is not None and abs(standing) > limit:
        raise NumericsError(f"the weight needs {standing:.4g} A, beyond the current limit of {limit:.4g} A")
    height = abs(scenario.step_m) or 1.0
    with np.errstate(over="ignore", invalid="ignore"):
        # A rigid rotor's mass has no say in the states' units, so that loops of several masses share all but b.
        mass = 1.0 if scenario.rotor is not None else scenario.mass_kg
        parts = scenario if scenario.rotor is not None else replace(scenario, mass_kg=1.0)
        system = with_balanced_states(_linear_parts(controller, parts))
        order = system.order
        a, c = np.zeros((order + 1, order + 1)), np.zeros((4, order + 1))
        # The constant state is one for a step of any height, so that a nanometre is not lost beside it.
        a[:order] = np.hstack([system.a, system.b[:, :1] * height])
        c[:] = np.hstack([system.c, system.d[:, :1] * height])
    if not (np.isfinite(a).all() and np.isfinite(c).all()):
        raise NumericsError("the loop of this controller and this bearing has numbers beyond double precision")
    b = np.append(system.b[:, 1] / mass, 0.0)
    start = np.append(np.zeros(order), scenario.step_m / height)
    return Loop(a, b, c, start, magnets)


def _linear_parts(controller: StateSpace, scenario: StepScenario) -> StateSpace:
    """From (command, net force at the magnets) to (z_magnets, z_sensor, filtered command, demand)."""
    one = StateSpace.gain([[1.0]])
    prefilter = one if scenario.prefilter is None else scenario.prefilter.state_space()
    sensor = one if scenario.sensor is None else scenario.sensor.state_space()
    ahead = append(prefilter, rotor_dynamics(scenario.mass_kg, scenario.rotor))  # command, z_magnets, z_sensor
    fan_out = StateSpace.gain([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    measured = series(series(ahead, fan_out), append(StateSpace.gain(np.eye(3)), sensor))
    compare = StateSpace.gain([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, -1.0, 1.0]])
    return series(series(measured, compare), append(StateSpace.gain(np.eye(3)), controller))

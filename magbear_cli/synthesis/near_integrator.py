"""A performance weight with a pole that stands for an integrator: designed with a faster one, and handed its own back.

Far below every other corner of the problem the loop gain is large and S is nearly 1/(K G). There a controller
K = K_rest + r/(s + p) and a weight w/(s + ε) give W1 S a value that only the ratio of p to ε decides. So the problem is
designed with ε raised to a floor where a design is well conditioned, and then the slow poles of the controller are
moved down by as much as ε was raised. What the controller reaches is recomputed with the weight that was asked for.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem, RationalWeight

_FLOOR = 1e-5  # of the slowest other corner: slower poles of W1 are raised to this
_SLOW = 1e3  # times the floor: which poles of a controller go with it


@dataclass(frozen=True)
class RaisedPoles:
    """The problem with the slowest poles of W1 raised, and how to hand its controllers back."""

    problem: ControlProblem
    floor_rad_s: float
    factor: float  # the slowest pole asked for over the floor

    def lowered(self, controller: StateSpace) -> StateSpace:
        """The controller with its slow poles moved down by the factor; as it is where it has none."""
        return controller if self.factor == 1.0 else with_slow_poles(controller, _SLOW * self.floor_rad_s, self.factor)


def raise_slow_poles(problem: ControlProblem) -> RaisedPoles:
    """The problem to design for: its own where no pole of W1 is far below every other corner."""
    weight = problem.performance
    poles = weight.poles_rad_s
    zeros = np.abs(np.roots(weight.num))
    limit = [] if problem.omega_c_rad_s is None else [problem.omega_c_rad_s]
    marks = np.array([problem.natural_rad_s, *zeros[zeros > 0], *limit])
    slowest = float(marks.min())
    floor = _FLOOR * slowest
    raised = (poles.imag == 0) & (poles.real < 0) & (-poles.real < floor)
    if not raised.any():
        return RaisedPoles(problem, floor, 1.0)
    factor = float(-poles.real[raised].max()) / floor
    den = np.poly(np.where(raised, -floor, poles)).real * weight.den[0]
    own = replace(problem, performance=RationalWeight(weight.num, tuple(float(value) for value in den)))
    return RaisedPoles(own, floor, factor)


def with_slow_poles(system: StateSpace, below_rad_s: float, factor: float) -> StateSpace:
    """The system with every pole slower than a bound multiplied by a factor, in a block of states of its own.

    The residues stay: 1/(s + p) becomes 1/(s + factor·p).
    """
    a, z, count = linalg.schur(system.a, output="real", sort=lambda x, y=0.0: np.hypot(x, y) < below_rad_s)
    if not count:
        return system
    b, c = z.T @ system.b, system.c @ z
    slow, fast = a[:count, :count], a[count:, count:]
    mixed = linalg.solve_sylvester(slow, -fast, -a[:count, count:]) if fast.size else np.zeros((count, 0))
    left = np.vstack([b[:count] - mixed @ b[count:], b[count:]])
    right = np.hstack([c[:, :count], c[:, :count] @ mixed + c[:, count:]])
    return StateSpace(linalg.block_diag(factor * slow, fast), left, right, system.d)

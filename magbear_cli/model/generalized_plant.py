"""The plant a synthesis method sees: uncertainty, disturbances and control in; force, errors and measurement out.

About the nominal plant, with a = k_z/m and b = k_i/m and half their changes Δa and Δb along the family, the rotor is
z'' = a z + b u + Δ w with w = δ q, δ in [−1, 1], and the force q = (Δa z + Δb u)/Δ. For a range of the mass Δ is that
of 1/m and q = k_z z + k_i u (the thesis, eqs. 2.16-2.21). The measurement is y = z + d.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.lti.connection import lower_lft
from magbear_cli.lti.conversion import from_transfer_function
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem

Form = Literal["mended", "as_printed"]


@dataclass(frozen=True)
class GeneralizedPlant:
    """A system whose channels have names; controls are its last inputs and measurements its last outputs."""

    system: StateSpace
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    controls: int = 1
    measurements: int = 1

    def __post_init__(self) -> None:
        """Refuse a plant with channels that have no name."""
        if (len(self.inputs), len(self.outputs)) != (self.system.inputs, self.system.outputs):
            raise NumericsError("every channel of a generalised plant needs a name")

    def closed_by(self, controller: StateSpace) -> StateSpace:
        """The loop closed with u = K y, from the remaining inputs to the remaining outputs."""
        return lower_lft(self.system, controller)


def build_generalized_plant(problem: ControlProblem, form: Form = "mended") -> GeneralizedPlant:
    """The plant for robust performance over the mass range, with one disturbance for each weighted error.

    Inputs: ``mass_uncertainty`` (w, in N), ``disturbance_w1``, ``disturbance_w3`` (m), ``control`` (A). Outputs:
    ``force`` (q, in N), ``weighted_sensitivity`` (W1 y), ``weighted_complementary`` (W3 z), ``measurement`` (m).
    A known plant has no first channel, a problem without bandwidth limit no third. States: z, z', those of W1.

    Parameters
    ----------
    problem : ControlProblem
    form : ``mended``, or ``as_printed`` for the third output as the thesis programs it in its appendices A.2 and A.5

    Notes
    -----
    W3 = s²/ω_c² is improper, but W3 z = z''/ω_c² is an output of the rotor:
    [k_z/m_n, 0] x/ω_c² + k_i/(m_n ω_c²) u + Δ/ω_c² w. The programs of A.2 and A.5 have −k_z k_i/m_n² in place of
    k_z/m_n and leave out the last term.
    """
    uncertain, limited = not problem.family.is_fixed, problem.omega_c_rad_s is not None
    w1 = from_transfer_function(problem.performance.num, problem.performance.den)
    a, b, force, acceleration = _rotor(problem)
    n = w1.order
    whole = StateSpace(
        np.block([[a, np.zeros((2, n))], [w1.b @ _POSITION, w1.a]]),
        np.vstack([b, w1.b @ _DISTURBED]),
        np.vstack(
            [
                np.hstack([force[:, :2], np.zeros((1, n))]),
                np.hstack([w1.d @ _POSITION, w1.c]),
                np.hstack([_weighted_position(problem, acceleration, form)[:, :2], np.zeros((1, n))]),
                np.hstack([_POSITION, np.zeros((1, n))]),
            ]
        ),
        np.vstack(
            [force[:, 2:], w1.d @ _DISTURBED, _weighted_position(problem, acceleration, form)[:, 2:], _DISTURBED]
        ),
    )
    keep = [index for index, wanted in enumerate((uncertain, True, limited, True)) if wanted]
    return GeneralizedPlant(
        StateSpace(whole.a, whole.b[:, keep], whole.c[keep], whole.d[np.ix_(keep, keep)]),
        tuple(_INPUTS[index] for index in keep),
        tuple(_OUTPUTS[index] for index in keep),
    )


def build_mixed_sensitivity_plant(problem: ControlProblem, form: Form = "mended") -> GeneralizedPlant:
    """The plant of the nominal rotor with one disturbance: its closed loop is [W1 S; −W3 T].

    Its H-infinity norm is the maximum of (|W1 S|² + |W3 T|²)^½, the thesis's eq. 2.14.
    """
    full = build_generalized_plant(problem, form)
    rows = [index for index, name in enumerate(full.outputs) if name != "force"]
    columns = [full.inputs.index("disturbance_w1"), full.inputs.index("control")]
    system = full.system
    return GeneralizedPlant(
        StateSpace(system.a, system.b[:, columns], system.c[rows], system.d[np.ix_(rows, columns)]),
        ("disturbance", "control"),
        tuple(full.outputs[index] for index in rows),
    )


_INPUTS = ("mass_uncertainty", "disturbance_w1", "disturbance_w3", "control")
_OUTPUTS = ("force", "weighted_sensitivity", "weighted_complementary", "measurement")
_POSITION = np.array([[1.0, 0.0]])
_DISTURBED = np.array([[0.0, 1.0, 1.0, 0.0]])

Row = NDArray[np.float64]


def uncertainty_unit(problem: ControlProblem) -> float:
    """Δ in 1/kg: the channel's force q, in N, makes the acceleration Δ δ q; of a range of the mass half that of 1/m."""
    spread_a, spread_b = problem.family.spread
    nominal = problem.nominal
    shares = spread_a / nominal.negative_stiffness_n_per_m, spread_b / nominal.current_stiffness_n_per_a
    return max(shares, key=abs)


def _rotor(problem: ControlProblem) -> tuple[Row, Row, Row, Row]:
    """A and B of the rotor, and the rows of force and acceleration over (z, z', the four inputs)."""
    nominal, unit = problem.nominal, uncertainty_unit(problem)
    a, b = nominal.pole_squared, nominal.acceleration_per_current
    force = np.zeros((1, 6))
    if unit:
        force[0, [0, 5]] = np.array(problem.family.spread) / unit
    acceleration = np.array([[a, 0.0, unit, 0.0, 0.0, b]])
    both = np.vstack([[[0.0, 1.0, 0.0, 0.0, 0.0, 0.0]], acceleration])
    return both[:, :2], both[:, 2:], force, acceleration


def _weighted_position(problem: ControlProblem, acceleration: Row, form: Form) -> Row:
    """The row of W3 z = z''/ω_c², or what the thesis's programs have in its place; zero without a limit."""
    if problem.omega_c_rad_s is None:
        return np.zeros_like(acceleration)
    row = acceleration.copy()
    if form == "as_printed":
        row[0, 0] *= -problem.nominal.acceleration_per_current
        row[0, 2] = 0.0
    return row / problem.omega_c_rad_s**2

"""The frequency response of a controller of 33 states at 2 000 points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace
from tests.benchmarks.measuring import Goal, Prepared, Row, Side
from tests.benchmarks.problem import controller_of_33_states

OURS, CONTROL = "magbear", "python-control"
JUDGED = 16  # points computed in 50 digits


def _prepare(tiny: bool) -> Prepared:  # noqa: FBT001 - the row's switch
    import control

    system = controller_of_33_states()
    omega = np.geomspace(1.0, 1e6, 300 if tiny else 2000)
    peer = control.ss(system.a, system.b, system.c, system.d)
    judged = np.linspace(0, omega.size - 1, 3 if tiny else JUDGED).astype(int)
    exact = exact_response(system, omega[judged])

    def error(response: NDArray[np.complex128]) -> dict[str, float]:
        return {"largest relative error, in 50 digits": float(np.abs(response[judged] / exact - 1.0).max())}

    def errors(answers: Mapping[str, Any]) -> Mapping[str, Mapping[str, float]]:
        return {OURS: error(answers[OURS][:, 0, 0]), CONTROL: error(np.asarray(answers[CONTROL]).reshape(-1))}

    def floor(seconds: Mapping[str, float]) -> str:
        terms = system.order * omega.size
        return (
            f"{terms} terms of some 15 real flops are {1e3 * terms * 15 / 2e9:.2g} ms at 2 Gflop/s, the eigenvectors "
            f"0.2 ms and their refinement 0.6 ms; we take {1e3 * seconds[OURS]:.2g} ms"
        )

    sides = [Side(OURS, lambda: frequency_response(system, omega)), Side(CONTROL, lambda: peer(1j * omega))]
    return Prepared(sides, errors, floor)


def exact_response(system: StateSpace, omega: NDArray[np.float64]) -> NDArray[np.complex128]:
    """C (jω I − A)⁻¹ B + D in 50 digits, rounded, (w,)."""
    with mpmath.workdps(50):
        a, b, c = (mpmath.matrix(matrix.tolist()) for matrix in (system.a, system.b, system.c))
        identity = mpmath.eye(system.order)
        values = [(c * mpmath.lu_solve(mpmath.mpc(0, point) * identity - a, b))[0] for point in omega.tolist()]
        return np.array([complex(value + mpmath.mpf(system.d[0, 0])) for value in values])


ROW = Row(
    "response",
    "frequency response of a 33-state controller at 2 000 points",
    [Goal(OURS, CONTROL, 10.0)],
    _prepare,
    needs=("control",),
    missed_because={
        CONTROL: "refining the eigenvectors, without which digits are lost, costs as much as all the terms"
    },
)

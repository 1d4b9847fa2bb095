"""The optimum over all controllers at 3.0-4.5 kg and 20 000 rad/s with its dual bound, beside D-K iteration on SLICOT.

The peer is the loop that SLICOT's routines make by themselves: SB10AD for the controller, SB10MD for mu and its D
fitted, both by ctrlsys, on the plant in good units with the uncertainty channel scaled by hand. It knows complex blocks
only, stops at the D-K iteration's local optimum, and proves nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.lti.balancing import with_balanced_states
from magbear_cli.lti.connection import inverse, lower_lft, series
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.study.pipeline import run_case
from magbear_cli.synthesis.gamma_search import controller_in_si
from tests.benchmarks.measuring import Goal, Prepared, Row, Side
from tests.benchmarks.problem import case_of
from tests.benchmarks.rows.robust_controller import dkpys_plant, judged

OURS, PEER = "mu_convex", "D-K by ctrlsys"
ITERATIONS, POINTS, D_ORDER = 5, 100, 3
FIRST_GAMMA, GAMMA_TOLERANCE, FIT_TOLERANCE = 10.0, 1e-3, 1.0


def _prepare(tiny: bool) -> Prepared:  # noqa: FBT001 - the row's switch
    case = case_of({"method": "mu_convex"})
    sides = [Side(OURS, lambda: run_case(case, "benchmark", 0))]
    if not tiny:
        sides.append(Side(PEER, slicots_controller))

    def errors(answers: Mapping[str, Any]) -> Mapping[str, Mapping[str, float]]:
        found = answers[OURS].summary
        ours = {
            "worst case": found.worst_case,
            "no controller reaches": found.lower_bound,
            "proven": float(found.verified),
        }
        return {OURS: ours} | ({PEER: judged(*answers[PEER])} if PEER in answers else {})

    def floor(seconds: Mapping[str, float]) -> str:
        return (
            "ten cone programs of 15 ms for the optimum, twenty smaller for the fewest states, four of 50 ms for the "
            "certificate, and 0.35 s for both proofs in interval arithmetic, more than the peer takes in all; we take "
            f"{seconds[OURS]:.2g} s"
        )

    return Prepared(sides, errors, floor)


def slicots_controller() -> tuple[StateSpace, float]:
    """The controller in SI units with the least mu that SB10MD tells of, and that mu."""
    matrices, unit_rad_s, unit_a = dkpys_plant()
    plant = StateSpace.of(matrices.A, matrices.B, matrices.C, matrices.D)
    omega = np.geomspace(10.0, 1e6, POINTS) / unit_rad_s
    scaled, best, least = plant, None, np.inf
    for _ in range(ITERATIONS):
        controller = _k_step(scaled)
        try:
            level, scaled = _d_step(plant, controller, omega)
        except NumericsError:  # SB10MD cannot fit the scalings of the last steps
            break
        if level < least:
            best, least = controller, level
    if best is None:
        raise NumericsError("SLICOT found no controller")
    return controller_in_si(best, unit_rad_s, unit_a), least


def _k_step(plant: StateSpace) -> StateSpace:
    """The H-infinity controller of least norm, by SB10AD."""
    import ctrlsys

    a, b, c, d = (np.asarray(matrix, order="F") for matrix in (plant.a, plant.b, plant.c, plant.d))
    sizes = plant.order, plant.inputs, plant.outputs
    *found, info = ctrlsys.sb10ad(1, *sizes, 1, 1, a, b, c, d, FIRST_GAMMA, GAMMA_TOLERANCE, 0.0)
    if info != 0:
        raise NumericsError(f"SB10AD ended with info = {info}")
    return StateSpace.of(*found[:4])


def _d_step(plant: StateSpace, controller: StateSpace, omega: NDArray[np.float64]) -> tuple[float, StateSpace]:
    """The peak of mu over the grid and the plant between the scalings that SB10MD fits to it."""
    import ctrlsys

    loop = lower_lft(plant, controller)
    a, b, c, d = (np.asfortranarray(matrix) for matrix in (loop.a, loop.b, loop.c, loop.d))
    blocks = loop.outputs
    sizes, kinds = np.ones(blocks, dtype=np.int32), np.full(blocks, 2, dtype=np.int32)
    *_, ad, bd, cd, dd, mu, info = ctrlsys.sb10md(
        loop.order, blocks, omega.size, 1, D_ORDER, blocks, sizes, kinds, FIT_TOLERANCE, a, b, c, d, omega.copy()
    )
    if info != 0:
        raise NumericsError(f"SB10MD ended with info = {info}")
    scaling = StateSpace.of(ad, bd, cd, dd)
    return float(np.max(mu)), with_balanced_states(series(series(inverse(scaling), plant), scaling))


ROW = Row(
    "exact_optimum",
    "the optimum over all controllers with its dual bound, 3.0-4.5 kg, 20 000 rad/s",
    [Goal(OURS, PEER, 1.0)],
    _prepare,
    needs=("ctrlsys",),
    missed_because={
        PEER: "on a plant scaled by hand SLICOT needs five Riccati equations and fits; it answers another question, "
        "complex blocks and a local optimum without proof, where ours solves 34 cone programs and proves both sides"
    },
)

"""The upper bound of mu and its D-scales for three scalar blocks at 1 000 frequencies, tight to 1e-6."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from magbear_cli.kernels.structured_singular_value import mu_lower_bound, mu_upper_bound
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.model.robust_performance import interconnection
from tests.benchmarks.measuring import Goal, Prepared, Row, Side
from tests.benchmarks.problem import control_problem, controller_of_33_states

Complexes = NDArray[np.complex128]

OURS, SLYCOT, DKPY = "magbear", "slycot.ab13md", "dkpy"
DKPY_POINTS = 10  # of the thousand: it takes seconds for each
JUDGED = 12  # frequencies at which the answers are looked at in 30 digits


def loop_matrices(count: int) -> Complexes:
    """M(jω) of the loop with the controller of 33 states, (count, 3, 3)."""
    omega = np.geomspace(1.0, 1e6, count)
    response = frequency_response(controller_of_33_states(), omega)[:, 0, 0]
    return interconnection(control_problem(), response, omega)


def prescaled(matrices: Complexes) -> Complexes:
    """The matrices with rows and columns balanced: ab13md is loose and dkpy wrong without."""
    _, d = mu_upper_bound(matrices)
    rough = np.exp(np.round(np.log(d)))  # to a factor of e: a start, not the answer
    return np.asarray(rough[:, :, None] * matrices / rough[:, None, :])


def _prepare(tiny: bool) -> Prepared:  # noqa: FBT001 - the row's switch
    count = 20 if tiny else 1000
    matrices = loop_matrices(count)
    scaled = prescaled(matrices)
    some = np.linspace(0, count - 1, 2 if tiny else DKPY_POINTS).astype(int)

    def by_slycot() -> NDArray[np.float64]:
        import slycot

        ones, complex_blocks = np.ones(3, dtype=int), np.full(3, 2)
        return np.array([slycot.ab13md(one, ones, complex_blocks)[0] for one in scaled])

    def by_dkpy() -> NDArray[np.float64]:
        from dkpy import ComplexFullBlock, SsvLmiBisection

        blocks = [ComplexFullBlock(1, 1)] * 3
        solver = SsvLmiBisection(n_jobs=1, bisection_atol=1e-7, bisection_rtol=1e-6)
        return np.asarray(solver.compute_ssv(scaled[some].transpose(1, 2, 0), blocks)[0], dtype=float)

    sides = [Side(OURS, lambda: mu_upper_bound(matrices)), Side(SLYCOT, by_slycot)]
    if not tiny:
        sides.append(Side(DKPY, by_dkpy, amount=some.size / count))

    def errors(answers: Mapping[str, Any]) -> Mapping[str, Mapping[str, float]]:
        upper, d = answers[OURS]
        _, delta = mu_lower_bound(matrices)
        judged = np.linspace(0, count - 1, JUDGED).astype(int)
        gaps = [_gap_in_30_digits(matrices[i], d[i], delta[i]) for i in judged]
        found = {OURS: {"upper over lower bound of mu - 1, in 30 digits": max(gaps)}}
        found[SLYCOT] = {"largest difference from ours": float(np.abs(answers[SLYCOT] / upper - 1.0).max())}
        if DKPY in answers:
            found[DKPY] = {"largest difference from ours": float(np.abs(answers[DKPY] / upper[some] - 1.0).max())}
        return found

    def floor(seconds: Mapping[str, float]) -> str:
        least = 1e3 * count * 6 * 250 / 2e9
        return (
            f"six Newton steps of some 250 flops a frequency are {least:.2g} ms at 2 Gflop/s, and the singular values "
            f"that confirm the answer 2 ms; we take {1e3 * seconds[OURS]:.2g} ms, the rest is numpy's own way to them"
        )

    return Prepared(sides, errors, floor)


def _gap_in_30_digits(matrix: Complexes, d: NDArray[np.float64], delta: Complexes) -> float:
    """How far σ(D M D⁻¹) is above ρ(M Δ): mu lies between."""
    with mpmath.workdps(30):
        m = mpmath.matrix(matrix.tolist())
        scaled = mpmath.diag(d.tolist()) * m * mpmath.inverse(mpmath.diag(d.tolist()))
        upper = max(mpmath.svd_c(scaled, compute_uv=False))
        unit = [mpmath.mpc(value) / abs(mpmath.mpc(value)) for value in delta.tolist()]
        eigenvalues, _ = mpmath.eig(m * mpmath.diag(unit))
        return float(upper / max(abs(value) for value in eigenvalues) - 1)


ROW = Row(
    "scalings",
    "mu upper bound and D-scales, 3 scalar blocks, 1 000 frequencies",
    [Goal(OURS, SLYCOT, 20.0), Goal(OURS, DKPY, 1000.0)],
    _prepare,
    needs=("slycot", "dkpy"),
)

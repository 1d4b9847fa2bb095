"""The thesis's limitation curve, five mass ranges to 1 %: both sides proven, beside a search with D-K iteration.

The peer is the thesis's own procedure, the iteration of ``mu_dk``: the smallest ω_c at which it reaches a peak mu of
one, by a secant in log ω_c until the bracket is 1 % wide. It knows no lower side. Sample k takes mass range k, so that
five samples are the curve once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import count
from typing import Any

from magbear_cli.model.problem import ControlProblem
from magbear_cli.study.building import build_problem
from magbear_cli.study.limits import bracket_limit
from magbear_cli.synthesis.mu_dk import design_mu_dk
from tests.benchmarks.measuring import Goal, Prepared, Row, Side
from tests.benchmarks.problem import case_of

OURS, PEER = "magbear limits", "the thesis's procedure by mu_dk"
RANGES_KG = ((3.0, 3.5), (3.0, 4.0), (3.0, 4.5), (3.0, 5.0), (2.2, 4.5))
WIDTH = 0.01


def _problems() -> list[ControlProblem]:
    inputs = case_of({"method": "lqg"})
    return [build_problem({**inputs, "mass_kg": list(masses)}) for masses in RANGES_KG]


def _prepare(tiny: bool) -> Prepared:  # noqa: FBT001 - the row's switch
    problems = _problems()
    turns = {OURS: count(), PEER: count()}
    found: dict[str, dict[int, tuple[float, float]]] = {OURS: {}, PEER: {}}

    def ours() -> None:
        at = next(turns[OURS]) % len(problems)
        bracket = bracket_limit(problems[at])
        found[OURS][at] = bracket.omega_c_infeasible_rad_s or 0.0, bracket.omega_c_feasible_rad_s or 0.0

    def peer() -> None:
        at = next(turns[PEER]) % len(problems)
        found[PEER][at] = frontier(problems[at])

    share = 1.0 / len(problems)
    sides = [Side(OURS, ours, share, warm_up=_nothing)]
    if not tiny:
        sides.append(Side(PEER, peer, share, warm_up=_nothing))

    def errors(_answers: Mapping[str, Any]) -> Mapping[str, Mapping[str, float]]:
        told: dict[str, dict[str, float]] = {}
        for name, of_ranges in found.items():
            told[name] = {}
            for at, (low, high) in sorted(of_ranges.items()):
                masses = "{}-{} kg".format(*RANGES_KG[at])
                told[name] |= {f"{masses} from": low, f"{masses} to": high}
        return told

    def floor(seconds: Mapping[str, float]) -> str:
        return (
            "a range takes three designs of three or four cone programs of 15 ms, a certificate of three of 50 ms, and "
            f"0.3 s for both proofs in interval arithmetic; we take {seconds[OURS] / len(problems):.2g} s a range"
        )

    return Prepared(sides, errors, floor)


def _nothing() -> None:
    """No warm-up: each turn is a mass range of its own."""


def frontier(problem: ControlProblem) -> tuple[float, float]:
    """The largest ω_c at which the iteration missed a peak mu of one, and the smallest at which it met it."""
    missed, met, omega_c = 0.0, 0.0, 7000.0
    while not (missed and met) or met / missed > 1.0 + WIDTH:
        level = design_mu_dk(replace(problem, omega_c_rad_s=omega_c)).level
        missed, met = (missed, omega_c) if level <= 1.0 else (omega_c, met)
        omega_c = (missed * met) ** 0.5 if missed and met else omega_c * (0.8 if met else 1.25)
    return missed, met


ROW = Row(
    "limits",
    "the limitation curve: 5 mass ranges, both sides, 1 %",
    [Goal(OURS, PEER, 10.0)],
    _prepare,
    missed_because={PEER: "ours proves both sides, which is most of its time; the peer only finds one"},
)

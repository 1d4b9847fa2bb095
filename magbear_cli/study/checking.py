"""The proofs of a stored case, checked again by the checkers alone: no method and no solver takes part."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any

from magbear_cli.analysis.gridless import prove_level
from magbear_cli.model.problem import ControlProblem
from magbear_cli.study.building import build_problem
from magbear_cli.study.outcome import CaseOutcome
from magbear_cli.study.proving import SPECIFIED, is_proof


@dataclass(frozen=True)
class ProofCheck:
    """One claim of a case, and whether its proof holds."""

    case_id: str
    claim: str
    holds: bool

    def __str__(self) -> str:
        """The claim in a line."""
        return f"{self.case_id} {'holds' if self.holds else 'FAILS'}: {self.claim}"

    def document(self) -> dict[str, Any]:
        """The claim as plain JSON."""
        return asdict(self)


def check_proofs(outcome: CaseOutcome) -> Iterator[ProofCheck]:
    """Every proof that a case claims, on the problem rebuilt from its inputs."""
    summary = outcome.summary
    if summary.verified:
        problem = _at(build_problem(outcome.inputs), summary.omega_c_feasible_rad_s)
        level = summary.worst_case_proven or float("nan")
        found = outcome.controller
        holds = level <= SPECIFIED and found is not None and prove_level(problem, found, level).proved
        yield ProofCheck(outcome.case_id, f"its worst case is below {level:.6g}{_where(problem)}", holds)
    if outcome.impossibility is not None:
        problem = _at(build_problem(outcome.inputs), summary.omega_c_infeasible_rad_s)
        claim = f"every linear controller's worst case is above {outcome.impossibility.level:.6g}{_where(problem)}"
        yield ProofCheck(outcome.case_id, claim, is_proof(problem, outcome.impossibility))


def _at(problem: ControlProblem, omega_c_rad_s: float | None) -> ControlProblem:
    return problem if omega_c_rad_s is None else replace(problem, omega_c_rad_s=omega_c_rad_s)


def _where(problem: ControlProblem) -> str:
    return "" if problem.omega_c_rad_s is None else f" at omega_c = {problem.omega_c_rad_s:.6g} rad/s"

"""From the claims and the studies to the ledger: each claim by its own function."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from magbear_cli.claims import adaptation, bandwidth, design_examples, elasticity, mass_range, nonlinearity
from magbear_cli.claims.evidence import Evidence, MissingEvidenceError
from magbear_cli.claims.ledger import Finding, JudgedClaim, Verdict
from magbear_cli.errors import InputError
from magbear_cli.spec.thesis import ClaimEntry
from magbear_cli.study.outcome import StudyResults

Judge = Callable[[Evidence], Finding]

ROOMS = (design_examples, mass_range, bandwidth, nonlinearity, adaptation, elasticity)


def judge_of(name: str) -> Judge:
    """The function of this name.

    Raises
    ------
    InputError
        when no such function is there.
    """
    for room in ROOMS:
        judges: Mapping[str, Judge] = room.JUDGES
        if name in judges:
            return judges[name]
    raise InputError(f"no judge is called '{name}'")


def studies_needed(claims: Iterable[ClaimEntry]) -> tuple[str, ...]:
    """The studies that these claims look at, each once."""
    return tuple(dict.fromkeys(str(where["study"]) for claim in claims for where in claim.cases.values()))


def judge_claims(claims: Iterable[ClaimEntry], studies: Mapping[str, StudyResults]) -> tuple[JudgedClaim, ...]:
    """Every claim with its finding, in their order; none is left out."""
    return tuple(_judged(claim, studies) for claim in claims)


def _judged(claim: ClaimEntry, studies: Mapping[str, StudyResults]) -> JudgedClaim:
    evidence = Evidence(studies, claim.cases, claim.figures, claim.tolerance)
    try:
        finding = judge_of(claim.judge)(evidence)
    except MissingEvidenceError as error:
        finding = Finding("–", Verdict.NOT_EVALUATED, str(error))
    return JudgedClaim(claim.id, claim.place, claim.claim, claim.printed, finding, tuple(evidence.read))

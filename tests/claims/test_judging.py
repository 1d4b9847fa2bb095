"""The ledger covers the thesis, its data fit the studies, and verdicts follow the numbers."""

from __future__ import annotations

from functools import cache

import pytest

from magbear_cli.claims.evidence import is_like
from magbear_cli.claims.judging import ROOMS, judge_claims, judge_of, studies_needed
from magbear_cli.claims.ledger import Finding, JudgedClaim, Listing, Verdict, tally
from magbear_cli.errors import InputError
from magbear_cli.spec import read_study
from magbear_cli.spec.thesis import ClaimEntry, read_claims, read_comparison, read_figures, thesis_study

CLAIMS = read_claims()


@cache
def planned(study: str) -> tuple[dict[str, object], ...]:
    """The inputs of all cases of a study."""
    return tuple(read_study(thesis_study(study)).cases())


def selected(where: dict[str, object]) -> list[dict[str, object]]:
    """The planned cases that a selection finds."""
    wanted = {key: value for key, value in where.items() if key != "study"}
    return [inputs for inputs in planned(str(where["study"])) if is_like(inputs, wanted)]


def test_all_thirty_claims_are_there() -> None:
    """C01 to C30, in order, none left out, and every judge that is there is used."""
    assert [claim.id for claim in CLAIMS] == [f"C{number:02d}" for number in range(1, 31)]
    used = {claim.judge for claim in CLAIMS}
    assert {name for room in ROOMS for name in room.JUDGES} == used


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.id)
def test_every_case_of_a_claim_is_planned(claim: ClaimEntry) -> None:
    """Each selection of a claim finds a case of its study, so that no claim goes without its evidence."""
    assert callable(judge_of(claim.judge))
    for name, where in claim.cases.items():
        assert selected(where), name


@pytest.mark.parametrize("figure", read_figures(), ids=lambda figure: figure.id)
def test_every_case_of_a_figure_is_planned_and_something_needs_it(figure: object) -> None:
    """What a figure shows is computed for the claims or the comparison, and its selections find it."""
    needed = set(studies_needed(CLAIMS)) | {str(where["study"]) for where in read_comparison()}
    for panel in figure.columns:  # type: ignore[attr-defined]
        for where in panel.cases:
            assert selected(where), where
            assert where["study"] in needed


def test_a_claim_without_evidence_is_not_evaluated() -> None:
    """Where nothing was computed nothing is said, for every claim."""
    judged = judge_claims(CLAIMS, {})
    assert {claim.finding.verdict for claim in judged} == {Verdict.NOT_EVALUATED}
    assert all(claim.finding.why for claim in judged)
    assert tally(judged) == "30 not evaluated"


def test_an_unknown_judge_is_named() -> None:
    """A slip in the data is a sentence."""
    with pytest.raises(InputError, match="no judge is called 'nobody'"):
        judge_of("nobody")


def test_a_row_of_the_ledger_has_the_promised_keys() -> None:
    """The keys of --json are a public interface."""
    finding = Finding("2", Verdict.CONFIRMED, "as printed", Listing(("m", "mu"), (("3", "0.5"),)))
    document = JudgedClaim("C01", "here", "it is", "2", finding, ("a/results.h5:/case_0001/status",)).document()
    assert list(document)[:7] == ["id", "place", "claim", "printed", "ours", "verdict", "why"]
    assert document["table"] == [{"m": "3", "mu": "0.5"}]
    with pytest.raises(ValueError, match="cells"):
        Listing(("m", "mu"), (("3",),))

"""A claim judged: what was printed, what comes out, the verdict and why, and the datasets it rests on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any


class Verdict(StrEnum):
    """What is to be said of a claim."""

    CONFIRMED = "confirmed"
    ERRATUM = "confirmed with erratum"  # it holds once a printed constant or formula is mended
    NOT_REPRODUCED = "not reproduced"
    SUPERSEDED = "superseded"  # it holds for the thesis's procedure and is no limit of linear control
    NOT_EVALUATED = "not evaluated"  # a case that it needs has no answer: nothing is said of the claim


@dataclass(frozen=True)
class Listing:
    """Numbers that belong to a finding and do not fit into a sentence: words in rows under heads."""

    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def __post_init__(self) -> None:
        """Refuse a row that has more or fewer cells than there are heads."""
        for row in self.rows:
            if len(row) != len(self.heads):
                raise ValueError(f"a row of {len(row)} cells under {len(self.heads)} heads: {row}")


@dataclass(frozen=True)
class Finding:
    """What looking at the numbers gave: the figures in words, the verdict, and why it is that one."""

    ours: str
    verdict: Verdict
    why: str
    listing: Listing | None = None


@dataclass(frozen=True)
class JudgedClaim:
    """One row of the ledger; ``evidence`` names the datasets that were read."""

    id: str
    place: str
    claim: str
    printed: str
    finding: Finding
    evidence: tuple[str, ...]

    def document(self) -> dict[str, Any]:
        """The row as plain values, with the keys of ``magbear reproduce --json``."""
        listing = self.finding.listing
        table = [] if listing is None else [dict(zip(listing.heads, row, strict=True)) for row in listing.rows]
        return {
            "id": self.id,
            "place": self.place,
            "claim": self.claim,
            "printed": self.printed,
            "ours": self.finding.ours,
            "verdict": self.finding.verdict.value,
            "why": self.finding.why,
            "table": table,
            "evidence": list(self.evidence),
        }


def tally(claims: Sequence[JudgedClaim]) -> str:
    """How many claims have which verdict, in one line."""
    counts = Counter(claim.finding.verdict for claim in claims)
    return ", ".join(f"{counts[verdict]} {verdict.value}" for verdict in Verdict if counts[verdict])

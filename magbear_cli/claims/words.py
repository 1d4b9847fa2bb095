"""Numbers as they stand in the ledger's sentences."""

from __future__ import annotations

import math
from collections.abc import Iterable

from magbear_cli.claims.ledger import Finding, Listing, Verdict


def told(value: float, digits: int = 4) -> str:
    """A number to so many digits; a large or small one with its power of ten."""
    if not math.isfinite(value):
        return "none"
    return f"{value:.{digits}g}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")


def pair(values: Iterable[float]) -> str:
    """Numbers in brackets, as a gain is printed."""
    return f"[{', '.join(told(value) for value in values)}]"


def decided(holds: bool, ours: str, because: str, otherwise: str, listing: Listing | None = None) -> Finding:  # noqa: FBT001 - the one thing that is decided
    """Confirmed for this reason, or not reproduced for that one."""
    verdict = Verdict.CONFIRMED if holds else Verdict.NOT_REPRODUCED
    return Finding(ours, verdict, because if holds else otherwise, listing)

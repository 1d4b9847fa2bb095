"""Sections 4.2 and 4.3: the force surface and what it amounts to as a change of mass."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from magbear_cli.claims.evidence import Evidence
from magbear_cli.claims.ledger import Finding, Listing, Verdict
from magbear_cli.claims.words import decided, told


def force_surface(evidence: Evidence) -> Finding:
    """C22: flat about the origin, and steeper away from it."""
    case = evidence.one("surface")
    position, current, force = (case.table("force_surface", name) for name in ("position_m", "current_a", "force_n"))
    z, u = np.unique(position), np.unique(current)
    grid = force.reshape(z.size, u.size)
    slopes = np.abs(np.gradient(grid, z, axis=0))
    middle = slopes[z.size // 2, u.size // 2]
    odd = float(np.abs(grid + grid[::-1, ::-1]).max() / np.abs(grid).max())
    ours = (
        f"±{told(np.abs(force).max(), 3)} N over ±{told(1e6 * z.max(), 3)} µm and ±{told(u.max(), 2)} A; "
        f"the stiffness grows {told(slopes.max() / middle, 3)} times from the origin to the edge"
    )
    holds = slopes.max() / middle >= evidence.printed["steeper"] and odd < evidence.tolerance["odd"]
    because = "flat about the origin, odd, and many times steeper at the edge"
    return decided(bool(holds), ours, because, "the surface has another shape")


def equivalent_range(evidence: Evidence) -> Finding:
    """C23: Table 4.1, row by row."""
    names = [name for name in evidence.cases if name.startswith("row_")]
    found = [evidence.one(name).statistic("equivalent_mass_uncertainty_kg") for name in names]
    printed = [evidence.printed[name] for name in names]
    wrong = [
        name for name, ours, theirs in zip(names, found, printed, strict=True)
        if abs(ours - theirs) > evidence.tolerance["mass_kg"]
    ]  # fmt: skip
    rows = tuple(
        (name.removeprefix("row_"), told(theirs), told(ours))
        for name, ours, theirs in zip(names, found, printed, strict=True)
    )
    ours = f"{', '.join(told(value) for value in found)} kg"
    listing = Listing(("row", "printed (kg)", "recomputed (kg)"), rows)
    if not wrong:
        return Finding(ours, Verdict.CONFIRMED, "every row is right to the printed digit", listing)
    if len(wrong) == 1:
        value = found[names.index(wrong[0])]
        row = wrong[0].removeprefix("row_")
        why = f"row {row} is misprinted: it is {told(value)} kg; the others are right to the printed digit"
        return Finding(ours, Verdict.ERRATUM, why, listing)
    return Finding(ours, Verdict.NOT_REPRODUCED, f"{len(wrong)} rows are other than printed", listing)


JUDGES: Mapping[str, Callable[[Evidence], Finding]] = {
    judge.__name__: judge for judge in (force_surface, equivalent_range)
}

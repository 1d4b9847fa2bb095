"""The thesis's procedure with other settings, in rows: what it gives for several tolerances, fit orders and grids."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from magbear_cli.claims.evidence import Case
from magbear_cli.claims.ledger import Listing
from magbear_cli.claims.words import told

HEADS = (
    "m (kg)",
    "ω_c (rad/s)",
    "form",
    "D-steps",
    "fit order",
    "tolerance",
    "grid (rad/s)",
    "states",
    "peak mu",
    "met",
)


def variants(cases: Sequence[Case]) -> Listing:
    """One row a case of ``mu_dk``."""
    return Listing(HEADS, tuple(_row(case) for case in cases))


def peak(case: Case) -> float:
    """Peak mu, recomputed; infinite for a loop that is not stable or was not found."""
    value = case.outcome.summary.peak_mu
    return np.inf if value is None else case.figure("peak_mu")


def mass_text(case: Case) -> str:
    """The range of masses, as ``3-4.5``."""
    mass = case.outcome.mass_kg
    return "-".join(told(value) for value in mass) if isinstance(mass, list) else told(mass)


def _row(case: Case) -> tuple[str, ...]:
    options = case.outcome.inputs["controller"]
    grid = options.get("frequency_grid")
    reached = peak(case)
    order = case.outcome.summary.order
    limit = case.outcome.omega_c_rad_s
    return (
        mass_text(case),
        "none" if limit is None else told(limit, 6),
        str(options.get("form", "–")).replace("_", " "),
        str(options.get("iterations", "–")),
        str(options.get("d_order", "–")),
        told(options["gamma_tolerance"]) if "gamma_tolerance" in options else "–",
        f"{told(grid[0])} to {told(grid[1])}" if grid else "own",
        "–" if order is None else str(order),
        told(reached) if np.isfinite(reached) else "–",
        "yes" if reached <= 1.0 else "no",
    )

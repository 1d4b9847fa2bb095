"""Sections 3.2 and 3.5: what a bound on the bandwidth leaves possible."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from magbear_cli.claims.evidence import Evidence, crossing
from magbear_cli.claims.ledger import Finding, Listing, Verdict
from magbear_cli.claims.procedure import mass_text, peak, variants
from magbear_cli.claims.words import decided, told


def mixed_sensitivity_limit(evidence: Evidence) -> Finding:
    """C11: where gamma passes 1 for one mass."""
    cases = evidence.all("sweep")
    omega = np.array([case.outcome.omega_c_rad_s for case in cases], dtype=float)
    gamma = np.array([case.figure("level") for case in cases])
    limit = crossing(gamma, omega)
    low, high = evidence.printed["low_rad_s"], evidence.printed["high_rad_s"]
    rows = tuple((told(place, 6), told(level, 5)) for place, level in zip(omega, gamma, strict=True))
    ours = f"gamma = 1 at ω_c = {told(limit)} rad/s"
    return decided(low < limit < high, ours, "the limit lies where it is said to lie", "the limit lies elsewhere",
                   Listing(("ω_c (rad/s)", "gamma"), rows))  # fmt: skip


def achievable_performance(evidence: Evidence) -> Finding:
    """C12: the wider the bandwidth, the lower the sensitivity that can be had."""
    cases = evidence.all("sweep")
    gamma = np.array([case.figure("level") for case in cases])
    within = [
        max(
            float((case.curve("performance_bound") * case.curve("sensitivity")).max()),
            float((case.curve("bandwidth_bound") * case.curve("complementary_sensitivity")).max()),
        )
        for case in cases
    ]
    holds = bool((np.diff(gamma) < 0.0).all()) and all(
        level <= g * (1.0 + evidence.tolerance["gamma"]) for level, g in zip(within, gamma, strict=True)
    )
    ours = (
        f"gamma falls from {told(gamma[0])} to {told(gamma[-1])} as ω_c rises; S and T keep within it of their bounds"
    )
    return decided(holds, ours, "recomputed curves stay within the level that was found", "a curve exceeds its level")


def bandwidth_needed(evidence: Evidence) -> Finding:
    """C17 to C19: the smallest ω_c for a range of masses, by the procedure and by proof."""
    procedure, limit = evidence.all("procedure"), evidence.one("limit")
    others = evidence.all("settings") if "settings" in evidence.cases else []
    best, simple = evidence.one("best"), evidence.one("simple")
    feasible, impossible = (limit.figure(f"omega_c_{side}_rad_s") for side in ("feasible", "infeasible"))
    met = [case for case in procedure if peak(case) <= 1.0]
    smallest = min((float(case.outcome.omega_c_rad_s or np.inf) for case in met), default=np.inf)
    least = min(peak(case) for case in procedure)
    own = f"needs {told(smallest, 6)}" if np.isfinite(smallest) else f"gets down to mu {told(least)} and not below 1"
    ours = (
        f"mu {told(peak(best))} for {mass_text(best)} kg at {told(best.outcome.omega_c_rad_s or 0.0, 6)} rad/s, "
        f"{told(peak(simple))} with one state; the limit lies between {told(impossible)} (proven impossible) and "
        f"{told(feasible)} rad/s (proven met); the procedure {own}"
    )
    printed, listing = evidence.printed["omega_c_rad_s"], variants([*procedure, *others])
    if feasible < printed * (1.0 - evidence.tolerance["omega_c"]) and limit.figure("verified"):
        why = f"{told(feasible)} rad/s is enough, proven; {told(printed, 6)} is a limit of the procedure, which {own}"
        return Finding(ours, Verdict.SUPERSEDED, why, listing)
    return Finding(ours, Verdict.CONFIRMED, "no controller is proven to need less", listing)


JUDGES: Mapping[str, Callable[[Evidence], Finding]] = {
    judge.__name__: judge for judge in (mixed_sensitivity_limit, achievable_performance, bandwidth_needed)
}

"""Section 4.7: an elastic rotor, identified from three facts, and what it leaves of the adaptation gain."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from magbear_cli.claims.evidence import Case, Evidence
from magbear_cli.claims.ledger import Finding, Listing, Verdict
from magbear_cli.claims.words import decided, told

MICRO = 1e6


def identified_rotor(evidence: Evidence) -> Finding:
    """C29: whether one rotor has the resonance, the touching bound and the unstable poles that are printed."""
    case = evidence.one("rotor")
    values = {name: case.statistic(name) for name in _IDENTIFIED}
    ours = (
        f"reduced mass {told(values['reduced_mass_kg'], 3)} kg, {told(values['stiffness_n_per_m'], 3)} N/m; Delta "
        f"touches the bound at c1 = {told(values['touching_damping_n_s_per_m'], 3)} N s/m; poles at c1 = 100: "
        f"{told(values['pole_real_rad_s'], 3)} ± {told(values['pole_imag_rad_s'], 4)}j"
    )
    touches = evidence.is_near(values["touching_damping_n_s_per_m"], "damping_n_s_per_m")
    frequency = evidence.is_near(values["pole_imag_rad_s"], "pole_imag_rad_s")
    growth = (
        abs(values["pole_real_rad_s"] - evidence.printed["pole_real_rad_s"]) <= evidence.tolerance["pole_real_rad_s"]
    )
    if touches and frequency and growth:
        why = (
            "one two-mass rotor has all three; the text's W3^-2 is read as the bound 1/|W3|, and the "
            "masses and the stiffness, lost with eq. 4.19, are an identification"
        )
        return Finding(ours, Verdict.ERRATUM, why)
    return Finding(ours, Verdict.NOT_REPRODUCED, "no two-mass rotor was found that has all three")


def gain_limits(evidence: Evidence) -> Finding:
    """C30: the adaptation gains that the elastic rotor allows, by bisection and at the printed values."""
    printed = {name: evidence.one(name) for name in ("c100_high", "c100_low", "c170_low", "c170_high", "rigid")}
    limits = {name: evidence.one(name) for name in ("c100_limit", "c170_limit", "rigid_limit")}
    rows = tuple(_run_row(name, case) for name, case in printed.items())
    told_limits = ", ".join(
        f"{name.removesuffix('_limit')} {told(case.statistic('gamma_stable'), 3)}" for name, case in limits.items()
    )
    expected = {"c100_high": False, "c100_low": True, "c170_low": True, "c170_high": False, "rigid": True}
    wrong = [name for name, case in printed.items() if _is_stable(case) is not expected[name]]
    ours = f"largest stable gain: {told_limits}; at the printed gains {5 - len(wrong)} of 5 behave as printed"
    listing = Listing(("rotor", "gain", "runs", "late error (µm)"), rows)
    otherwise = f"other than printed: {', '.join(wrong)}; the limit hangs on the rotor, which is only identified"
    return decided(not wrong, ours, "every printed gain behaves as printed", otherwise, listing)


_IDENTIFIED = (
    "reduced_mass_kg", "stiffness_n_per_m", "touching_damping_n_s_per_m", "pole_real_rad_s", "pole_imag_rad_s",
)  # fmt: skip


def _is_stable(case: Case) -> bool:
    return all(run.ended_well for run in case.steps())


def _run_row(name: str, case: Case) -> tuple[str, ...]:
    errors = [run.largest_error_m(0.5) for run in case.steps()]
    late = max(errors)
    gain = float(case.outcome.inputs["controller"]["gamma"])
    ends = "bounded" if _is_stable(case) else "unstable"
    return name.split("_", maxsplit=1)[0], told(gain), ends, told(MICRO * late, 3) if np.isfinite(late) else "–"


JUDGES: Mapping[str, Callable[[Evidence], Finding]] = {
    judge.__name__: judge for judge in (identified_rotor, gain_limits)
}

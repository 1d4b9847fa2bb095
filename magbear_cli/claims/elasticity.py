"""Section 4.7: an elastic rotor, identified from three facts, and what it leaves of the adaptation gain."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from magbear_cli.claims.evidence import Case, Evidence
from magbear_cli.claims.ledger import Finding, Listing, Verdict
from magbear_cli.claims.words import told
from magbear_cli.study.naming import controller_name

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
            "one two-mass rotor has all three, where the bound that Delta stays below is read as |W3|, as robust "
            "stability has it, and not W3^-1; the masses and the stiffness, lost with eq. 4.19, are an identification"
        )
        return Finding(ours, Verdict.ERRATUM, why, _linear_loops(evidence))
    return Finding(
        ours, Verdict.NOT_REPRODUCED, "no two-mass rotor was found that has all three", _linear_loops(evidence)
    )


def gain_limits(evidence: Evidence) -> Finding:
    """C30: the adaptation gains that the elastic rotor allows, by bisection and at the printed values."""
    limits = {rotor: evidence.one(f"{rotor}_limit").statistic("gamma_stable") for rotor in _BRACKETS}
    as_printed = {rotor: evidence.one(f"{rotor}_limit_as_printed").statistic("gamma_stable") for rotor in _BRACKETS}
    names = [name for name in evidence.cases if "limit" not in name]
    rows = tuple(_run_row(name, evidence.one(name)) for name in names)
    room = 1.0 + evidence.tolerance["gain"]
    wrong = [
        rotor for rotor, (low, high) in _BRACKETS.items()
        if not evidence.printed[low] / room <= limits[rotor] <= evidence.printed.get(high, math.inf) * room
    ]  # fmt: skip
    read, printed = (
        ", ".join(f"{rotor} {told(value, 3)}" for rotor, value in found.items()) for found in (limits, as_printed)
    )
    ours = f"largest stable gain {read} when the rate has no b; {printed} when it is that of eq. 4.10"
    listing = Listing(("rotor", "gain", "b in the rate", "runs", "late error (µm)"), rows)
    if wrong:
        why = f"the limit of {', '.join(wrong)} lies elsewhere; it hangs on the rotor, which is only identified"
        return Finding(ours, Verdict.NOT_REPRODUCED, why, listing)
    near = f"within {told(100.0 * evidence.tolerance['gain'])} % of"
    fits = [
        rotor for rotor, (low, high) in _BRACKETS.items()
        if evidence.printed[low] / room <= as_printed[rotor] <= evidence.printed.get(high, math.inf) * room
    ]  # fmt: skip
    if len(fits) == len(_BRACKETS):
        return Finding(ours, Verdict.CONFIRMED, f"all limits lie {near} what is printed", listing)
    why = (
        f"all limits lie {near} what is printed if the rate of eq. 4.10 is read without its b and the trigger is the "
        "whole state; with b they lie elsewhere. The rotor is the identified one"
    )
    return Finding(ours, Verdict.ERRATUM, why, listing)


_BRACKETS = {"c100": ("c100_low", "c100_high"), "c170": ("c170_low", "c170_high"), "rigid": ("rigid_low", "")}


def _linear_loops(evidence: Evidence) -> Listing:
    """How the linear designs of section 4.5 bear the rotor that was identified."""
    rows = []
    for case in evidence.all("linear"):
        options = case.outcome.inputs["controller"]
        name = f"{controller_name(options)}, {case.outcome.summary.order} states"
        for run in case.steps():
            rotor = run.step.scenario["rotor"]
            kind = "rigid" if rotor is None else f"c1 = {told(float(rotor['damping_n_s_per_m']))}"
            rows.append((name, kind, "stable" if run.is_stable else "unstable", told(run.figure("peak_current_a"), 3)))
    return Listing(("linear design", "rotor", "10 µm step", "peak current (A)"), tuple(rows))


_IDENTIFIED = (
    "reduced_mass_kg", "stiffness_n_per_m", "touching_damping_n_s_per_m", "pole_real_rad_s", "pole_imag_rad_s",
)  # fmt: skip


def _is_stable(case: Case) -> bool:
    return all(run.is_stable for run in case.steps())


def _run_row(name: str, case: Case) -> tuple[str, ...]:
    late = max(run.largest_error_m(0.5) for run in case.steps())
    options = case.outcome.inputs["controller"]
    has_b = "no" if options["adaptation_input_gain_m_per_s2_a"] == 1.0 else "yes"
    ends = "bounded" if _is_stable(case) else "unstable"
    error = told(MICRO * late, 3) if np.isfinite(late) else "–"
    return name.split("_", maxsplit=1)[0], told(float(options["gamma"])), has_b, ends, error


JUDGES: Mapping[str, Callable[[Evidence], Finding]] = {
    judge.__name__: judge for judge in (identified_rotor, gain_limits)
}

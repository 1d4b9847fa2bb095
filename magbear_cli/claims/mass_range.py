"""Sections 2.3.4, 3.3, 3.4, 3.6 and 3.7: what an uncertain mass costs without a bound on the bandwidth."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from magbear_cli.claims.evidence import ANY, Case, Evidence, Run
from magbear_cli.claims.ledger import Finding, Listing, Verdict
from magbear_cli.claims.procedure import mass_text, peak, variants
from magbear_cli.claims.words import decided, told

MILLI, MICRO = 1e3, 1e6
TEN_MICROMETRES_M = 1e-5
PRINTED_RANGES = 3  # m_Delta of 0.5, 1.0 and 1.5 kg


def one_d_step(evidence: Evidence) -> Finding:
    """C09: peak mu before and after one D-step, and the sensitivities under their bound."""
    before, after, cases = evidence.one("before"), evidence.one("after"), evidence.all("variants")
    worst = _worst_weighted_sensitivity(after)
    ours = (
        f"peak mu {told(peak(before))} before and {told(peak(after))} after one D-step, "
        f"{told(after.figure('order'), 2)} states; the largest |W1 S| over the masses is {told(worst)}"
    )
    if peak(before) > 1.0 and peak(after) <= 1.0 and worst <= 1.0:
        return Finding(
            ours, Verdict.CONFIRMED, "one D-step brings mu below 1 and every S below its bound", variants(cases)
        )
    why = f"with the settings as printed peak mu is {told(peak(after))} after the D-step"
    better = [case for case in cases if peak(case) <= 1.0 and _worst_weighted_sensitivity(case) <= 1.0]
    if not better:
        return Finding(ours, Verdict.NOT_REPRODUCED, why, variants(cases))
    options = better[0].outcome.inputs["controller"]
    settings = f"fits of order {options['d_order']} and a tolerance of {told(options['gamma_tolerance'])}"
    why = f"{why}; with {settings} it is {told(peak(better[0]))} and every S is below its bound"
    return Finding(ours, Verdict.ERRATUM, why, variants(cases))


def widest_range(evidence: Evidence) -> Finding:
    """C13: whether 3 to 5 kg is beyond linear control."""
    cases = evidence.all("procedure")
    narrow, wide = evidence.one("narrow"), evidence.one("wide")
    best = evidence.all("best")
    reached = ", ".join(f"{mass_text(case)} kg: {told(peak(case))}" for case in best)
    ours = (
        f"the procedure reaches mu {told(peak(narrow))} for 3 to 4.5 kg and {told(peak(wide))} for 3 to 5 kg; "
        f"other designs reach {reached}"
    )
    beyond = [case for case in best if _upper_kg(case) > evidence.printed["widest_kg"]]
    return _not_a_limit(ours, beyond, "a range that is said to be out of reach", variants(cases))


def steps_of_one_shape(evidence: Evidence) -> Finding:
    """C14: steps for three masses settle in a millisecond with one shape."""
    runs = evidence.one("design").steps(step_m=TEN_MICROMETRES_M, prefilter=None, model="linear")
    band = evidence.tolerance["band"]
    times = [run.settled_s(band) for run in runs]
    spread = _spread(runs)
    ours = (
        f"within {told(100 * band)} % of the step after {', '.join(told(MILLI * time, 3) for time in times)} ms; the "
        f"responses differ by at most {told(100 * spread, 2)} % of the step"
    )
    holds = max(times) <= evidence.printed["settling_s"] * (1.0 + evidence.tolerance["settling"])
    alike = spread <= evidence.tolerance["shape"]
    return decided(holds and alike, ours, "all settle in about 1 ms and look alike", "they settle later or differ")


def gain_jump(evidence: Evidence) -> Finding:
    """C15: whether robustness needs 20 dB more gain from m_Delta = 1.0 to 1.5 kg."""
    procedure, least = evidence.all("procedure"), evidence.all("least_current")
    gains = [case.figure("peak_gain_a_per_m") for case in procedure]
    currents = [TEN_MICROMETRES_M * case.figure("peak_ks_a_per_m") for case in least]
    jumps = [20.0 * np.log10(values[-1] / values[-2]) for values in (gains[:3], currents[:3])]
    told_currents = ", ".join(told(value, 3) for value in currents)
    ours = (
        f"from 1.0 to 1.5 kg the procedure's gain rises by {told(jumps[0], 3)} dB; the least peak of |K S| is "
        f"{told_currents} A per 10 µm for {', '.join(mass_text(case) for case in least)} kg: {told(jumps[1], 2)} dB"
    )
    why = f"the least current that robustness needs rises by {told(jumps[1], 2)} dB, not by more than 20"
    rows = tuple(
        (mass_text(case), told(gain, 4), told(current, 3))
        for case, gain, current in zip(procedure, gains, currents, strict=False)
    )
    listing = Listing(("m (kg)", "peak |K| of the procedure (A/m)", "least peak |K S| (A per 10 µm)"), rows)
    if jumps[1] < evidence.printed["jump_db"]:
        return Finding(ours, Verdict.SUPERSEDED, why, listing)
    return Finding(ours, Verdict.CONFIRMED, "the least current jumps as the gain does", listing)


def step_currents(evidence: Evidence) -> Finding:
    """C16: the currents of 10 µm steps, the thesis's designs and ours."""
    listing, procedure, best = _currents(evidence)
    ranges = ", ".join(mass_text(case) for case in evidence.all("procedure")[:PRINTED_RANGES])
    takes = [_amperes(currents[:PRINTED_RANGES]) for currents in (procedure, best)]
    ours = f"for {ranges} kg the procedure takes {takes[0]} A, the least-current designs {takes[1]} A"
    small = max(procedure[:2]) <= evidence.printed["small_a"] * (1.0 + evidence.tolerance["current"])
    large = (
        abs(procedure[2] - evidence.printed["large_a"]) <= evidence.tolerance["current"] * evidence.printed["large_a"]
    )
    better = best[2] < min(procedure[2], evidence.printed["large_a"])
    if better:
        why = f"3 to 4.5 kg needs {told(best[2], 3)} A, not almost 20" + (
            "" if small and large else "; the procedure's own currents are other than printed"
        )
        return Finding(ours, Verdict.SUPERSEDED, why, listing)
    return decided(small and large, ours, "the currents are those printed", "the currents are others", listing)


def prefilter_saves_current(evidence: Evidence) -> Finding:
    """C21: the prefilter cuts the current and hardly changes the settling."""
    design = evidence.one("design")
    bare, filtered = (design.steps(prefilter=kind, step_m=TEN_MICROMETRES_M, model="linear") for kind in (None, ANY))
    peaks = [max(run.figure("peak_current_a") for run in runs) for runs in (bare, filtered)]
    band = evidence.tolerance["band"]
    times = [max(run.settled_s(band) for run in runs) for runs in (bare, filtered)]
    listing, _, _ = _currents(evidence)
    ours = (
        f"the peak falls from {told(peaks[0], 3)} to {told(peaks[1], 3)} A, the time to stay "
        f"within {told(100 * band)} % goes from {told(MILLI * times[0], 3)} to {told(MILLI * times[1], 3)} ms"
    )
    cut = peaks[1] / peaks[0] <= evidence.printed["ratio"] * (1.0 + evidence.tolerance["ratio"])
    kept = times[1] <= times[0] + evidence.tolerance["settling_s"]
    if not (cut and kept):
        why = "the current falls less, or settling changes more, than printed"
        return Finding(ours, Verdict.NOT_REPRODUCED, why, listing)
    why = "the current falls to less than half and settling barely changes"
    printed = (evidence.printed["before_a"], evidence.printed["after_a"])
    if all(abs(peak - own) <= evidence.tolerance["current"] * own for peak, own in zip(peaks, printed, strict=True)):
        return Finding(ours, Verdict.CONFIRMED, why, listing)
    return Finding(ours, Verdict.ERRATUM, f"{why}, but the amperes are not those printed", listing)


def order_reduction(evidence: Evidence) -> Finding:
    """C20: how far the controllers can be reduced, and how few states are enough."""
    cases, simple = evidence.all("reduced"), evidence.all("simple")
    heads = ("design", "states before", "states", "method", "peak mu", "met")
    rows = tuple(_reduction_row(case) for case in (*cases, *simple))
    orders = {int(case.figure("order")): peak(case) for case in simple}
    fewest = min(order for order, level in orders.items() if level <= 1.0)
    kept = [case for case in cases if peak(case) <= 1.0]
    smallest = min((int(case.figure("order")) for case in kept), default=0)
    states = f"{fewest} state{'s' if fewest > 1 else ''}"
    own = f"stays below 1 down to {smallest} states" if kept else "is never below 1"
    ours = f"a controller of {states} reaches mu {told(orders[fewest])}; the procedure's own, reduced, {own}"
    if fewest < evidence.printed["states"]:
        why = f"{states} {'are' if fewest > 1 else 'is'} enough, against {told(evidence.printed['states'])}"
        return Finding(ours, Verdict.SUPERSEDED, why, Listing(heads, rows))
    return Finding(ours, Verdict.CONFIRMED, "no simpler controller meets the specification", Listing(heads, rows))


def _not_a_limit(ours: str, beyond: Sequence[Case], what: str, listing: Listing) -> Finding:
    """Superseded when a proven controller stands where there should be none."""
    proven = [case for case in beyond if case.figure("verified") and peak(case) <= 1.0]
    if not proven:
        return Finding(ours, Verdict.CONFIRMED, f"no controller was found for {what}", listing)
    case = proven[0]
    why = (
        f"for {mass_text(case)} kg, {what}, a controller of {told(case.figure('order'))} states reaches mu "
        f"{told(peak(case))} and is proven to meet the specification"
    )
    return Finding(ours, Verdict.SUPERSEDED, why, listing)


def _upper_kg(case: Case) -> float:
    mass = case.outcome.mass_kg
    return float(mass[-1]) if isinstance(mass, list) else float(mass)


def _worst_weighted_sensitivity(case: Case) -> float:
    weight, sensitivity = case.curve("performance_bound"), case.curve("sensitivity")
    return float((weight * sensitivity).max())


def _spread(runs: Sequence[Run]) -> float:
    """The largest distance between the responses over time, as a part of the step."""
    times = runs[0].curve("time_s")
    curves = [np.interp(times, run.curve("time_s"), run.curve("position_m")) for run in runs]
    return float(np.ptp(np.array(curves), axis=0).max() / TEN_MICROMETRES_M)


def _amperes(values: Sequence[float]) -> str:
    return ", ".join(told(value, 3) for value in values)


def _peak_current(case: Case, prefilter: str | None) -> float:
    return max(
        run.figure("peak_current_a")
        for run in case.steps(prefilter=prefilter, step_m=TEN_MICROMETRES_M, model="linear")
    )


def _currents(evidence: Evidence) -> tuple[Listing, list[float], list[float]]:
    """Peak currents with and without prefilter, one row a design; without it, of the procedure's and of ours."""
    procedure, best = evidence.all("procedure"), evidence.all("least_current")
    rows = []
    for case in (*procedure, *best):
        currents = [_peak_current(case, prefilter) for prefilter in (None, ANY)]
        name = case.outcome.method
        rows.append((name, mass_text(case), told(case.figure("order")), *(told(value, 3) for value in currents)))
    heads = ("design", "m (kg)", "states", "peak current (A)", "with prefilter (A)")
    without = [[_peak_current(case, None) for case in cases] for cases in (procedure, best)]
    return Listing(heads, tuple(rows)), without[0], without[1]


def _reduction_row(case: Case) -> tuple[str, ...]:
    reduction = case.outcome.inputs.get("reduction")
    before = case.outcome.statistics.get("order_before_reduction", case.figure("order"))
    how = "–" if reduction is None else str(reduction["method"])
    return (
        case.outcome.method, told(before), told(case.figure("order")), how, told(peak(case)),
        "yes" if peak(case) <= 1.0 else "no",
    )  # fmt: skip


JUDGES: Mapping[str, Callable[[Evidence], Finding]] = {
    judge.__name__: judge
    for judge in (
        one_d_step, widest_range, steps_of_one_shape, gain_jump, step_currents, prefilter_saves_current,
        order_reduction,
    )
}  # fmt: skip

"""Chapter 2 of the thesis: designs for one rotor, and what sensor dynamics do to them."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from magbear_cli.claims.evidence import ANY, Case, Evidence, Floats, crossing
from magbear_cli.claims.ledger import Finding, Listing, Verdict
from magbear_cli.claims.words import decided, pair, told

MILLI, MICRO = 1e3, 1e6
GAINS = ("gain_position_a_per_m", "gain_speed_a_s_per_m")
FILTER_GAINS = ("filter_gain_position_per_s", "filter_gain_speed_per_s2")


def lqg_gain(evidence: Evidence) -> Finding:
    """C01: the state feedback; one of its two figures may be a misprint, if the other is right to the last digit."""
    text, appendix, half = (_gains(evidence.one(name)) for name in ("text", "appendix", "appendix_half_law"))
    ours = f"K = {pair(text)}; with the appendix's R {pair(appendix)}, and with k_i halved {pair(half)}"
    position, speed = evidence.is_near(text[0], "position_gain"), evidence.is_near(text[1], "speed_gain")
    if position and speed:
        return Finding(ours, Verdict.CONFIRMED, "both gains are those printed")
    close = abs(text[0] / evidence.printed["position_gain"] - 1.0) <= evidence.tolerance["misprint"]
    if speed and close:
        why = f"the speed gain agrees to the last digit and the position gain is {told(text[0])}: a digit is misprinted"
        return Finding(ours, Verdict.ERRATUM, why)
    return Finding(ours, Verdict.NOT_REPRODUCED, "neither the text's R nor the appendix's gives the printed gains")


def kalman_filter_gain(evidence: Evidence) -> Finding:
    """C02: the filter's gain."""
    gains = [evidence.one("text").statistic(name) for name in FILTER_GAINS]
    holds = evidence.is_near(gains[0], "position_gain") and evidence.is_near(gains[1], "speed_gain")
    return decided(holds, f"H = {pair(gains)}", "both gains are those printed", "the filter's gain is another")


def pulse_settles(evidence: Evidence) -> Finding:
    """C03: the response to a pulse of force."""
    run = evidence.one("lqg").step(sensor=None)
    settling, overshoot = run.figure("settling_time_s"), run.figure("overshoot")
    ours = f"settled after {told(MILLI * settling)} ms, {told(100 * overshoot, 2)} % on the other side"
    holds = settling <= evidence.printed["settling_s"] and overshoot <= evidence.tolerance["overshoot"]
    late = f"it takes {told(MILLI * settling)} ms, or swings back by {told(100 * overshoot, 2)} %"
    return decided(holds, ours, "it settles in time, and does not swing back", late)


def unstable_with_sensor(evidence: Evidence) -> Finding:
    """C04: the same loop with the sensor's dynamics in it."""
    case = evidence.one("lqg")
    without, run = case.step(sensor=None, model="linear"), case.step(sensor=ANY)
    behaves = "stays bounded and dies away" if run.is_stable else "swings ever wider" if run.ended_well else "runs away"
    ours = f"with the sensor the response to the pulse {behaves}; without it it settles"
    holds = without.is_stable and not run.is_stable
    return decided(holds, ours, "stable without the sensor, unstable with it", "the sensor does not make it unstable")


def infeasible_gain(evidence: Evidence) -> Finding:
    """C05: whether gain 9 can be met, as printed and mended."""
    mended, printed = (evidence.one(name).figure("level") for name in ("mended", "as_printed"))
    limits = [_gain_limit(evidence, name) for name in ("mended_sweep", "as_printed_sweep")]
    ours = (
        f"gamma(9) = {told(mended)} mended, {told(printed)} as printed; "
        f"gamma = 1 at a gain of {told(limits[0])} mended, {told(limits[1])} as printed"
    )
    if mended > 1.0:
        return Finding(ours, Verdict.CONFIRMED, "no controller meets it, in either form")
    slip = "the program of appendix A.2 has a wrong sign and factor in the output of W2, and only with that slip is "
    why = f"false as stated: a controller reaches gamma = {told(mended)}; {slip}gamma {told(printed)}"
    return Finding(ours, Verdict.NOT_REPRODUCED, why)


def feasible_gain(evidence: Evidence) -> Finding:
    """C06: the revised gain is met, the loop bears the sensor, and it is slower than LQG."""
    mended, printed, lqg = (evidence.one(name) for name in ("mended", "as_printed", "lqg"))
    levels = mended.figure("level"), printed.figure("level")
    runs = [case.step(sensor=None, model="linear") for case in (mended, printed, lqg)]
    moved = [MICRO * float(np.abs(run.curve("position_m")).max()) for run in runs]
    times = [MILLI * run.figure("settling_time_s") for run in runs]
    with_sensor = [case.step(sensor=ANY).is_stable for case in (mended, printed)]
    ours = (
        f"gamma(6.1) = {told(levels[0])} mended, {told(levels[1])} as printed; "
        f"{'stable' if all(with_sensor) else 'not stable'} with the sensor; the pulse moves the rotor by "
        f"{told(moved[0], 3)} and {told(moved[1], 3)} µm for {told(times[0], 3)} and {told(times[1], 3)} ms, with "
        f"LQG by {told(moved[2], 3)} µm for {told(times[2], 3)} ms"
    )
    feasible = max(levels) <= 1.0 + evidence.tolerance["gamma"]
    poorer = min(moved[:2]) > moved[2]
    if not (feasible and all(with_sensor) and poorer):
        return Finding(ours, Verdict.NOT_REPRODUCED, "one of its three parts fails")
    why = "feasible, stable with the sensor, and pushed farther than with LQG"
    if levels[0] < 1.0 - evidence.tolerance["gamma"]:
        why = f"{why}; but 6.1 is where only the form as printed ends: mended, gamma is {told(levels[0])}"
        return Finding(ours, Verdict.ERRATUM, why)
    return Finding(ours, Verdict.CONFIRMED, why)


def recovered_loop(evidence: Evidence) -> Finding:
    """C07: the filter's gain, the recovery, and the oscillation with the sensor."""
    mended, appendix = evidence.one("mended"), evidence.one("appendix")
    gains = [[case.statistic(name) for name in FILTER_GAINS] for case in (mended, appendix)]
    error = mended.statistic("recovery_error")
    run, quiet = mended.step(sensor=ANY), mended.step(sensor=None)
    swings = [_swings(each.curve("current_a")) for each in (run, quiet)]
    ours = (
        f"H = {pair(gains[0])} for Theta = 1e-8, {pair(gains[1])} for the appendix's 8e-9; sensitivities differ "
        f"by at most {told(error, 2)}; with the sensor {'stable' if run.is_stable else 'unstable'}, "
        f"the current swings {swings[0]} times, without it {swings[1]} times"
    )
    as_printed = [
        evidence.is_near(gain, name) for gain, name in zip(gains[0], ("position_gain", "speed_gain"), strict=True)
    ]
    shown = error <= evidence.tolerance["recovery"] and run.is_stable and swings[0] > swings[1]
    if all(as_printed) and shown:
        why = "with Theta = 1e-8 the printed gain comes out; the appendix's 8e-9 gives another"
        return Finding(ours, Verdict.ERRATUM, f"{why}; recovered, stable and oscillating with the sensor")
    return Finding(ours, Verdict.NOT_REPRODUCED, "the gain, the recovery or the oscillation does not come out")


def nominal_mass(evidence: Evidence) -> Finding:
    """C08: the mean of 1/m and its spread."""
    case = evidence.one("design")
    mass, spread = case.statistic("nominal_mass_kg"), case.statistic("inverse_mass_spread_per_kg")
    holds = evidence.is_near(mass, "mass_kg") and evidence.is_near(spread, "spread_per_kg")
    ours = f"m_n = {told(mass)} kg, Delta_2 = {told(spread)} 1/kg"
    return decided(holds, ours, "both are exact", "the mean of 1/m is another")


def comparison_table(evidence: Evidence) -> Finding:
    """C10: every method of Table 2.3 run on one bearing, and what the table guarantees held against the figures."""
    cases = evidence.all("methods")
    rows = tuple(_method_row(case) for case in cases)
    heads = (
        "method", "states", "gain margin down", "gain margin up", "phase margin (deg)", "peak |S|", "peak mu",
        "peak |K| (A/m)", "settling (ms)", "with sensor (ms)",
    )  # fmt: skip
    by_method = {case.outcome.method: case for case in cases}
    stable = all(case.figure("max_pole_real_rad_s") < 0.0 for case in cases)
    lqr = by_method["lqr"]
    margins = lqr.figure("phase_margin_deg") >= evidence.printed["lqr_phase_deg"] - evidence.tolerance["phase_deg"]
    guaranteed = margins and lqr.figure("gain_margin_low") <= 0.5 + evidence.tolerance["gain"]
    met = [case.outcome.method for case in cases if case.outcome.summary.verified]
    ours = (
        f"{len(cases)} designs run, {'all' if stable else 'not all'} stabilise every mass; LQR has a phase margin of "
        f"{told(lqr.figure('phase_margin_deg'), 3)} deg; the specification is proven met by {', '.join(met) or 'none'}"
    )
    why = "every method stabilises, LQR has its guaranteed margins, and mu-synthesis meets the specification"
    holds = stable and guaranteed and "mu_dk" in met
    otherwise = "a guarantee of the table is not borne out by the figures"
    return decided(holds, ours, why, otherwise, Listing(heads, rows))


def _gains(case: Case) -> list[float]:
    return [case.statistic(name) for name in GAINS]


def _gain_limit(evidence: Evidence, name: str) -> float:
    cases = evidence.all(name)
    gains = np.array([_dc_gain(case) for case in cases])
    return crossing(np.array([case.figure("level") for case in cases]), gains)


def _dc_gain(case: Case) -> float:
    weight = case.outcome.inputs["performance"]
    return float(weight["num"][-1] / weight["den"][-1])


def _swings(curve: Floats) -> int:
    """How often a curve turns round after having moved by more than 2 % of its largest excursion."""
    turning = curve[np.flatnonzero(np.diff(np.sign(np.diff(curve)))) + 1]
    return int((np.abs(np.diff(turning)) > 0.02 * np.abs(curve).max()).sum())


def _method_row(case: Case) -> tuple[str, ...]:
    def shown(name: str, digits: int = 3) -> str:
        return told(case.figure(name), digits) if getattr(case.outcome.summary, name) is not None else "–"

    runs = [case.steps(sensor=kind) for kind in (None, ANY)]
    settling = [max(run.figure("settling_time_s") for run in group) for group in runs]
    calm = [all(run.is_stable for run in group) for group in runs]
    times = [told(MILLI * time, 3) if fine else "unstable" for time, fine in zip(settling, calm, strict=True)]
    names = ("order", "gain_margin_low", "gain_margin_high", "phase_margin_deg", "peak_sensitivity", "peak_mu")
    return (case.outcome.method, *(shown(name) for name in names), shown("peak_gain_a_per_m"), *times)


JUDGES: Mapping[str, Callable[[Evidence], Finding]] = {
    judge.__name__: judge
    for judge in (
        lqg_gain, kalman_filter_gain, pulse_settles, unstable_with_sensor, infeasible_gain, feasible_gain,
        recovered_loop, nominal_mass, comparison_table,
    )
}  # fmt: skip

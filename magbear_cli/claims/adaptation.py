"""Sections 4.4 to 4.6: the adaptive controller beside a linear one, on the nonlinear bearing."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from magbear_cli.claims.evidence import Case, Evidence, Floats, Run
from magbear_cli.claims.ledger import Finding, Listing, Verdict
from magbear_cli.claims.procedure import peak
from magbear_cli.claims.words import decided, pair, told
from magbear_cli.study.naming import controller_name

MILLI, MICRO = 1e3, 1e6
LATE = 0.5  # of a run: from here on the error is that of a controller that has had time to adapt


def placed_poles(evidence: Evidence) -> Finding:
    """C24: the gain that puts two poles at −600 rad/s."""
    names = ("gain_position_a_per_m", "gain_speed_a_s_per_m")
    full, half = ([evidence.one(law).statistic(name) for name in names] for law in ("full_law", "half_law"))
    ours = f"K = {pair(full)} for 2.2 kg and k_i = 50 N/A, {pair(half)} for the 25 N/A of the circuit of eq. 4.1"
    if all(evidence.is_near(gain, name) for gain, name in zip(full, ("position_gain", "speed_gain"), strict=True)):
        why = "exact for 2.2 kg with k_i = 50, not with the 25 N/A of the circuit that the chapter simulates"
        return Finding(ours, Verdict.ERRATUM, why)
    return Finding(ours, Verdict.NOT_REPRODUCED, "neither current law gives the printed gain")


def equivalent_design(evidence: Evidence) -> Finding:
    """C25: how far the range for the reference model's sensitivity reaches, and how near the step comes to it."""
    designs, wider, limit = evidence.all("designs"), evidence.all("wider"), evidence.one("limit")
    feasible, impossible = (limit.figure(f"omega_c_{side}_rad_s") for side in ("feasible", "infeasible"))
    rows = tuple(_resemblance_row(case) for case in designs)
    least = min(_distance(case) for case in designs)
    best = min(peak(case) for case in designs)
    beyond = [case for case in wider if case.figure("verified")]
    widest = max((float(case.outcome.inputs["mass_kg"][-1]) for case in beyond), default=0.0)
    ours = (
        f"optimal mu {told(best)}; the limit lies between {told(impossible)} (proven impossible) and "
        f"{told(feasible)} rad/s (proven met); the nearest step differs from the reference model's by "
        f"{told(100 * least, 2)} % of the step"
    )
    similar = least <= evidence.tolerance["resemblance"]
    alike = f"the step {'resembles' if similar else 'does not resemble'} the reference model's"
    listing = Listing(("design", "states", "mu", "largest distance (%)", "largest overshoot (%)"), rows)
    if beyond:
        why = f"not the widest range: 2.2 to {told(widest)} kg is proven met at the same ω_c; {alike}"
        return Finding(ours, Verdict.SUPERSEDED, why, listing)
    return decided(similar and best <= 1.0, ours, f"met, and {alike}", f"mu is {told(best)}, and {alike}", listing)


def large_steps(evidence: Evidence) -> Finding:
    """C26: the linear design with larger steps."""
    case = evidence.one("design")
    sizes = (1e-5, 1e-4, 2e-4)
    groups = [case.steps(step_m=size) for size in sizes]
    overshoot = [max(_overshoot(run) for run in runs) for runs in groups]
    settling = [max(run.figure("settling_time_s") for run in runs) for runs in groups]
    rows = tuple(
        (told(MICRO * size), told(100 * over, 3), told(MILLI * time, 3))
        for size, over, time in zip(sizes, overshoot, settling, strict=True)
    )
    ours = (
        f"overshoot {', '.join(told(100 * value, 3) for value in overshoot)} % and settling "
        f"{', '.join(told(MILLI * value, 3) for value in settling)} ms for 10, 100 and 200 µm"
    )
    listing = Listing(("step (µm)", "largest overshoot (%)", "latest settling (ms)"), rows)
    if not overshoot[0] < overshoot[1] < overshoot[2]:
        return Finding(ours, Verdict.NOT_REPRODUCED, "the overshoot does not grow with the step", listing)
    later = [size for size, time in zip(sizes[1:], settling[1:], strict=True) if time > settling[0]]
    if len(later) == len(sizes) - 1:
        return Finding(ours, Verdict.CONFIRMED, "larger steps overshoot more and settle later", listing)
    which = f"only that of {told(MICRO * later[0])} µm settles" if later else "none settles"
    why = f"the larger the step, the larger the overshoot, but {which} later than that of 10 µm"
    return Finding(ours, Verdict.ERRATUM, why, listing)


def adaptive_tracking(evidence: Evidence) -> Finding:
    """C27: the adaptive controller's error after it has had time to adapt, and its shape."""
    position, state = evidence.one("position_trigger"), evidence.one("state_trigger")
    runs = position.steps()
    errors = [run.largest_error_m(LATE) for run in runs]
    full = [run.largest_error_m(LATE) for run in state.steps()]
    bound = evidence.printed["radius_m"]
    shape = _shape_spread(runs)
    ours = (
        f"late tracking errors {', '.join(told(MICRO * error, 3) for error in errors)} µm with the trigger on "
        f"position, at most {told(MICRO * max(full), 3)} µm on the full state; the shapes differ by "
        f"{told(100 * shape, 2)} % of the step"
    )
    inside = max(errors) <= bound * (1.0 + evidence.tolerance["radius"])
    alike = shape <= evidence.tolerance["shape"]
    listing = _error_listing([position, state])
    because = f"the error converges inside {told(MICRO * bound)} µm and the shape does not change"
    return decided(inside and alike, ours, because, "the error leaves the sphere, or the shape changes", listing)


def gravity(evidence: Evidence) -> Finding:
    """C28: gravity with the linear design and its bias current, and with the adaptive one without."""
    linear, adaptive = evidence.one("linear"), evidence.one("adaptive")
    pulls = (0.0, 4.9, 9.8)
    slow = [_latest(linear, g) for g in pulls]
    late = [max(run.largest_error_m(LATE) for run in adaptive.steps(gravity_m_per_s2=g)) for g in pulls]
    rows = tuple(
        (told(g), told(MILLI * time, 3), told(100 * over, 3), told(MICRO * error, 3))
        for g, (time, over), error in zip(pulls, slow, late, strict=True)
    )
    times, overs = [value[0] for value in slow], [value[1] for value in slow]
    ours = (
        f"the linear design settles after {', '.join(told(MILLI * value, 3) for value in times)} ms at 0, 4.9 and "
        f"9.8 m/s²; the adaptive controller's late error is {', '.join(told(MICRO * value, 3) for value in late)} µm"
    )
    slower = times[2] > times[0] * (1.0 + evidence.tolerance["slower"])
    worse = slower or overs[2] > overs[0] + evidence.tolerance["overshoot"]
    unmoved = max(late) <= evidence.printed["radius_m"] * (1.0 + evidence.tolerance["radius"])
    heads = ("gravity (m/s²)", "linear: settling (ms)", "overshoot (%)", "adaptive: late error (µm)")
    otherwise = "gravity does not degrade the linear design, or it disturbs the adaptive one"
    because = "gravity degrades the linear design and not the adaptive one"
    return decided(worse and unmoved, ours, because, otherwise, Listing(heads, rows))


def _distance(case: Case) -> float:
    return max(_from_reference(run) for run in case.steps(step_m=1e-5))


def _resemblance_row(case: Case) -> tuple[str, ...]:
    overshoot = max(_overshoot(run) for run in case.steps(step_m=1e-5))
    figures = (told(case.figure("order")), told(peak(case)), told(100 * _distance(case), 3), told(100 * overshoot, 3))
    return controller_name(case.outcome.inputs["controller"]), *figures


def _from_reference(run: Run) -> float:
    """The largest distance of a step from the response of the reference model, as a part of the step."""
    omega = 600.0
    time = run.curve("time_s")
    model = 1.0 - (1.0 + omega * time) * np.exp(-omega * time)
    return float(np.abs(run.curve("position_m") / run.step.step_m - model).max())


def _overshoot(run: Run) -> float:
    """The excursion beyond the step, as a part of it; infinite after an early end."""
    if not run.ended_well:
        return float("inf")
    return float(max(0.0, run.curve("position_m").max() / run.step.step_m - 1.0))


def _latest(case: Case, gravity_m_per_s2: float) -> tuple[float, float]:
    runs = case.steps(gravity_m_per_s2=gravity_m_per_s2)
    return max(run.figure("settling_time_s") for run in runs), max(_overshoot(run) for run in runs)


def _shape_spread(runs: Sequence[Run]) -> float:
    """The largest distance between the responses of all runs, each as a part of its step, at equal times."""
    end = min(float(run.curve("time_s")[-1]) for run in runs)
    times: Floats = np.linspace(0.0, end, 400)
    curves = [np.interp(times, run.curve("time_s"), run.curve("position_m") / run.step.step_m) for run in runs]
    return float(np.ptp(np.array(curves), axis=0).max())


def _error_listing(cases: Sequence[Case]) -> Listing:
    rows = [
        (
            str(case.outcome.inputs["controller"]["trigger"]), told(run.step.mass_kg), told(MICRO * run.step.step_m),
            told(MICRO * run.largest_error_m(), 3), told(MICRO * run.largest_error_m(LATE), 3),
            told(run.figure("peak_current_a"), 3),
        )
        for case in cases for run in case.steps()
    ]  # fmt: skip
    heads = ("trigger", "m (kg)", "step (µm)", "largest error (µm)", "late error (µm)", "peak current (A)")
    return Listing(heads, tuple(rows))


JUDGES: Mapping[str, Callable[[Evidence], Finding]] = {
    judge.__name__: judge for judge in (placed_poles, equivalent_design, large_steps, adaptive_tracking, gravity)
}

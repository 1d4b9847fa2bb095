"""What is done to a loop in a simulation, in words."""

from __future__ import annotations

from magbear_cli.report.numbers import MICROMETRES, MILLISECONDS, shortest
from magbear_cli.study.outcome import StepOutcome


def prefilter_text(step: StepOutcome) -> str:
    """``no prefilter``, or ``prefilter 20 000 rad/s, ζ = 1``."""
    prefilter = step.scenario.get("prefilter")
    if not prefilter:
        return "no prefilter"
    return f"prefilter {shortest(float(prefilter['omega_rad_s']))} rad/s, ζ = {shortest(float(prefilter['zeta']))}"


def step_text(step: StepOutcome) -> str:
    """What is done to the loop: ``10 µm step, nonlinear``, with what else there is."""
    told = [f"{shortest(step.step_m * MICROMETRES)} µm step" if step.step_m else "no step", f"{step.model} model"]
    scenario = step.scenario
    if scenario.get("sensor"):
        told.append("sensor dynamics")
    if scenario.get("rotor"):
        told.append("flexible rotor")
    if scenario.get("gravity_m_per_s2"):
        carried = ", carried by a bias" if scenario.get("gravity_compensation") else ""
        told.append(f"gravity {shortest(float(scenario['gravity_m_per_s2']))} m/s²{carried}")
    if scenario.get("current_limit_a"):
        told.append(f"current limit {shortest(float(scenario['current_limit_a']))} A")
    pulse = scenario.get("disturbance")
    if pulse:
        length = shortest(float(pulse["duration_s"]) * MILLISECONDS)
        told.append(f"pulse of {shortest(float(pulse['force_n']))} N for {length} ms")
    return ", ".join(told)

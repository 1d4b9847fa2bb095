"""All that is said about a closed loop, gathered: figures for the table, curves over frequency, poles over the mass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from magbear_cli.analysis.frequency_grid import closed_frequency_grid
from magbear_cli.analysis.iso_14839 import iso_zone
from magbear_cli.analysis.loop_functions import loop_functions, peak_control_sensitivity, peak_controller_gain
from magbear_cli.analysis.margins import stability_margins
from magbear_cli.analysis.pole_family import pole_family
from magbear_cli.analysis.uncertain_loop import mu_study
from magbear_cli.analysis.verification import Verification
from magbear_cli.analysis.worst_case import peak_sensitivity, worst_case, worst_case_over_mass
from magbear_cli.errors import Status
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.problem import ControlProblem
from magbear_cli.study.outcome import Floats, FrequencyStudy, PoleStudy, Summary
from magbear_cli.synthesis.design import Design

POLE_MASSES = 33
GRID_POINTS_PER_DECADE = 40


def judge_loop(problem: ControlProblem, controller: StateSpace) -> tuple[Summary, FrequencyStudy, PoleStudy]:
    """The loop of a controller with every mass of the range, none of it taken from the method that made it."""
    omega = closed_frequency_grid(problem, controller, GRID_POINTS_PER_DECADE)
    family = pole_family(problem, controller, problem.mass.samples_kg(POLE_MASSES))
    poles = PoleStudy(family.masses_kg, family.poles_rad_s)
    frequency, summary = _over_frequency(problem, controller, omega)
    summary = replace(summary, order=controller.order, max_pole_real_rad_s=family.max_real_rad_s)
    if family.certainly_unstable:
        return summary, frequency, poles
    margins = stability_margins(problem, controller, omega)
    return (
        replace(
            summary,
            iso_zone=iso_zone(summary.peak_sensitivity or np.inf),
            gain_margin_low=margins.gain_low,
            gain_margin_high=margins.gain_high,
            phase_margin_deg=margins.phase_deg,
            disk_margin=margins.disk,
        ),
        frequency,
        poles,
    )


def _over_frequency(problem: ControlProblem, controller: StateSpace, omega: Floats) -> tuple[FrequencyStudy, Summary]:
    masses = np.unique([problem.mass.low_kg, problem.mass.nominal_kg, problem.mass.high_kg])
    loop = loop_functions(problem, controller, omega, [problem.mass.low_kg] if problem.mass.is_fixed else masses)
    mu = mu_study(problem, controller, omega)
    worst = worst_case(problem, controller, omega)
    study = FrequencyStudy(
        omega_rad_s=omega,
        masses_kg=loop.masses_kg,
        mu_upper=mu.upper,
        mu_lower=mu.lower,
        worst_case=worst_case_over_mass(problem, loop.controller_a_per_m, omega)[0],
        sensitivity=loop.sensitivity,
        complementary_sensitivity=loop.complementary_sensitivity,
        control_sensitivity_a_per_m=loop.control_sensitivity_a_per_m,
        controller_a_per_m=loop.controller_a_per_m,
        performance_bound=problem.performance_bound(omega),
        bandwidth_bound=problem.bandwidth_bound(omega),
    )
    summary = Summary(
        peak_mu=mu.peak_upper,
        peak_mu_lower=min(mu.peak_lower, mu.peak_upper),  # they may meet, to within rounding
        worst_case=worst.level,
        worst_mass_kg=worst.mass_kg,
        worst_omega_rad_s=worst.omega_rad_s,
        peak_gain_a_per_m=peak_controller_gain(controller, omega)[0],
        peak_ks_a_per_m=peak_control_sensitivity(problem, controller, omega, problem.mass.nominal_kg)[0],
        peak_sensitivity=peak_sensitivity(problem, controller, omega).level,
        mu_flatness=mu.flatness,
    )
    return study, summary


def verdict(design: Design, summary: Summary, verification: Verification) -> tuple[Status, str]:
    """The status of a case with a controller, and why it is not ``ok``.

    A worst case that is no number, where the loop cannot be evaluated, is no answer: the case has failed.
    """
    if verification.verified:
        return Status.OK, ""
    if verification.worst_level == np.inf:
        return Status.UNSTABLE, f"the loop is not stable for every mass: {verification.sentence}"
    worst = np.nan if summary.worst_case is None else summary.worst_case
    if np.isnan(worst):
        return Status.FAILED, f"the worst case cannot be computed: {verification.sentence}"
    if worst <= 1.0:
        return Status.UNVERIFIED, f"the worst case seems to be {worst:.4g}, but {verification.sentence}"
    own = f"{design.sentence}; " if design.sentence else ""
    return Status.NOT_ACHIEVED, f"{own}the worst case over the mass range is {worst:.4g}, above 1"


def without_levels(summary: Summary) -> Summary:
    """The summary of a loop that is not stable: the peaks of its curves are no levels of anything."""
    return replace(
        summary,
        peak_mu=None,
        peak_mu_lower=None,
        worst_case=None,
        worst_mass_kg=None,
        worst_omega_rad_s=None,
        peak_ks_a_per_m=None,
        peak_sensitivity=None,
        iso_zone=None,
        gain_margin_low=None,
        gain_margin_high=None,
        phase_margin_deg=None,
        disk_margin=None,
        mu_flatness=None,
    )

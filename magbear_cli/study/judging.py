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
from magbear_cli.analysis.worst_case import peak_sensitivity, worst_case
from magbear_cli.errors import Status
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.family import NOMINAL
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import worst_level
from magbear_cli.study.outcome import Floats, FrequencyStudy, PoleStudy, Summary
from magbear_cli.synthesis.design import Design

POLE_MEMBERS = 33
GRID_POINTS_PER_DECADE = 40


def judge_loop(problem: ControlProblem, controller: StateSpace) -> tuple[Summary, FrequencyStudy, PoleStudy]:
    """The loop of a controller with every mass of the range, none of it taken from the method that made it."""
    omega = closed_frequency_grid(problem, controller, GRID_POINTS_PER_DECADE)
    family = pole_family(problem, controller, problem.family.shares(POLE_MEMBERS))
    poles = PoleStudy(*_parameters(problem, family.shares), family.poles_rad_s)
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
    loop = loop_functions(problem, controller, omega, problem.family.shown_shares())
    masses, negative_stiffness, current_stiffness = _parameters(problem, loop.shares)
    mu = mu_study(problem, controller, omega)
    worst = worst_case(problem, controller, omega)
    member = problem.family.member(worst.share)
    study = FrequencyStudy(
        omega_rad_s=omega,
        masses_kg=masses,
        negative_stiffness_n_per_m=negative_stiffness,
        current_stiffness_n_per_a=current_stiffness,
        mu_upper=mu.upper,
        mu_lower=mu.lower,
        worst_case=worst_level(problem, loop.controller_a_per_m, omega)[0],
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
        worst_mass_kg=member.mass_kg,
        worst_negative_stiffness_n_per_m=member.negative_stiffness_n_per_m,
        worst_current_stiffness_n_per_a=member.current_stiffness_n_per_a,
        worst_omega_rad_s=worst.omega_rad_s,
        peak_gain_a_per_m=peak_controller_gain(controller, omega)[0],
        peak_ks_a_per_m=peak_control_sensitivity(problem, controller, omega, NOMINAL)[0],
        peak_sensitivity=peak_sensitivity(problem, controller, omega).level,
        mu_flatness=mu.flatness,
    )
    return study, summary


def _parameters(problem: ControlProblem, shares: Floats) -> tuple[Floats, Floats, Floats]:
    """Mass, negative stiffness and current stiffness of members, each (k,)."""
    members = [problem.family.member(float(share)) for share in shares]
    return (
        np.array([one.mass_kg for one in members]),
        np.array([one.negative_stiffness_n_per_m for one in members]),
        np.array([one.current_stiffness_n_per_a for one in members]),
    )


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
        worst_negative_stiffness_n_per_m=None,
        worst_current_stiffness_n_per_a=None,
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

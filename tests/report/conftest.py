"""Shared by the tests of the report: studies as they come from a results file, made from a lead controller by hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from magbear_cli.errors import Status
from magbear_cli.report.writing import write_report
from magbear_cli.study.outcome import (
    CaseOutcome,
    FrequencyStudy,
    PoleStudy,
    StepOutcome,
    StudyResults,
    Summary,
)

Floats = NDArray[np.float64]
K_Z, K_I = 62_500.0, 50.0
GAIN, ZERO, POLE = 7.6e6, 90.0, 2.4e4  # K = −gain (s + zero)/(s + pole) in A/m
PREFILTER = {"omega_rad_s": 20_000.0, "zeta": 1.0}


@dataclass(frozen=True)
class Asked:
    """What tells a made-up case from the others."""

    mass_kg: tuple[float, float] = (3.0, 4.5)
    omega_c_rad_s: float | None = 20_000.0
    controller: Mapping[str, Any] = field(default_factory=lambda: {"method": "mu_convex"})
    status: Status = Status.OK
    sentence: str = ""
    order: int = 1
    steps: bool = True
    curves: bool = True


def lead_case(index: int, asked: Asked) -> CaseOutcome:
    """The outcome of a case with the lead controller, all its curves evaluated in closed form."""
    low, high = asked.mass_kg
    inputs = {
        "bearing": {"air_gap_m": 4e-4, "force_constant_n_m2_per_a2": 4e-6, "bias_current_a": 0.5},
        "mass_kg": [low, high] if high > low else low,
        "performance": {"num": [2000.0], "den": [1.0, 200.0]},
        "bandwidth": None if asked.omega_c_rad_s is None else {"omega_c_rad_s": asked.omega_c_rad_s},
        "controller": dict(asked.controller),
    }
    case_id = f"{index:016x}"
    outcome = CaseOutcome(case_id, index, inputs, asked.status, asked.sentence)
    if not asked.curves:
        return outcome
    frequency = _frequency(low, high, asked.omega_c_rad_s)
    peak = float(frequency.worst_case.max())
    summary = Summary(
        level=peak,
        peak_mu=1.06 * peak,
        peak_mu_lower=1.05 * peak,
        worst_case=peak,
        worst_mass_kg=high,
        worst_omega_rad_s=float(frequency.omega_rad_s[frequency.worst_case.argmax()]),
        order=asked.order,
        peak_gain_a_per_m=GAIN,
        peak_ks_a_per_m=GAIN,
        peak_sensitivity=1.2,
        iso_zone="A",
        gain_margin_low=0.04,
        gain_margin_high=float("inf"),
        phase_margin_deg=68.0,
        disk_margin=1.2,
        max_pole_real_rad_s=-90.0,
        verified=asked.status == Status.OK,
        verification_sentence="stable for every mass",
    )
    steps = _steps(low, high) if asked.steps else ()
    return replace(outcome, summary=summary, frequency=frequency, poles=_poles(low, high), steps=steps)


def _frequency(low: float, high: float, omega_c: float | None) -> FrequencyStudy:
    omega = np.concatenate([[0.0], np.geomspace(1.0, 1e7, 281)])
    masses = np.unique([low, 2.0 / (1.0 / low + 1.0 / high), high])
    controller = -GAIN * (1j * omega + ZERO) / (1j * omega + POLE)
    plant = -K_I / (masses[:, None] * omega**2 + K_Z)
    sensitivity = 1.0 / (1.0 - controller * plant)
    complementary = -controller * plant * sensitivity
    w1 = np.abs(2000.0 / (1j * omega + 200.0))
    w3 = np.zeros_like(omega) if omega_c is None else (omega / omega_c) ** 2
    worst = (np.abs(sensitivity) * w1 + np.abs(complementary) * w3).max(axis=0)
    return FrequencyStudy(
        omega_rad_s=omega,
        masses_kg=masses,
        negative_stiffness_n_per_m=np.full(masses.size, K_Z),
        current_stiffness_n_per_a=np.full(masses.size, K_I),
        mu_upper=1.06 * worst,
        mu_lower=1.05 * worst,
        worst_case=worst,
        sensitivity=sensitivity,
        complementary_sensitivity=complementary,
        control_sensitivity_a_per_m=controller * sensitivity,
        controller_a_per_m=controller,
        performance_bound=w1,
        bandwidth_bound=w3,
    )


def _poles(low: float, high: float) -> PoleStudy:
    masses = np.linspace(low, high, 9) if high > low else np.array([low])
    rows = [np.roots([m, m * POLE, K_I * GAIN - K_Z, K_I * GAIN * ZERO - K_Z * POLE]) for m in masses]
    return PoleStudy(masses, np.full(masses.size, K_Z), np.full(masses.size, K_I), np.array(rows, dtype=complex))


def _steps(low: float, high: float) -> tuple[StepOutcome, ...]:
    return tuple(
        lead_step(mass, prefilter=prefilter) for prefilter in (None, PREFILTER) for mass in dict.fromkeys((low, high))
    )


def lead_step(mass: float, *, prefilter: Mapping[str, float] | None = None, touches: bool = False) -> StepOutcome:
    """A step response that settles in about a millisecond, or that ends at the stator."""
    time = np.linspace(0.0, 2e-4 if touches else 6e-3, 301)
    slowness = 1e-4 * mass
    shape = 1.0 - np.exp(-time / slowness) * (1.0 + time / slowness)
    position = 4e-4 * np.sinh(8.0 * time / time[-1]) / np.sinh(8.0) if touches else 1e-5 * shape
    current = 8.0 * mass * np.exp(-time / slowness) * np.cos(time / slowness)
    return StepOutcome(
        mass_kg=mass,
        step_m=1e-5,
        model="nonlinear",
        controller="mu_convex",
        scenario={"step_m": 1e-5, "model": "nonlinear", "mass_kg": mass, "prefilter": prefilter},
        end="touched_down" if touches else "finished",
        sentence="the rotor met the stator" if touches else "",
        settling_time_s=None if touches else 6.0 * slowness,
        overshoot=None if touches else 0.0,
        rise_time_s=None if touches else 2.0 * slowness,
        peak_current_a=float(np.abs(current).max()),
        final_error_m=None if touches else 1e-9,
        time_s=time,
        position_m=position,
        current_a=current,
        reference_m=np.full(time.shape, 1e-5),
        linear_position_m=1e-5 * shape,
        linear_current_a=0.9 * current,
    )


def study_of(*outcomes: CaseOutcome, figures: tuple[str, ...] = ("mu", "sensitivity", "step")) -> StudyResults:
    """A study with these cases."""
    return StudyResults(
        "a study",
        "magbear: 1\nname: a study\n",
        outcomes,
        {"figures": list(figures)},
        {"magbear": "1.0", "numpy": "2.0"},
    )


@pytest.fixture(scope="session")
def make_case() -> Callable[..., CaseOutcome]:
    """A function from an index and what is asked to a case."""
    return lambda index=0, **asked: lead_case(index, Asked(**asked))


@pytest.fixture(scope="session")
def make_step() -> Callable[..., StepOutcome]:
    """A function that makes a step response."""
    return lead_step


@pytest.fixture(scope="session")
def make_study() -> Callable[..., StudyResults]:
    """A function from cases to a study."""
    return study_of


@pytest.fixture(scope="session")
def mixed_study(make_case: Callable[..., CaseOutcome]) -> StudyResults:
    """A study with a case of every ending, a sweep of the limit, and two controllers for one problem."""
    fixed = {"method": "fixed_order", "order": 1}
    good = make_case(0)
    fallen = replace(good.steps[0], **vars(lead_step(3.0, touches=True)))
    proof, sought = "a dual certificate proves it", "the best found reaches 1.04"
    return study_of(
        replace(good, steps=(fallen, *good.steps[1:])),
        make_case(1, controller=fixed, steps=False),
        make_case(2, omega_c_rad_s=9000.0, status=Status.NOT_ACHIEVED, sentence=sought, steps=False),
        make_case(3, omega_c_rad_s=4000.0, status=Status.INFEASIBLE, sentence=proof, curves=False),
        make_case(4, omega_c_rad_s=5000.0, status=Status.CRASHED, sentence="the worker was killed", curves=False),
        figures=("mu", "sensitivity", "nyquist", "controller_gain", "step", "poles", "limitation"),
    )


@pytest.fixture(scope="session")
def mixed_report(mixed_study: StudyResults, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of the report of the mixed study."""
    return write_report(mixed_study, tmp_path_factory.mktemp("report")).parent

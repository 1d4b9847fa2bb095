"""What is known of a case when it has ended; every array with the masses and frequencies it stands on.

Floors above only store, draw and print this. All figures in SI units; NaN or None where a figure has no meaning.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import Status
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.table import Table

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_NO_SAMPLES = np.zeros(0)
_NOTHING: Mapping[str, Any] = {}  # held once for many


@dataclass(frozen=True)
class Summary:
    """The figures of a case that fit in one row of a table."""

    level: float = float("nan")  # what the method believes it reached
    peak_mu: float | None = None  # upper bound, complex blocks
    peak_mu_lower: float | None = None
    worst_case: float | None = None  # exact over the real mass range
    worst_mass_kg: float | None = None  # of the member with the worst case, and its stiffnesses
    worst_negative_stiffness_n_per_m: float | None = None
    worst_current_stiffness_n_per_a: float | None = None
    worst_omega_rad_s: float | None = None
    order: int | None = None
    peak_gain_a_per_m: float | None = None
    peak_ks_a_per_m: float | None = None  # nominal mass
    peak_sensitivity: float | None = None  # worst over the masses
    iso_zone: str | None = None  # ISO 14839-3: A, B, C or D
    gain_margin_low: float | None = None  # factor by which the loop gain may fall
    gain_margin_high: float | None = None  # factor by which it may rise
    phase_margin_deg: float | None = None
    disk_margin: float | None = None
    max_pole_real_rad_s: float | None = None  # over the mass range
    mu_flatness: float | None = None  # 1 − min/max of mu over 10 … 1e5 rad/s
    worst_case_proven: float | None = None  # this controller's worst case is below it, for all ω: proven
    omega_c_feasible_rad_s: float | None = None  # method limit: the bandwidth limit that is proven met
    omega_c_infeasible_rad_s: float | None = None  # and one that is proven impossible
    lower_bound: float | None = None  # every linear controller's worst case is above it: proven
    verified: bool = False  # proven to meet the specification
    verification_sentence: str = ""


@dataclass(frozen=True)
class FrequencyStudy:
    """The loop over frequency, for sample members (rows) and frequencies (columns)."""

    omega_rad_s: Floats  # (w,)
    masses_kg: Floats  # (k,)
    negative_stiffness_n_per_m: Floats  # (k,)
    current_stiffness_n_per_a: Floats  # (k,)
    mu_upper: Floats  # (w,)
    mu_lower: Floats  # (w,)
    worst_case: Floats  # (w,) max over the mass range of |W1 S| + |W3 T|
    sensitivity: Complexes  # (k, w)
    complementary_sensitivity: Complexes  # (k, w)
    control_sensitivity_a_per_m: Complexes  # (k, w) K S
    controller_a_per_m: Complexes  # (w,)
    performance_bound: Floats  # (w,) |W1|
    bandwidth_bound: Floats  # (w,) |W3|, zero without a limit


@dataclass(frozen=True)
class PoleStudy:
    """Closed-loop poles along the family of plants."""

    masses_kg: Floats  # (k,)
    negative_stiffness_n_per_m: Floats  # (k,)
    current_stiffness_n_per_a: Floats  # (k,)
    poles_rad_s: Complexes  # (k, n)


@dataclass(frozen=True)
class ImpossibilityProof:
    """A checked certificate: every linear controller's worst case is above the level (decision 0010).

    Coefficients and poles are those of ``model.impossibility_certificate``.
    """

    level: float
    x_poles_rad_s: Floats
    x_coefficients: Floats
    y_poles_rad_s: Floats
    y_coefficients: Floats
    y_pairs: Floats  # (m, 4)
    sentence: str


@dataclass(frozen=True)
class StepOutcome:
    """One simulated step response."""

    mass_kg: float
    step_m: float
    model: str  # linear or nonlinear
    controller: str
    scenario: Mapping[str, Any]  # the resolved entry of `simulate`
    end: str  # finished, touched_down, not_finite, diverged, not_begun
    sentence: str
    settling_time_s: float | None
    overshoot: float | None  # fraction of the way to where it comes to rest
    rise_time_s: float | None
    peak_current_a: float | None
    final_error_m: float | None
    time_s: Floats
    position_m: Floats
    current_a: Floats
    reference_m: Floats
    linear_position_m: Floats  # the linear model beside it, same times
    linear_current_a: Floats

    @property
    def touched_down(self) -> bool:
        """Whether the rotor met the stator."""
        return self.end == "touched_down"

    def without_samples(self) -> StepOutcome:
        """The same without its curves; when it ended is kept."""
        names = ("position_m", "current_a", "reference_m", "linear_position_m", "linear_current_a")
        curves: dict[str, Any] = dict.fromkeys(names, _NO_SAMPLES)
        return replace(self, time_s=self.time_s[-1:].copy(), **curves)


@dataclass(frozen=True)
class CaseOutcome:
    """A case that ended, however it ended."""

    case_id: str  # hex digest of the canonical inputs
    index: int  # place in the study, from 0
    inputs: Mapping[str, Any]  # the resolved, canonical inputs: plain JSON values
    status: Status
    sentence: str = ""
    summary: Summary = field(default_factory=Summary)
    controller: StateSpace | None = None
    frequency: FrequencyStudy | None = None
    poles: PoleStudy | None = None
    steps: tuple[StepOutcome, ...] = ()
    statistics: Mapping[str, float] = field(default_factory=dict)
    impossibility: ImpossibilityProof | None = None
    tables: Mapping[str, Table] = field(default_factory=dict)  # by name, what the method shows beside its controller

    def without_samples(self) -> CaseOutcome:
        """The same without its arrays: what a reader of many cases keeps of each."""
        steps = tuple(step.without_samples() for step in self.steps)
        nothing: dict[str, Any] = dict.fromkeys(("controller", "frequency", "poles", "impossibility"))
        return replace(self, steps=steps, statistics=_NOTHING, tables=_NOTHING, **nothing)

    @property
    def method(self) -> str:
        """The synthesis method."""
        return str(self.inputs["controller"]["method"])

    @property
    def mass_kg(self) -> float | list[float]:
        """One mass, or the range."""
        mass: float | list[float] = self.inputs["mass_kg"]
        return mass

    @property
    def omega_c_rad_s(self) -> float | None:
        """The bandwidth limit, or None."""
        bandwidth = self.inputs.get("bandwidth")
        return None if bandwidth is None else float(bandwidth["omega_c_rad_s"])


@dataclass(frozen=True)
class StudyResults:
    """All that a results file holds: the study as given, its outcomes in order, and where they came from."""

    name: str
    study_text: str  # the study file as given
    outcomes: tuple[CaseOutcome, ...]
    report: Mapping[str, Any]  # the resolved `report` section
    provenance: Mapping[str, str]  # versions, platform, BLAS; nothing that changes from run to run

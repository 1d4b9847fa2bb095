"""The names, units, axes and meanings of everything stored: the one list that shards and results files follow.

A dataset has the name of the attribute it holds. Axes have the names of their coordinates; an axis without a measured
coordinate is counted from 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from magbear_cli.lti.state_space import StateSpace
from magbear_cli.study.outcome import FrequencyStudy, ImpossibilityProof, PoleStudy, StepOutcome, Summary

LAYOUT_VERSION = 5  # raised when a dataset changes its name, unit, axes or meaning


class Kind(StrEnum):
    """What the numbers of a dataset are."""

    NUMBER = "number"  # float64
    COMPLEX = "complex"  # float64 with a last axis of two, real and imaginary part
    INTEGER = "integer"  # int64
    FLAG = "flag"  # uint8, 0 or 1
    TEXT = "text"  # fixed length, padded with zeros
    JSON = "json"  # text that holds plain values


@dataclass(frozen=True)
class Field:
    """One dataset: its name, its unit, its meaning, its axes (none: one value) and the kind of its numbers."""

    name: str
    long_name: str
    unit: str = "1"
    axes: tuple[str, ...] = ()
    kind: Kind = Kind.NUMBER


@dataclass(frozen=True)
class Group:
    """A group of datasets that together are one object of the study room.

    ``signal`` and ``axes`` name what a viewer plots first.
    """

    name: str
    holds: type
    fields: tuple[Field, ...]
    signal: str = ""
    axes: tuple[str, ...] = ()


COUNTED_AXES = {
    "case": "case number, counted from 1",
    "part": "part of a complex number: 1 real, 2 imaginary",
    "entry": "number of the entry",
    "state_rate": "row of the state equation",
    "state": "state of the controller",
    "input": "input of the controller: measured position",
    "output": "output of the controller: control current",
    "pole": "closed-loop pole, sorted",
    "x_lag": "lag of G_X, slowest first",
    "y_lag": "lag of G_Y, slowest first",
    "x_term": "constant of G_X, then its lags but the slowest",
    "y_term": "constant of G_Y, then its lags",
    "y_pair": "second-order term of G_Y",
    "pair_number": "number of a second-order term: n, damping, a, b",
}

OMEGA = ("omega_rad_s",)
MASS = ("masses_kg",)
TIME = ("time_s",)

SUMMARY = Group(
    "summary",
    Summary,
    (
        Field("level", "performance level the method believes it reached"),
        Field("peak_mu", "largest upper bound of the structured singular value, complex blocks"),
        Field("peak_mu_lower", "largest lower bound of the structured singular value, complex blocks"),
        Field("worst_case", "largest abs(W1 S) + abs(W3 T) over frequency and the real mass range"),
        Field("worst_mass_kg", "mass of the member with the worst case", "kg"),
        Field("worst_negative_stiffness_n_per_m", "negative stiffness of the member with the worst case", "N/m"),
        Field("worst_current_stiffness_n_per_a", "current stiffness of the member with the worst case", "N/A"),
        Field("worst_omega_rad_s", "angular frequency at which the worst case is taken", "rad/s"),
        Field("order", "number of controller states", kind=Kind.INTEGER),
        Field("peak_gain_a_per_m", "largest controller gain over frequency", "A/m"),
        Field("peak_ks_a_per_m", "largest abs(K S) over frequency at the nominal mass", "A/m"),
        Field("peak_sensitivity", "largest abs(S) over frequency and masses"),
        Field("iso_zone", "zone of ISO 14839-3 for the peak of the sensitivity", kind=Kind.TEXT),
        Field("gain_margin_low", "factor by which the loop gain may fall"),
        Field("gain_margin_high", "factor by which the loop gain may rise"),
        Field("phase_margin_deg", "phase margin", "degree"),
        Field("disk_margin", "disk margin"),
        Field("max_pole_real_rad_s", "largest real part of a closed-loop pole over the mass range", "rad/s"),
        Field("mu_flatness", "1 - min/max of the structured singular value from 10 to 1e5 rad/s"),
        Field("worst_case_proven", "proven upper bound of this controller's worst case over all frequencies"),
        Field("omega_c_feasible_rad_s", "bandwidth limit that the controller is proven to meet, method limit", "rad/s"),
        Field(
            "omega_c_infeasible_rad_s", "bandwidth limit proven impossible for linear control, method limit", "rad/s"
        ),
        Field("lower_bound", "proven lower bound of the worst case of every linear controller"),
        Field("verified", "whether the controller is proven to meet the specification", kind=Kind.FLAG),
        Field("verification_sentence", "what the independent check found", kind=Kind.TEXT),
    ),
)

CONTROLLER = Group(
    "controller",
    StateSpace,
    (
        Field("a", "state matrix A: dx/dt = A x + B y", "1/s", ("state_rate", "state")),
        Field("b", "input matrix B: dx/dt = A x + B y", "1", ("state_rate", "input")),
        Field("c", "output matrix C: u = C x + D y", "1", ("output", "state")),
        Field("d", "direct matrix D: u = C x + D y", "A/m", ("output", "input")),
    ),
)

FREQUENCY = Group(
    "frequency",
    FrequencyStudy,
    (
        Field("omega_rad_s", "angular frequency", "rad/s", OMEGA),
        Field("masses_kg", "rotor mass of a member of the family", "kg", MASS),
        Field("negative_stiffness_n_per_m", "negative stiffness of a member", "N/m", MASS),
        Field("current_stiffness_n_per_a", "current stiffness of a member", "N/A", MASS),
        Field("mu_upper", "upper bound of the structured singular value, complex blocks", "1", OMEGA),
        Field("mu_lower", "lower bound of the structured singular value, complex blocks", "1", OMEGA),
        Field("worst_case", "largest abs(W1 S) + abs(W3 T) over the mass range", "1", OMEGA),
        Field("sensitivity", "sensitivity S", "1", MASS + OMEGA, Kind.COMPLEX),
        Field("complementary_sensitivity", "complementary sensitivity T", "1", MASS + OMEGA, Kind.COMPLEX),
        Field("control_sensitivity_a_per_m", "control sensitivity K S", "A/m", MASS + OMEGA, Kind.COMPLEX),
        Field("controller_a_per_m", "controller K", "A/m", OMEGA, Kind.COMPLEX),
        Field("performance_bound", "performance weight abs(W1)", "1", OMEGA),
        Field("bandwidth_bound", "bandwidth weight abs(W3), zero without a limit", "1", OMEGA),
    ),
    "worst_case",
    OMEGA,
)

POLES = Group(
    "poles",
    PoleStudy,
    (
        Field("masses_kg", "rotor mass of a member of the family", "kg", MASS),
        Field("negative_stiffness_n_per_m", "negative stiffness of a member", "N/m", MASS),
        Field("current_stiffness_n_per_a", "current stiffness of a member", "N/A", MASS),
        Field("poles_rad_s", "closed-loop poles", "rad/s", (*MASS, "pole"), Kind.COMPLEX),
    ),
)

IMPOSSIBILITY = Group(
    "impossibility",
    ImpossibilityProof,
    (
        Field("level", "every linear controller's worst case is above this level"),
        Field("x_poles_rad_s", "poles of G_X, negated", "rad/s", ("x_lag",)),
        Field("x_coefficients", "constant of G_X, then the coefficients of all lags but the slowest", "1", ("x_term",)),
        Field("y_poles_rad_s", "poles of G_Y, negated", "rad/s", ("y_lag",)),
        Field("y_coefficients", "constant of G_Y, then the coefficients of the lags", "1", ("y_term",)),
        Field("y_pairs", "second-order terms of G_Y: n in rad/s, damping, a, b", "1", ("y_pair", "pair_number")),
        Field("sentence", "what the checker found", kind=Kind.TEXT),
    ),
)

STEP = Group(
    "step",
    StepOutcome,
    (
        Field("mass_kg", "rotor mass", "kg"),
        Field("step_m", "height of the step", "m"),
        Field("model", "model of the bearing: linear or nonlinear", kind=Kind.TEXT),
        Field("controller", "controller in the loop", kind=Kind.TEXT),
        Field("scenario", "resolved entry of simulate", kind=Kind.JSON),
        Field("end", "how the simulation ended", kind=Kind.TEXT),
        Field("sentence", "why it ended so", kind=Kind.TEXT),
        Field("settling_time_s", "settling time to 2 %", "s"),
        Field("overshoot", "overshoot as a fraction of the way to where it comes to rest"),
        Field("rise_time_s", "rise time from 10 % to 90 %", "s"),
        Field("peak_current_a", "largest control current", "A"),
        Field("final_error_m", "error at the end", "m"),
        Field("time_s", "time", "s", TIME),
        Field("position_m", "rotor position", "m", TIME),
        Field("current_a", "control current", "A", TIME),
        Field("reference_m", "commanded position", "m", TIME),
        Field("linear_position_m", "rotor position of the linear model", "m", TIME),
        Field("linear_current_a", "control current of the linear model", "A", TIME),
    ),
    "position_m",
    TIME,
)

CASE_FIELDS = (
    Field("case_id", "identity of the case: digest of its inputs", kind=Kind.TEXT),
    Field("status", "how the case ended", kind=Kind.TEXT),
    Field("sentence", "why it ended so", kind=Kind.TEXT),
    Field("inputs", "resolved, canonical inputs", kind=Kind.JSON),
)

TABLE_FIELDS = (
    Field("case_id", "identity of the case: digest of its inputs", kind=Kind.TEXT),
    Field("group", "group of this file that holds the case", kind=Kind.TEXT),
    Field("status", "how the case ended", kind=Kind.TEXT),
    Field("sentence", "why it ended so", kind=Kind.TEXT),
    Field("method", "synthesis method", kind=Kind.TEXT),
    Field("mass_low_kg", "lower end of the mass range", "kg"),
    Field("mass_high_kg", "upper end of the mass range", "kg"),
    Field("omega_c_rad_s", "bandwidth limit, NaN without one", "rad/s"),
    *SUMMARY.fields,
    Field("steps", "number of simulated steps", kind=Kind.INTEGER),
)

STUDY_FIELDS = (
    Field("name", "name of the study", kind=Kind.TEXT),
    Field("study_text", "the study file as given", kind=Kind.TEXT),
    Field("report", "resolved report section", kind=Kind.JSON),
)

STATISTIC = (
    Field("name", "name of the statistic", axes=("entry",), kind=Kind.TEXT),
    Field("value", "value of the statistic", "1", ("entry",)),
)

TABLE_TITLE = (Field("title", "what the table shows", kind=Kind.TEXT),)

COLUMN = (
    Field("name", "name of the column", axes=("entry",), kind=Kind.TEXT),
    Field("unit", "unit of the column", axes=("entry",), kind=Kind.TEXT),
    Field("long_name", "what the column holds", axes=("entry",), kind=Kind.TEXT),
)

ORIGIN = (
    Field("key", "what the text tells", axes=("entry",), kind=Kind.TEXT),
    Field("text", "version, platform or setting", axes=("entry",), kind=Kind.TEXT),
)

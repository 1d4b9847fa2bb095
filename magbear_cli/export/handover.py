"""What is handed over of a case: its controller, what it is for, and numbers by which a receiver can check himself."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import InputError
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.bearing import Bearing
from magbear_cli.model.family import Plant
from magbear_cli.model.problem import ControlProblem
from magbear_cli.study.building import build_bearing, mass_ends_kg
from magbear_cli.study.members import Uncertainty, end_members, uncertainty
from magbear_cli.study.outcome import CaseOutcome
from magbear_cli.study.sampling import SampledDesign, problem_of
from magbear_cli.study.summary import case_document

Floats = NDArray[np.float64]

TEST_SAMPLES = 200
BETWEEN = "(m w^2 + k_z)/k_i lies between those of the members at every w in rad/s, and every value between occurs"
MEMBERS = {
    Uncertainty.MASS: "the mass uncertain between",
    Uncertainty.NEGATIVE_STIFFNESS: "the negative stiffness k_z uncertain between",
    Uncertainty.FORCE_CONSTANT: "the force constant, and k_i and k_z with it, uncertain between",
    Uncertainty.CURRENT_STIFFNESS: "the current stiffness k_i uncertain between",
    Uncertainty.SEVERAL: "several parameters uncertain, the ends of the family",
}
_AMPLITUDE_M = 10.0e-6


@dataclass(frozen=True, eq=False)
class Handover:
    """One controller for other tools: u = K y, measured position y in m, control current u in A."""

    name: str  # an identifier in every language
    study: str
    outcome: CaseOutcome
    controller: StateSpace
    sampled: SampledDesign | None = None

    @property
    def problem(self) -> ControlProblem:
        """What the controller was designed for."""
        return problem_of(self.outcome)

    @property
    def bearing(self) -> Bearing:
        """The magnets."""
        return build_bearing(self.outcome.inputs)

    @property
    def summary(self) -> str:
        """The controller in a line."""
        worst = self.outcome.summary.worst_case
        told = "" if worst is None else f", worst case {worst:.4g}"
        return (
            f"study {self.study}, case {self.outcome.case_id}: {self.outcome.method}, order {self.controller.order}, "
            f"status {self.outcome.status.value}{told}"
        )

    @property
    def members(self) -> tuple[Plant, ...]:
        """The ends of the family of plants that the controller is for; one where nothing is uncertain."""
        return end_members(self.outcome.inputs)

    @property
    def family(self) -> tuple[str, ...]:
        """The plants and what is asked of their loops, in lines of ASCII: enough to compute the worst case anew."""
        weight, limit = self.problem.performance, self.problem.omega_c_rad_s
        about = MEMBERS[uncertainty(self.outcome.inputs)] if len(self.members) > 1 else "known"
        ends = [
            f"member: m = {one.mass_kg!r} kg, k_i = {one.current_stiffness_n_per_a!r} N/A, "
            f"k_z = {one.negative_stiffness_n_per_m!r} N/m"
            for one in self.members
        ]
        between = f"Of every plant {BETWEEN}." if len(ends) > 1 else ""
        bandwidth = "no W3" if limit is None else f"W3 = s^2/wc^2, wc = {limit!r} rad/s"
        return (
            f"Plant k_i/(m s^2 - k_z), {about}:",
            *ends,
            *([between] if between else []),
            f"Level |W1 S| + |W3 T|, {bandwidth}, W1 by descending powers of s:",
            f"num {[float(one) for one in weight.num]}",
            f"den {[float(one) for one in weight.den]}",
        )

    @cached_property
    def test_positions_m(self) -> Floats:
        """Samples (n,) for a test of what was made of a sampled controller: a step, then a rising tone about it."""
        k = np.arange(TEST_SAMPLES)
        return np.asarray(_AMPLITUDE_M * np.where(k < 20, 1.0, 0.5 + 0.5 * np.sin(0.002 * (k - 20.0) ** 2)))

    @cached_property
    def test_currents_a(self) -> Floats:
        """The answer (n,) of the sampled controller to the test's positions, from rest."""
        if self.sampled is None:
            raise InputError("only a sampled controller has a test vector: give --sample-time")
        return self.sampled.controller.output(self.test_positions_m)

    def document(self) -> dict[str, Any]:
        """All but the controller's matrices as plain JSON."""
        problem, bearing = self.problem, self.bearing
        return {
            "study": self.study,
            "case": case_document(self.outcome),
            "units": {"input": "m", "output": "A", "time": "s"},
            "convention": "u = K y, positive feedback; plant k_i/(m s^2 - k_z)",
            "specification": {
                "level": "|W1 S| + |W3 T|, W3 = s^2/omega_c^2",
                "performance": {"num": list(problem.performance.num), "den": list(problem.performance.den)},
                "omega_c_rad_s": problem.omega_c_rad_s,
            },
            "plant": {
                "uncertain": uncertainty(self.outcome.inputs).value if len(self.members) > 1 else None,
                "members": [asdict(one) for one in self.members],
                "between": BETWEEN,
                "nominal": asdict(problem.nominal),
                "current_stiffness_n_per_a": problem.nominal.current_stiffness_n_per_a,
                "negative_stiffness_n_per_m": problem.nominal.negative_stiffness_n_per_m,
                "mass_kg": list(mass_ends_kg(self.outcome.inputs)),
                "air_gap_m": bearing.air_gap_m,
                "bias_current_a": bearing.bias_current_a,
                "force_constant_n_m2_per_a2": bearing.force_constant_n_m2_per_a2,
                "current_law": bearing.current_law.value,
            },
        }


def identifier(text: str) -> str:
    """The text as a name that every language takes: letters, digits and underscores, a letter first.

    Raises
    ------
    InputError
        when nothing of it is left.
    """
    name = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_").lower()
    if not name:
        raise InputError(f"'{text}' is no name: use letters, digits and underscores")
    return name if name[0].isalpha() else f"k_{name}"


def matrices(system: StateSpace) -> Mapping[str, list[list[float]]]:
    """A, B, C and D as lists."""
    return {name: getattr(system, name).tolist() for name in ("a", "b", "c", "d")}

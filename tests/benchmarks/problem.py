"""The problem behind the rows: the thesis's thrust bearing, 3.0-4.5 kg, 20 000 rad/s, and a controller of 33 states."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.bearing import Bearing
from magbear_cli.model.problem import ControlProblem
from magbear_cli.spec import read_study_text
from magbear_cli.study.building import build_bearing, build_problem

STUDY = """\
magbear: 1
name: benchmark
bearing: thesis_thrust
mass_kg: [3.0, 4.5]
performance: {dc_gain: 10, corner_rad_s: 200}
bandwidth: {omega_c_rad_s: 20000}
controller: {method: lqg}
"""
CONTROLLER = Path(__file__).parent / "controller_33.json"


def case_of(controller: Mapping[str, Any]) -> dict[str, Any]:
    """The resolved inputs of the problem with a method, every option of it at its default unless given."""
    text = STUDY.replace("{method: lqg}", json.dumps(controller))
    return dict(next(iter(read_study_text(text, "the benchmark").cases())))


def bearing() -> Bearing:
    """The thesis's thrust bearing."""
    return build_bearing(case_of({"method": "lqg"}))


def control_problem() -> ControlProblem:
    """3.0-4.5 kg at 20 000 rad/s."""
    return build_problem(case_of({"method": "lqg"}))


def controller_of_33_states() -> StateSpace:
    """What ``mu_dk`` with d_order 5, fit_every_scale and gamma_tolerance 0.1 found: poles from 23 to 3.3e5 rad/s."""
    matrices = json.loads(CONTROLLER.read_text("utf-8"))
    return StateSpace.of(*(matrices[name] for name in "abcd"))

"""``magbear limits``: the bracket of one mass range, with both of its proofs."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from magbear_cli.analysis.certificate import check_certificate
from magbear_cli.analysis.gridless import prove_level
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.impossibility_certificate import ImpossibilityCertificate
from magbear_cli.model.problem import ControlProblem, MassRange, RationalWeight

Command = Callable[..., Any]


def test_both_sides_are_proven_from_what_is_stored(command: Command, tmp_path: Path) -> None:
    """For 3.0-4.5 kg the bracket holds the limit near 5 100 rad/s, and both stored proofs can be checked again."""
    ended = command("limits", "--mass", "3.0:4.5", "--tol", "0.02", "-o", "limits.json", "--json")
    assert ended.code == 0
    (curve,) = json.loads(ended.out)["curves"]
    assert curve["mass_kg"] == [3.0, 4.5]
    assert curve["verified"] is True
    assert 4950.0 < curve["omega_c_infeasible"] < curve["omega_c_feasible"] < 5150.0
    assert curve["omega_c_feasible"] <= 1.021 * curve["omega_c_infeasible"]
    (kept,) = json.loads((tmp_path / "limits.json").read_text("utf-8"))["curves"]
    weight = RationalWeight.low_pass(10.0, 200.0)

    def problem(omega_c: float) -> ControlProblem:
        return ControlProblem(62500.0, 50.0, MassRange(3.0, 4.5), weight, omega_c)

    controller = StateSpace.of(*(kept["controller"][name] for name in "abcd"))
    assert controller.order == curve["controller_order"]
    assert prove_level(problem(curve["omega_c_feasible"]), controller, 1.0).proved
    certificate = ImpossibilityCertificate.of_numbers(kept["certificate"])
    assert check_certificate(problem(curve["omega_c_infeasible"]), certificate).valid
    assert not check_certificate(problem(curve["omega_c_feasible"]), certificate).valid


@pytest.mark.parametrize("mass", ["4.5:3.0", "x", "3.0:"])
def test_a_range_that_is_none_is_a_mistake_of_the_command_line(command: Command, mass: str) -> None:
    """The sentence comes with exit code 2."""
    ended = command("limits", "--mass", mass)
    assert ended.code == 2
    assert "Traceback" not in ended.err

"""``magbear limits``: brackets with both of their proofs, over masses and other keys, and against a baseline."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from magbear_cli.spec import compile_limits, read_study, read_study_text
from magbear_cli.store.results import read_results
from magbear_cli.study.building import build_problem
from magbear_cli.study.checking import check_proofs

Command = Callable[..., Any]

QUICK = ("--tol", "0.03", "--set", "controller.max_order=6", "-j", "1")
PUBLIC = ["mass_kg", "omega_c_feasible", "omega_c_infeasible", "controller_order", "verified"]


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with one quick bracket, run in ``out`` and printed into ``baseline.json``."""
    folder = tmp_path_factory.mktemp("bracketed")
    line = [sys.executable, "-m", "magbear_cli", "limits", "--mass", "3.0:4.5", *QUICK, "-o", "out", "--json"]
    done = subprocess.run(line, capture_output=True, encoding="utf-8", check=False, cwd=folder)
    assert done.returncode == 0, done.stderr
    (folder / "baseline.json").write_text(done.stdout, "utf-8")
    return folder


@pytest.fixture
def bracketed(kept: Path, tmp_path: Path) -> dict[str, Any]:
    """The document of that bracket, its run and its baseline copied to where the test works."""
    shutil.copytree(kept, tmp_path, dirs_exist_ok=True)
    document: dict[str, Any] = json.loads((kept / "baseline.json").read_text("utf-8"))
    return document


def test_both_sides_are_proven_and_kept(bracketed: dict[str, Any], command: Command, tmp_path: Path) -> None:
    """For 3.0-4.5 kg the bracket holds the limit near 5 070 rad/s; what is stored convinces the checkers again."""
    (curve,) = bracketed["curves"]
    assert list(curve)[:5] == PUBLIC
    assert curve["mass_kg"] == [3.0, 4.5]
    assert curve["verified"] is True
    assert curve["certified"] is True
    assert curve["omega_c_infeasible"] < 5091.0
    assert curve["omega_c_feasible"] > 5045.0
    assert curve["omega_c_feasible"] <= 1.031 * curve["omega_c_infeasible"]
    (outcome,) = read_results(tmp_path / "out" / "results.h5").outcomes
    assert [check.holds for check in check_proofs(outcome)] == [True, True]
    assert outcome.controller is not None
    assert outcome.controller.order == curve["controller_order"]
    page = (tmp_path / "out" / "report" / "index.html").read_text("utf-8")
    assert "proven" in page
    for name in ("figures/limits.svg", "figures/limits.png", "figures/limits.pdf", "tables/limits.csv"):
        assert (tmp_path / "out" / "report" / name).is_file()
    again = command("limits", "--mass", "3.0:4.5", *QUICK, "-o", "out", "--json")
    assert "nothing to compute" in again.err
    assert json.loads(again.out) == bracketed


def test_stored_proofs_are_checked_by_a_command(bracketed: dict[str, Any], command: Command, tmp_path: Path) -> None:
    """Both proofs hold; a number changed in the file is noticed before any proof is looked at."""
    assert bracketed["curves"]
    ended = command("verify", "out")
    assert ended.code == 0
    assert ended.out.count("holds") == 2
    assert "2 proofs checked, none failed" in ended.err
    (row,) = {row["case_id"] for row in json.loads(command("verify", "out", "--json").out)["proofs"]}
    assert row in ended.out
    assert command("verify", tmp_path / "baseline.json").code == 2


def test_a_baseline_is_kept_until_a_weight_changes(bracketed: dict[str, Any], command: Command, tmp_path: Path) -> None:
    """The same curve agrees with exit 0; a higher corner of W1 moves it, which is told and ends with exit 1."""
    assert bracketed["curves"]
    same = command("limits", "--mass", "3.0:4.5", *QUICK, "-o", "out", "--check", tmp_path / "baseline.json")
    assert same.code == 0
    assert "no differences" in same.err
    single = {**bracketed["curves"][0], "mass_kg": 3.0, "omega_c_infeasible": 4250.0, "omega_c_feasible": 4380.0}
    (tmp_path / "single.json").write_text(json.dumps({"curves": [single]}), "utf-8")
    moved = command(
        "limits", "--mass", "3.0", *QUICK, "--set", "performance.corner_rad_s=240", "-o", "other",
        "--check", tmp_path / "single.json",
    )  # fmt: skip
    assert moved.code == 1
    assert "omega_c_feasible moved from" in moved.err


def test_a_curve_over_another_key(command: Command) -> None:
    """A lower corner of W1 is met by a smaller bandwidth; each curve says what it is for."""
    ended = command(
        "limits", "--mass", "3.6", "--over", "performance.corner_rad_s=100,200", "--tol", "0.05",
        "--set", "controller.max_order=4", "-j", "1", "-o", "out", "--json",
    )  # fmt: skip
    assert ended.code == 0, ended.err
    curves = json.loads(ended.out)["curves"]
    assert [curve["over"] for curve in curves] == [
        {"performance.corner_rad_s": 100.0},
        {"performance.corner_rad_s": 200.0},
    ]
    assert curves[0]["omega_c_feasible"] < curves[1]["omega_c_infeasible"]
    assert command("show", "out").code == 0


@pytest.mark.parametrize(
    ("line", "says"),
    [
        (["--mass", "4.5:3.0"], "must rise"),
        (["--mass", "x"], "not a number"),
        (["--mass", "3.0:"], "not a number"),
        (["--over", "performance.corner_rad_s"], "does not sweep it"),
        (["--over", "performance.corner_rad_s=9:1:3"], "lower end first"),
        (["--over", "performance.corner_rad_s=1,2", "--over", "performance.corner_rad_s=3,4"], "twice"),
        (["--over", "performance.cornr_rad_s=1,2"], "did you mean 'performance.corner_rad_s'"),
        (["--check", "nowhere.json"], "cannot be read"),
        (["--check", "odd.json"], 'does not hold "curves"'),
        (["--check", "text.json"], "not JSON"),
        (["--tol", "2"], "0.5"),
        (["--set", "bandwidth.omega_c_rad_s=1000"], "seeks bandwidth.omega_c_rad_s itself"),
    ],
)
def test_mistakes_are_told_before_anything_is_computed(
    command: Command, tmp_path: Path, line: list[str], says: str
) -> None:
    """One sentence with the remedy and exit code 2."""
    (tmp_path / "odd.json").write_text('{"curves": [{"mass_kg": 3}]}', "utf-8")
    (tmp_path / "text.json").write_text("curves", "utf-8")
    ended = command("limits", *line)
    assert ended.code == 2
    assert says in ended.err
    assert "Traceback" not in ended.err
    assert not (tmp_path / "out").exists()


def test_the_compiled_study_seeks_limits_only() -> None:
    """Controllers, bandwidth limits and simulations of the base are put aside, its other sweeps stay."""
    base = """\
magbear: 1
name: base
bearing: thesis_thrust
mass_kg: [3.0, 4.5]
performance: {dc_gain: 10, corner_rad_s: 200}
bandwidth: {omega_c_rad_s: 20000}
controller: {method: lqg}
simulate: [{step_m: 1.0e-5}]
sweep:
  bandwidth.omega_c_rad_s: [1000, 2000]
  controller: [{method: lqg}, {method: hinf}]
  performance.corner_rad_s: [100, 200]
  bearing.air_gap_m: [400.0e-6, 500.0e-6]
"""
    study = read_study_text(compile_limits([], [], None, base), "the limits")
    cases = list(study.cases())
    assert len(cases) == 4
    assert {case["controller"]["method"] for case in cases} == {"limit"}
    assert all(case["bandwidth"] is None and case["simulate"] == [] for case in cases)
    over = read_study_text(compile_limits([(3.0, 4.0)], ["bearing.air_gap_m"], 0.02, base), "the limits")
    assert over.sweep == {"bearing.air_gap_m": [400.0e-6, 500.0e-6]}
    (first, _) = over.cases()
    assert first["mass_kg"] == [3.0, 4.0]
    assert first["controller"]["tolerance"] == 0.02
    assert build_problem(first).omega_c_rad_s is None


@pytest.mark.parametrize(
    "rest",
    [
        "bandwidth: {omega_c_rad_s: 5000}\ncontroller: {method: limit}\n",
        "controller: {method: mu_convex}\nreduction: {order: 3}\n",
        "controller: {method: nothing}\nbandwidth: 3\nsimulate: [{step_m: 1.0e-5, prefilter: gone.yaml}]\n",
        "sweep: {controller: [{method: nothing}], bandwidth.omega_c_rad_s: [1000, -2]}\nreport: {figures: [none]}\n",
        "",
    ],
)
def test_what_a_limit_does_not_look_at_does_not_matter(rest: str, tmp_path: Path) -> None:
    """As ``--help`` says, nothing in those sections is a fault, nor is what stands between them and a limit."""
    head = (
        "magbear: 1\nname: base\nbearing: thesis_thrust\nmass_kg: 3.0\nperformance: {dc_gain: 10, corner_rad_s: 200}\n"
    )
    (tmp_path / "base.yaml").write_text(head + rest, "utf-8")
    base = read_study(tmp_path / "base.yaml", for_limits=True)
    study = read_study_text(compile_limits([], [], None, base.text, base.folder), "the limits")
    (case,) = study.cases()
    assert case["controller"]["method"] == "limit"
    assert (case["bandwidth"], case["reduction"], case["simulate"]) == (None, None, [])


def test_the_rest_of_a_base_is_read_as_strictly_as_ever(command: Command, tmp_path: Path) -> None:
    """A mistake in what a limit looks at is told with its line in the file."""
    text = (
        "magbear: 1\nname: base\nbearing: thesis_trust\nmass_kg: 3.0\nperformance: {dc_gain: 10, corner_rad_s: 200}\n"
    )
    (tmp_path / "base.yaml").write_text(text, "utf-8")
    ended = command("limits", "base.yaml")
    assert ended.code == 2
    assert "base.yaml:3:10: error[E106]" in ended.err
    assert "reductions, simulations and figures do not matter" in " ".join(command("limits", "--help").out.split())

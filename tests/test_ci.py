"""The jobs: what the gate runs is what the workflow runs, and a curve that moved turns it red."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
JOB = ".ci/limitation-curves"


def _curves(output: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The job of the limitation curves on one mass."""
    magbear = Path(sys.executable).with_name("magbear")
    environment = {**os.environ, "MAGBEAR": str(magbear), "GITHUB_STEP_SUMMARY": str(output / "summary.md")}
    line = ["bash", str(ROOT / JOB), "--mass", "3.0:3.5", "-j", "1", "-o", str(output / "run"), *arguments]
    return subprocess.run(line, env=environment, capture_output=True, encoding="utf-8", timeout=300, check=False)


def test_the_curves_are_where_the_baseline_has_them(tmp_path: Path) -> None:
    """Exit 0, a summary that says so, and the report that the job uploads."""
    done = _curves(tmp_path)
    assert done.returncode == 0, done.stderr
    assert "no differences beyond 1 %" in done.stderr
    assert "all 1 where they were" in (tmp_path / "summary.md").read_text("utf-8")
    assert (tmp_path / "run" / "report" / "index.html").is_file()
    assert (tmp_path / "run" / "results.h5").is_file()


def test_a_weight_changed_by_five_percent_turns_it_red(tmp_path: Path) -> None:
    """With W1's gain 5 % higher the job ends with 1, and message and summary name the curve and how far it moved."""
    done = _curves(tmp_path, "--set", "performance.dc_gain=10.5")
    assert done.returncode == 1, done.stderr
    assert "3-3.5 kg: omega_c_feasible moved from 4624.8 rad/s" in done.stderr
    summary = (tmp_path / "summary.md").read_text("utf-8")
    assert "**1 of 1 moved**" in summary
    assert "| 3-3.5 kg |" in summary
    assert "**omega_c_infeasible moved from" in summary
    assert (tmp_path / "run" / "report" / "index.html").is_file()


def test_the_gate_and_the_workflow_run_the_same_command() -> None:
    """The workflow runs the job on a schedule and on change, uploads the report whatever came out; so does the gate."""
    job = yaml.safe_load((ROOT / ".github" / "workflows" / "limitation-curves.yml").read_text("utf-8"))
    occasions = job[True]  # YAML 1.1 takes the key for a truth value
    assert occasions["schedule"]
    assert occasions["push"]["paths"] == occasions["pull_request"]["paths"]
    for path in occasions["push"]["paths"]:
        assert list(ROOT.glob(path)), path
    (steps,) = [part["steps"] for part in job["jobs"].values()]
    assert sum(f"{JOB} " in step.get("run", "") for step in steps) == 1
    (upload,) = [step for step in steps if "upload-artifact" in step.get("uses", "")]
    assert upload["if"] == "always()"
    gate = (ROOT / ".ci" / "run").read_text("utf-8")
    assert f"{JOB} --mass" in gate
    tests = yaml.safe_load((ROOT / ".github" / "workflows" / "tests.yml").read_text("utf-8"))
    assert [step["run"] for step in tests["jobs"]["gate"]["steps"] if "run" in step][-1] == "bash .ci/run"


@pytest.mark.parametrize("script", ["run", "limitation-curves"])
def test_scripts_are_sound(script: str) -> None:
    """Each can be started, and stops at the first mistake."""
    path = ROOT / ".ci" / script
    assert os.access(path, os.X_OK)
    assert "set -euo pipefail" in path.read_text("utf-8")
    assert subprocess.run(["bash", "-n", str(path)], check=False).returncode == 0

"""Every study that comes with the project runs, reduced to the first value of what it sweeps."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from magbear_cli.spec import read_study

STUDIES = sorted((Path(__file__).parents[1] / "studies").rglob("*.yaml"))


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_a_study_runs_to_its_report(path: Path, tmp_path: Path) -> None:
    """One case of each study is computed, verified, stored and drawn by the command that a user would type."""
    first = {key: values[:1] for key, values in read_study(path).sweep.items()}
    reduced = [f"sweep={json.dumps(first)}", "simulate=[{step_m: 1e-5, samples: 11, current_limit_a: 10}]"]
    line = [sys.executable, "-m", "magbear_cli", "run", str(path), "-o", str(tmp_path / "out"), "--json"]
    for override in (*reduced, "report.figures=[mu]"):
        line += ["--set", override]
    done = subprocess.run(line, capture_output=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    (case,) = document["cases"]
    assert (case["status"], case["verified"]) == ("ok", True)
    assert case["worst_case"] <= 1
    assert case["steps"]
    assert Path(document["report"]).is_file()

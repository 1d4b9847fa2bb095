"""Every study that comes with the project runs, reduced to the first value of what it sweeps."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from magbear_cli.spec import read_study
from magbear_cli.study.pipeline import run_case

FOLDER = Path(__file__).parents[1] / "studies"
OWN = sorted(FOLDER.glob("*.yaml"))
THESIS = sorted((FOLDER / "thesis").glob("*.yaml"))


@pytest.mark.parametrize("path", OWN, ids=lambda path: path.stem)
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


@pytest.mark.parametrize("path", THESIS, ids=lambda path: path.stem)
def test_a_study_of_the_thesis_gives_an_answer(path: Path) -> None:
    """The first case of each is computed to an answer, whichever it is; the file begins by telling what it asks."""
    assert path.read_text("utf-8").startswith("# ")
    inputs = read_study(path).case(0)
    outcome = run_case({**inputs, "simulate": [{**run, "samples": 11} for run in inputs["simulate"][:1]]}, "case", 0)
    assert outcome.status.is_answer, outcome.sentence
    assert outcome.controller is not None or outcome.statistics

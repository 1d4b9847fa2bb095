"""The campaign on figures and their CSV files, in short: one study with every kind of figure of a case."""

from __future__ import annotations

import csv
import os
import subprocess
import sys
from pathlib import Path

import pytest

import magbear_cli as magbear
from magbear_cli.report.writing import write_report
from magbear_cli.store.results import write_results

CAMPAIGN = Path(__file__).with_name("rebuild_figures.py")
STUDY = {
    "bearing": "thesis_thrust",
    "mass_kg": [3.0, 4.5],
    "performance": {"dc_gain": 10, "corner_rad_s": 200},
    "controller": {"method": "lqg"},
    "simulate": [{"step_m": 1e-5, "masses_kg": [3.0, 4.5], "model": "nonlinear", "samples": 101}],
    "bandwidth": {"omega_c_rad_s": 20000},
    "report": {"figures": ["mu", "sensitivity", "nyquist", "poles", "controller_gain", "step"]},
}


@pytest.fixture(scope="module")
def directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with its report."""
    folder = tmp_path_factory.mktemp("figures")
    outcome = magbear.design(STUDY)
    results = magbear.StudyResults("figures", "", (outcome,), STUDY["report"], {})  # type: ignore[arg-type]
    write_results(folder / "results.h5", results)
    write_report(results, folder / "report")
    return folder


def _campaign(directory: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(CAMPAIGN), str(directory)]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False)


def test_every_curve_is_in_its_csv(directory: Path) -> None:
    """Each point of each curve is a row of the file behind its figure."""
    done = _campaign(directory)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.endswith(", 0 that their CSV does not rebuild\n")


def test_a_number_that_is_missing_is_noticed(directory: Path) -> None:
    """With the responses of one mass taken out of a file, its curves are named."""
    table = next((directory / "report" / "tables").glob("step-*.csv"))
    with table.open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    with table.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([row for row in rows if row[0] != "4.5"])
    try:
        done = _campaign(directory)
    finally:
        with table.open("w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows(rows)
    assert done.returncode == 1
    assert f"points are not in {table.name}" in done.stdout

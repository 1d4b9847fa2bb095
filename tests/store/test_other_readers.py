"""Results files are read by programs that know nothing of this project: Octave, h5dump and xarray."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from magbear_cli.store.results import write_results
from magbear_cli.study.outcome import CaseOutcome, StudyResults

SENTENCE = "|W₁S| at ω = 12 rad/s — µ above 1"


@pytest.fixture
def study(full_case: Callable[[int], CaseOutcome]) -> StudyResults:
    """Two cases with everything that a case may have, whose sentences are not all ASCII."""
    first, second = full_case(0), full_case(1)
    text = "name: µ"
    return StudyResults("readers", text, (replace(first, sentence=SENTENCE), second), {"figures": ["mu"]}, {"a": "b"})


@pytest.fixture
def file(study: StudyResults, tmp_path: Path) -> Path:
    """Their results file."""
    path = tmp_path / "results.h5"
    write_results(path, study)
    return path


def _told(line: list[str], file: Path) -> str:
    if shutil.which(line[0]) is None:
        pytest.skip(f"{line[0]} is not installed")
    done = subprocess.run(line, cwd=file.parent, capture_output=True, encoding="utf-8", timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_octave_reads_every_dataset(file: Path, study: StudyResults) -> None:
    """Octave loads the whole file: numbers, complex curves, flags, and text beyond ASCII byte by byte."""
    script = (
        "r = load('results.h5'); f = r.case_0001.frequency; "
        "s = f.sensitivity(:, 1, 1); v = r.case_0001.summary.verified;"
        "printf('%.17g\\n', f.mu_upper(1), s(1), s(2), v);"
        "printf('%s\\n', r.case_0001.sentence);"
    )
    told = _told(["octave-cli", "--no-gui", "--quiet", "--eval", script], file).splitlines()
    outcome = study.outcomes[0]
    assert outcome.frequency is not None
    first = outcome.frequency.sensitivity.ravel()[0]
    expected = [outcome.frequency.mu_upper[0], first.real, first.imag, outcome.summary.verified]
    np.testing.assert_array_equal([float(line) for line in told[:4]], np.array(expected, dtype=float))
    assert told[4] == SENTENCE


def test_h5dump_reads_every_dataset(file: Path) -> None:
    """The HDF5 tools read each dataset, filters and checksums included."""
    told = _told(["h5dump", "-y", "results.h5"], file)
    assert "mu_upper" in told
    assert "rad/s" in told


def test_xarray_reads_every_group(file: Path, study: StudyResults) -> None:
    """Each group opens as labelled arrays on its axes."""
    import xarray

    with xarray.open_datatree(file, engine="h5netcdf") as tree:
        frequency = tree["case_0001/frequency"]
        assert frequency["sensitivity"].dims == ("masses_kg", "omega_rad_s", "part")
        assert frequency["omega_rad_s"].attrs["units"] == "rad/s"
        assert tree["cases"].sizes["case"] == len(study.outcomes)

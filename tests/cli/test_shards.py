"""A study in parts, put together, is the study; a run can be looked at while it runs."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from magbear_cli.errors import Status
from magbear_cli.library.planning import planned_cases
from magbear_cli.spec import read_study_text
from magbear_cli.store.lock import DirectoryLock
from magbear_cli.store.run_directory import RunDirectory
from magbear_cli.study.outcome import CaseOutcome

STUDY = """\
magbear: 1
name: parts
bearing: thesis_thrust
mass_kg: [3.0, 4.5]
performance: {dc_gain: 10, corner_rad_s: 200}
controller: {method: lqg}
simulate: [{step_m: 10.0e-6, samples: 11, duration_s: 1.0e-3, masses_kg: [3.6]}]
sweep: {controller.r: [1.0e-9, 2.0e-9, 3.0e-9, 4.0e-9, 5.0e-9]}
report: {figures: [mu]}
"""


def magbear(*arguments: object, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command in a folder."""
    line = [sys.executable, "-m", "magbear_cli", *map(str, arguments)]
    return subprocess.run(line, capture_output=True, encoding="utf-8", check=False, cwd=folder)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study run whole, and in two of three parts."""
    folder = tmp_path_factory.mktemp("parts")
    (folder / "study.yaml").write_text(STUDY, "utf-8")
    for arguments in ([], ["--shard", "0/3"], ["--shard", "1/3"]):
        done = magbear("run", "study.yaml", "--jobs", 1, *arguments, folder=folder)
        assert done.returncode == 0, done.stderr
    return folder


def test_a_part_computes_its_cases_alone(folder: Path) -> None:
    """Every third case, from the first or the second, into a directory that is named after the part."""
    counts = [
        len(json.loads(magbear("show", f"out/parts-{part}-of-3", "--json", folder=folder).stdout)["cases"])
        for part in (0, 1)
    ]
    assert counts == [2, 2]


def test_parts_make_the_bytes_of_the_whole(folder: Path) -> None:
    """What is missing is named, with the code for it; when all is there nothing tells the merged run from one run."""
    parts = [f"out/parts-{part}-of-3" for part in (0, 1)]
    short = magbear("merge", *parts, "-o", "merged", folder=folder)
    assert short.returncode == 3
    assert "4 of 5 cases are there" in short.stderr
    assert short.stderr.count("missing: ") == 1
    assert magbear("run", "study.yaml", "--shard", "2/3", folder=folder).returncode == 0
    done = magbear("merge", *parts, "out/parts-2-of-3", "-o", "merged", folder=folder)
    assert done.returncode == 0, done.stderr
    whole = (folder / "out" / "parts" / "results.h5").read_bytes()
    assert (folder / "merged" / "results.h5").read_bytes() == whole
    again = magbear("run", "study.yaml", "-o", "merged", folder=folder)
    assert "nothing to compute" in again.stderr


def test_parts_of_different_studies_are_refused(folder: Path, tmp_path: Path) -> None:
    """And so is a directory that holds no run."""
    (tmp_path / "study.yaml").write_text(STUDY.replace("lqg", "lqr"), "utf-8")
    other = magbear("merge", "out/parts", tmp_path, "-o", "nowhere", folder=folder)
    assert (other.returncode, "another study" in other.stderr) == (2, True)
    none = magbear("merge", "out/parts", "study.yaml", folder=folder)
    assert (none.returncode, "not the directory of a run" in none.stderr) == (2, True)
    assert not (folder / "nowhere").exists()


@pytest.mark.parametrize("part", ["3/3", "1", "a/b", "-1/3", "0/0"])
def test_a_part_that_is_none_is_refused(part: str, folder: Path) -> None:
    """With what to write."""
    done = magbear("run", "study.yaml", f"--shard={part}", folder=folder)
    assert done.returncode == 2
    assert "write I/N" in done.stderr


def test_the_status_tells_what_is_stored(folder: Path) -> None:
    """Counts by status, and whether somebody works there; in no more lines than a terminal has."""
    done = magbear("status", "out/parts", folder=folder)
    assert done.stdout.splitlines()[0] == "parts: 5 of 5 cases stored in out/parts"
    assert len(done.stdout.splitlines()) <= 24
    (folder / "out" / "parts" / ".lock").touch()
    lock = DirectoryLock(folder / "out" / "parts")
    try:
        document = json.loads(magbear("status", "out/parts", "--json", folder=folder).stdout)
    finally:
        lock.release()
    assert document["running"] is True
    assert sum(document["counts"].values()) == document["stored"] == 5
    assert document["failures"] == []
    assert magbear("status", "study.yaml", folder=folder).returncode == 2


def test_the_status_of_many_failures_fits_one_screen(tmp_path: Path) -> None:
    """Sixty failures of thirty kinds: 24 lines of 80 columns, each kind once with a case of it, the frequent first."""
    values = [float(f"{number}e-9") for number in range(1, 61)]
    text = STUDY.replace("[1.0e-9, 2.0e-9, 3.0e-9, 4.0e-9, 5.0e-9]", str(values))
    study = read_study_text(text, "study.yaml", ())
    with RunDirectory(tmp_path / "out", text) as directory:
        for case in planned_cases(study):
            words = "the same" if case.index < 20 else f"reason {case.index % 29} {'and so on ' * (case.index % 9)}"
            directory.keep(
                CaseOutcome(
                    case.id, case.index, case.inputs, Status.FAILED, f"{words}; --case {case.id} repeats it alone"
                )
            )
    lines = magbear("status", "out", folder=tmp_path).stdout.splitlines()
    assert len(lines) <= 24
    assert max(map(len, lines)) <= 80
    assert lines[1] == "60 failed"
    assert lines[3].startswith("20 failed: the same (--case ")
    assert "other reasons" in lines[-2]
    assert lines[-1] == "run the same command again to compute the rest"


def test_the_batch_script_is_one(folder: Path) -> None:
    """The shell takes it, every part is one job, and the merge names every part's directory."""
    done = magbear("slurm", "study.yaml", "--shards", 3, "--set", "name=it's", folder=folder)
    assert done.returncode == 2  # a name that no study can have
    done = magbear("slurm", "study.yaml", "--shards", 3, "--set", "mass_kg=[3.0, 4.0]", folder=folder)
    assert done.returncode == 0, done.stderr
    assert "#SBATCH --array=0-2" in done.stdout
    assert "#SBATCH --signal=B:TERM@120" in done.stdout  # B: to the batch shell, which the run has taken over
    assert "\nexec magbear run " in done.stdout
    assert all(f"out/parts-{part}-of-3" in done.stdout for part in range(3))
    checked = subprocess.run(["bash", "-n"], input=done.stdout, encoding="utf-8", capture_output=True, check=False)
    assert checked.returncode == 0, checked.stderr
    assert magbear("slurm", "study.yaml", "--time", "soon", folder=folder).returncode == 2

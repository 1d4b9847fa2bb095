"""What the README shows works as it is shown."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from magbear_cli.spec import read_study_text
from magbear_cli.store.results import read_results

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "README.md").read_text("utf-8")


def _blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


def test_the_study_of_the_front_page_is_legal() -> None:
    """The study that is shown can be run as it stands."""
    (text,) = _blocks("yaml")
    assert read_study_text(text, "README.md").case_count == 12


def test_the_reading_example_reads(finished: Path, tmp_path: Path) -> None:
    """The lines that open a results file without this project's code do so."""
    script, _ = _blocks("python")
    folder = tmp_path / "out" / "quickstart"
    folder.mkdir(parents=True)
    shutil.copy(finished / "results.h5", folder)
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, capture_output=True, encoding="utf-8", timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    (case, _) = json.loads((finished.parent / "done.json").read_text("utf-8"))["cases"]
    assert float(done.stdout) == pytest.approx(case["peak_mu"], rel=0.05)  # largest on the grid, and beside it


def test_the_library_example_runs(tmp_path: Path) -> None:
    """The lines that show the Python interface print what they should, beside the project's studies."""
    _, script = _blocks("python")
    shutil.copytree(ROOT / "studies", tmp_path / "studies")
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, capture_output=True, encoding="utf-8", timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    first, bracket, proof, time, statuses = done.stdout.splitlines()
    assert first.startswith("ok 0.419")
    low, high = (float(word) for word in bracket.removesuffix(" rad/s").split(" to "))
    assert low < 4367.1
    assert high > 4327.7
    assert proof.startswith("proven for every mass")
    assert time == "2e-05"
    assert statuses == "['not_achieved', 'not_achieved']"


def test_the_octave_example_prints(finished: Path, tmp_path: Path) -> None:
    """Ten lines of Octave print peak mu and a frequency response from a results file."""
    octave = shutil.which("octave-cli")
    if octave is None:
        pytest.skip("octave-cli is not installed")
    (script,) = _blocks("octave")
    assert len(script.splitlines()) <= 10
    folder = tmp_path / "out" / "quickstart"
    folder.mkdir(parents=True)
    shutil.copy(finished / "results.h5", folder)
    (tmp_path / "read.m").write_text(script, "utf-8")
    done = subprocess.run(
        [octave, "--no-gui", "--quiet", "read.m"], cwd=tmp_path, capture_output=True, encoding="utf-8", check=False
    )
    assert done.returncode == 0, done.stderr
    (case, _) = json.loads((finished.parent / "done.json").read_text("utf-8"))["cases"]
    mu, *rows = done.stdout.splitlines()
    assert f"peak mu {case['peak_mu']:.4f}, verified 0" == mu
    (outcome, _) = read_results(finished / "results.h5").outcomes
    assert outcome.frequency is not None
    assert len(rows) == 6
    for row, at in zip(
        rows, np.round(np.linspace(0, outcome.frequency.omega_rad_s.size - 1, 6)).astype(int), strict=True
    ):
        omega, gain, angle, largest = (float(number) for number in re.findall(r"-?\d[\d.e+-]*", row))
        assert omega == pytest.approx(outcome.frequency.omega_rad_s[at], rel=1e-2)
        assert gain == pytest.approx(abs(outcome.frequency.controller_a_per_m[at]), rel=1e-3)
        assert largest == pytest.approx(np.abs(outcome.frequency.sensitivity[:, at]).max(), rel=1e-3)
        assert np.exp(1j * np.radians(angle)) == pytest.approx(
            outcome.frequency.controller_a_per_m[at] / abs(outcome.frequency.controller_a_per_m[at]), abs=2e-3
        )


def test_a_newcomer_gets_from_a_study_to_firmware(tmp_path: Path) -> None:
    """The lines of the front page, typed one by one in an empty folder, end with a controller that compiles."""
    (block,) = [block for block in _blocks("sh") if "magbear new" in block]
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    case = "ID"
    for line in block.splitlines():
        command = line.split("#")[0].replace("--case ID", f"--case {case}")
        done = subprocess.run(
            ["bash", "-c", command], cwd=tmp_path, env={**os.environ, "PATH": path}, capture_output=True,
            encoding="utf-8", timeout=300, check=False,
        )  # fmt: skip
        assert done.returncode == 0, f"{command}: {done.stderr}"
        if command.startswith("magbear show"):
            case = next(row.split()[0] for row in done.stdout.splitlines() if " ok " in row)
    assert (tmp_path / "out" / "spindle" / "report" / "index.html").is_file()
    compiler = shutil.which("gcc")
    if compiler is None:
        pytest.skip("gcc is not installed; all but the compilation was tried")
    (program,) = (tmp_path / "firmware").glob("*_test.c")
    subprocess.run([compiler, "-std=c99", "-Wall", "-Wextra", "-Werror", program, "-o", tmp_path / "check"], check=True)
    assert subprocess.run([tmp_path / "check"], check=False).returncode == 0


def test_the_figure_of_the_front_page_is_the_baseline_drawn() -> None:
    """The picture is there, and the brackets that it tells are those of the committed baseline."""
    (name,) = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", PAGE)
    told = re.search(r"<desc>(.*?)</desc>", (ROOT / name).read_text("utf-8"), re.DOTALL)
    assert told is not None
    drawn = [tuple(map(int, pair)) for pair in re.findall(r"impossible up to (\d+), met from (\d+)", told.group(1))]
    curves = json.loads((ROOT / "configs" / "baselines" / "limits.json").read_text("utf-8"))["curves"]
    assert drawn == [(round(curve["omega_c_infeasible"]), round(curve["omega_c_feasible"])) for curve in curves]


def test_the_options_of_the_front_page_exist() -> None:
    """Every long option that the README names is one of a command, and it names all those of ``run``."""
    import click

    from magbear_cli.cli.main import COMMANDS, magbear

    context = click.Context(magbear)
    commands = {name: magbear.get_command(context, name) for name in COMMANDS}
    options = {
        name: {
            option
            for parameter in command.params
            for option in (*parameter.opts, *parameter.secondary_opts)
            if option.startswith("--")
        }
        for name, command in commands.items()
        if command is not None
    }
    named = set(re.findall(r"(?<=[`\s\[])--[a-z][a-z-]*", PAGE))
    assert named <= {"--version", "--help"}.union(*options.values())
    assert options["run"] - {"--output", "--jobs"} <= named
    assert {"`-o DIR`", "`-j N`"} <= set(re.findall(r"`-[oj] [A-Z]+`", PAGE))


def test_the_citation_has_the_version() -> None:
    """What the README says to cite is the version that is installed."""
    from magbear_cli import __version__

    (entry,) = _blocks("bibtex")
    assert f"version = {{{__version__}}}" in entry


def test_every_exit_code_and_status_is_explained() -> None:
    """The README tells all codes and statuses there are, and all public keys."""
    from magbear_cli.errors import ExitCode, Status

    codes = PAGE.split("Exit codes:")[1].split("\n\n")[0]
    assert {int(code) for code in re.findall(r"\b\d+\b", codes)} == {int(code) for code in ExitCode}
    for status in Status:
        assert f"`{status.value}`" in PAGE

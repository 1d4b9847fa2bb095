"""The benchmark in short: tiny problems, both sides, and what their answers are worth; never their times."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]


def _measured(row: str, folder: Path) -> dict[str, Any]:
    """The document of a row, measured once on its tiny problem, and the table that is printed of it."""
    command = [sys.executable, "-m", "tests.benchmarks", "--rows", row, "--tiny", "--repeats", "1", "-o", str(folder)]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"`{row}`" in done.stdout
    document: dict[str, Any] = json.loads((folder / f"{row}.json").read_text("utf-8"))
    assert {sample["runs"] for sample in document["samples"]} == {1}
    return document


def test_a_response_is_right_in_fifty_digits(tmp_path: Path) -> None:
    """Of 33 states at 300 points ours is right to 1e-9; the table says so and is stored."""
    found = _measured("response", tmp_path)["errors"]
    (error,) = found["magbear"].values()
    assert error < 1e-9
    assert "frequency response" in (tmp_path / "table.md").read_text("utf-8")


def test_a_step_is_right_to_a_millionth_on_both_sides(tmp_path: Path) -> None:
    """Ours, alone and among 64 masses, and the peer's are within 1e-6 of the step; ours in a study is within 1e-9."""
    found = _measured("step", tmp_path)["errors"]
    assert found["magbear, at a study's tolerance"]["largest error over the step"] < 1e-9
    for name in ("magbear", "magbear, 64 masses at once", "solve_ivp LSODA"):
        assert found[name]["largest error over the step"] < 1e-6


def test_an_adaptive_run_switches_as_its_peer_does(tmp_path: Path) -> None:
    """Both sides switch as often, and stay within 1e-6 of the step of each other."""
    found = _measured("adaptive", tmp_path)["errors"]
    assert found["magbear"]["switchings"] == found["reference"]["switchings"] > 2
    assert found["magbear"]["largest error over the step"] < 1e-6


def test_mu_is_pinned_from_both_sides_in_thirty_digits(tmp_path: Path) -> None:
    """The scalings' upper bound and the perturbations' lower one meet to 1e-9, and SLICOT's mu to 1e-6."""
    found = _measured("scalings", tmp_path)["errors"]
    assert abs(found["magbear"]["upper over lower bound of mu - 1, in 30 digits"]) < 1e-9
    assert found["slycot.ab13md"]["largest difference from ours"] < 1e-6


def test_the_quickest_route_to_a_controller_is_judged(tmp_path: Path) -> None:
    """A lead of one state is proven at a peak of mu of at most 0.53, and its claim is true."""
    found = _measured("robust_controller", tmp_path)["errors"]["fixed_order 1"]
    assert found["proven"] == found["states"] == 1
    assert found["peak mu"] <= 0.53
    assert abs(found["claim off by"]) < 1e-3


@pytest.mark.parametrize("name", ["scalings", "robust_controller"])
def test_a_row_without_its_peer_says_what_to_install(name: str, tmp_path: Path) -> None:
    """Where dkpy is not installed the row is left out, with the remedy, and the table is printed all the same."""
    if find_spec("dkpy") is not None:
        pytest.skip("dkpy is installed here")
    command = [sys.executable, "-m", "tests.benchmarks", "--rows", name, "-o", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 1
    assert 'pip install -e ".[benchmark]"' in done.stderr
    assert "| work |" in done.stdout


def test_a_wish_is_met_from_both_ends() -> None:
    """A goal of so many times is met at or above its factor, one of at most so many times at or below."""
    script = (
        "from tests.benchmarks.measuring import Goal\n"
        "assert Goal('a', 'b', 10.0).is_met({'a': 1.0, 'b': 10.0})\n"
        "assert not Goal('a', 'b', 10.0).is_met({'a': 1.0, 'b': 9.9})\n"
        "assert Goal('a', 'b', 2.5, at_most=True).is_met({'a': 2.5, 'b': 1.0})\n"
        "assert not Goal('a', 'b', 2.5, at_most=True).is_met({'a': 2.6, 'b': 1.0})\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True, cwd=ROOT)

"""``magbear sweep``: a grid on the command line is a study that can be run again."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Command = Callable[..., Any]


@pytest.mark.usefixtures("quick_report")
def test_a_sweep_is_saved_as_a_study(command: Command, tmp_path: Path) -> None:
    """The study in the output directory has the very cases that were computed."""
    grid = ["--wc", "10000,20000", "--mass", "3.6", "--mass", "3.0:4.5", "--method", "lqg"]
    figures = ["--set", "report.figures=[controller_gain]"]
    ended = command("sweep", *grid, *figures, "--json")
    assert ended.code == 0, ended.err
    cases = json.loads(ended.out)["cases"]
    assert [(case["mass_kg"], case["omega_c_rad_s"]) for case in cases] == [
        (3.6, 10000.0), (3.6, 20000.0), ([3.0, 4.5], 10000.0), ([3.0, 4.5], 20000.0),
    ]  # fmt: skip
    planned = command("plan", tmp_path / "out" / "sweep" / "study.yaml")
    assert [line.split()[0] for line in planned.out.splitlines()] == [case["id"] for case in cases]
    again = command("run", "out/sweep/study.yaml", "-o", "out/sweep", "--json")
    assert "4 of 4 cases reused" in again.err
    assert json.loads(again.out)["cases"] == cases


@pytest.mark.usefixtures("quick_report")
def test_a_base_study_keeps_what_the_grid_does_not_name(command: Command, tiny: Path) -> None:
    """Only what is given on the command line is replaced."""
    ended = command("sweep", tiny, "--mass", "3.0", "--json")
    assert ended.code == 0, ended.err
    document = json.loads(ended.out)
    assert document["study"] == "tiny"
    assert [case["mass_kg"] for case in document["cases"]] == [3.0, 3.0]
    assert all(case["omega_c_rad_s"] == 20000.0 and len(case["steps"]) == 1 for case in document["cases"])


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--wc", "1:2"], "LOW:HIGH:N"),
        (["--wc", "20000:5000:8"], "give the lower end first"),
        (["--wc", "5000:20000:1e9"], "whole number"),
        (["--wc", "abc"], "is not a number"),
        (["--wc", ""], "is not a number"),
        (["--wc", "7000,7000"], "twice"),
        (["--wc", "0"], "greater than 0"),
        (["--mass", "4.5:3.0"], "must rise"),
        (["--mass", "3:4:5"], "is not a mass"),
        (["--mass", "nan"], "nan"),
        (["--method", "mu_convx"], "did you mean 'mu_convex'?"),
        (["--set", "contrller.order=2"], "did you mean 'controller.order'?"),
        (["nowhere.yaml", "--wc", "5000"], "there is no such file"),
    ],
)
def test_a_grid_that_is_none_is_told(command: Command, tmp_path: Path, arguments: list[str], says: str) -> None:
    """Every odd grid has its sentence, exit code 2, and leaves nothing behind."""
    ended = command("sweep", *arguments)
    assert (ended.code, ended.out) == (2, "")
    assert says in ended.err
    assert "Traceback" not in ended.err
    assert list(tmp_path.iterdir()) == []

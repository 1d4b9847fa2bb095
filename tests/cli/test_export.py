"""``magbear export``: the files it prints, what it tells, and what it refuses."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Command = Callable[..., Any]


def test_the_files_are_printed_one_a_line(finished: Path, command: Command, tmp_path: Path) -> None:
    """Standard output has the paths and nothing else; they exist; a case that is not verified is told."""
    (first, _) = json.loads((finished.parent / "done.json").read_text("utf-8"))["cases"]
    ended = command("export", finished, "--case", first["id"][:6], "--format", "mat", "-o", "for/matlab")
    assert ended.code == 0, ended.err
    assert ended.out.split() == [
        f"for/matlab/tiny_{first['id'][:7]}.mat", "for/matlab/magbear_controller.m", "for/matlab/magbear_simulate.m"
    ]  # fmt: skip
    assert all((tmp_path / line).is_file() for line in ended.out.split())
    assert first["status"] in ended.err


def test_what_sampling_costs_is_told(finished: Path, command: Command, tmp_path: Path) -> None:
    """Margins before and after stand on standard error; --json has them with the files."""
    (first, _) = json.loads((finished.parent / "done.json").read_text("utf-8"))["cases"]
    line = ["export", finished, "--case", first["id"], "--format", "c", "--sample-time", "1e-6", "--name", "pump"]
    ended = command(*line)
    assert ended.code == 0, ended.err
    assert ended.out.split() == ["pump.h", "pump_test.c"]
    assert "phase margin" in ended.err
    assert " -> " in ended.err
    document = json.loads(command(*line, "--json").out)
    assert document["files"] == ["pump.h", "pump_test.c"]
    assert document["sampled"]["worst_case"] <= document["sampled"]["worst_case_proven"]
    assert (tmp_path / "pump.h").is_file()


def test_too_slow_a_sampling_is_refused_with_the_slowest_that_would_do(finished: Path, command: Command) -> None:
    """Exit code 2, nothing written, and the time that is named is then taken."""
    (first, _) = json.loads((finished.parent / "done.json").read_text("utf-8"))["cases"]
    line = ["export", finished, "--case", first["id"], "--format", "c"]
    ended = command(*line, "--sample-time", "1e-2")
    assert ended.code == 2
    assert "too slow" in ended.err
    assert ended.out == ""
    assert not list(Path().glob("*.h"))
    named = ended.err.split(" s would do")[0].split()[-1]
    assert command(*line, "--sample-time", named).code == 0


@pytest.mark.parametrize(
    ("line", "says"),
    [
        (["--format", "json"], "name one with --case"),
        (["--format", "json", "--case", "zz"], "is no single case"),
        (["--format", "json", "--case", ""], "is no single case"),
        (["--format", "c", "--case", "FIRST"], "give --sample-time"),
        (["--format", "json", "--case", "FIRST", "--delay", "1e-6"], "give --sample-time too"),
        (["--format", "ross", "--case", "FIRST", "--sample-time", "1e-6"], "leave --sample-time out"),
        (["--format", "json", "--case", "FIRST", "--sample-time", "1e-6", "--prewarp", "1e9"], "needs a sample time"),
        (["--format", "xml", "--case", "FIRST"], "xml"),
        (["--format", "json", "--case", "FIRST", "--name", "µ"], "is no name"),
        (["--case", "FIRST"], "--format"),
    ],
)
def test_mistakes_are_one_sentence(finished: Path, command: Command, line: list[str], says: str) -> None:
    """Each ends with exit code 2 and its remedy."""
    (first, _) = json.loads((finished.parent / "done.json").read_text("utf-8"))["cases"]
    ended = command("export", finished, *[first["id"] if word == "FIRST" else word for word in line])
    assert ended.code == 2
    assert says in ended.err
    assert "Traceback" not in ended.err

"""``magbear plan``: the cases, computed by nobody."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

Command = Callable[..., Any]


def test_cases_are_listed_with_what_is_swept(command: Command, tiny: Path) -> None:
    """Each line is an identity and the swept values of the case."""
    lines = command("plan", tiny).out.splitlines()
    assert [line.split("  ")[1] for line in lines] == ["controller.r = 3e-09", "controller.r = 6e-09"]
    assert all(len(line.split("  ")[0]) == 16 for line in lines)


def test_nothing_is_written(command: Command, tiny: Path, tmp_path: Path) -> None:
    """The directory is after the command what it was before."""
    assert command("plan", tiny, "--json").code == 0
    assert list(tmp_path.iterdir()) == [tiny]


def test_the_document_has_the_resolved_inputs(command: Command, tiny: Path) -> None:
    """``--json`` gives one document whose cases say everything that will be computed."""
    document = json.loads(command("plan", tiny, "--set", "mass_kg=[3.0, 4.5]", "--json").out)
    assert document["study"] == "tiny"
    assert [case["index"] for case in document["cases"]] == [0, 1]
    assert document["cases"][0]["mass_kg"] == [3.0, 4.5]
    assert document["cases"][0]["performance"] == {"num": [2000.0], "den": [1.0, 200.0]}


def test_identities_are_those_of_the_run(command: Command, finished: Path) -> None:
    """A case has the same identity in the plan and in the results."""
    planned = [line.split()[0] for line in command("plan", finished / "study.yaml").out.splitlines()]
    shown = json.loads(command("show", finished, "--json").out)
    assert planned == [case["id"] for case in shown["cases"]]


def test_a_stored_controller_is_known_by_its_matrices(command: Command, tiny: Path, tmp_path: Path) -> None:
    """The identity of a case follows the numbers of the controller and not the place of its file."""
    gain = tmp_path / "gain.json"
    gain.write_text('{"a": [], "b": [], "c": [[]], "d": [[-1e6]]}', "utf-8")
    asked = "controller={{method: stored, path: {}}}"
    first = command("plan", tiny, "--set", asked.format("gain.json")).out
    (tmp_path / "elsewhere").mkdir()
    shutil.copy(gain, tmp_path / "elsewhere")
    assert command("plan", tiny, "--set", asked.format("elsewhere/gain.json")).out.split()[0] == first.split()[0]
    gain.write_text('{"a": [], "b": [], "c": [[]], "d": [[-2e6]]}', "utf-8")
    assert command("plan", tiny, "--set", asked.format("gain.json")).out.split()[0] != first.split()[0]

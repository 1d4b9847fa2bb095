"""A run draws in its workers what a report draws by itself, to the last byte, also where it does not go as planned."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil
import pytest

from magbear_cli.library.planning import planned_cases
from magbear_cli.spec import read_study
from magbear_cli.study.chores import Chores

Command = Callable[..., Any]

STUDY = """\
magbear: 1
name: early
bearing: thesis_thrust
mass_kg: 3.6
performance: {dc_gain: 10, corner_rad_s: 200}
bandwidth: {omega_c_rad_s: 20000}
controller: {method: lqg}
report: {figures: [poles, controller_gain]}
sweep: {controller.r: [3.0e-9, 6.0e-9, 9.0e-9]}
"""


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """A study file of three cases with a figure each, and one about them all."""
    path = tmp_path / "early.yaml"
    path.write_text(STUDY, "utf-8")
    return path


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """The keys of all chores that are asked for."""
    keys: list[object] = []
    ask = Chores.ask

    def noted(self: Chores, key: Any, target: str, *arguments: object) -> None:  # noqa: ANN401 - whatever it is
        keys.append(key)
        ask(self, key, target, *arguments)

    monkeypatch.setattr(Chores, "ask", noted)
    return keys


def _files(report: Path) -> dict[str, bytes]:
    return {str(path.relative_to(report)): path.read_bytes() for path in report.rglob("*") if path.is_file()}


def _drawn_alone(command: Command, run: Path) -> dict[str, bytes]:
    """The report of a run's results, drawn by this process."""
    page = run.parent / f"{run.name}-alone"
    assert command("report", run, "-o", page).code == 0
    return _files(page)


@pytest.mark.parametrize("jobs", [1, 2])
def test_workers_draw_what_this_process_draws(
    command: Command, study: Path, tmp_path: Path, asked: list[object], jobs: int
) -> None:
    """The same report, with each figure of a case asked for once, when its case is stored; no worker stays."""
    assert command("run", study, "-o", "out", "-j", jobs).code == 0
    ahead = list(asked)
    assert {key for key in ahead if isinstance(key, tuple) and key[0] != "study"} == {(0, 0), (1, 0), (2, 0)}
    assert len(ahead) == 3 + jobs
    assert _files(tmp_path / "out" / "report") == _drawn_alone(command, tmp_path / "out")
    assert not psutil.Process().children(recursive=True)


def test_a_part_of_a_study_is_drawn_as_what_it_is(
    command: Command, study: Path, tmp_path: Path, asked: list[object]
) -> None:
    """With one of three cases nothing is drawn before the end; with the rest, the stored one is drawn at once."""
    second = planned_cases(read_study(study))[1].id
    assert command("run", study, "-o", "out", "--case", second).code == 0
    assert _files(tmp_path / "out" / "report") == _drawn_alone(command, tmp_path / "out")
    asked.clear()
    assert command("run", study, "-o", "out", "-j", 2).code == 0
    assert asked[0] == (1, 0)
    assert _files(tmp_path / "out" / "report") == _drawn_alone(command, tmp_path / "out")


def test_what_is_stored_is_drawn_without_workers(
    command: Command, study: Path, tmp_path: Path, asked: list[object]
) -> None:
    """A run that has nothing to compute starts no process for three figures, and its report is the same."""
    assert command("run", study, "-o", "out").code == 0
    before = _files(tmp_path / "out" / "report")
    asked.clear()
    assert command("run", study, "-o", "out").code == 0
    assert not asked
    assert _files(tmp_path / "out" / "report") == before


def test_figures_that_no_worker_draws_are_drawn_here(
    command: Command, study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where every chore fails, the report is the same."""
    monkeypatch.setattr("magbear_cli.report.press.OF_A_CASE", "magbear_cli.report.printing:absent")
    monkeypatch.setattr("magbear_cli.report.press.OF_THE_STUDY", "magbear_cli.report.printing:absent")
    assert command("run", study, "-o", "out").code == 0
    assert _files(tmp_path / "out" / "report") == _drawn_alone(command, tmp_path / "out")

"""``magbear show``, ``report`` and ``compare``: what is read from a results file."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from magbear_cli.store.results import read_results, write_results

Command = Callable[..., Any]


def test_the_table_has_every_case_once(command: Command, finished: Path) -> None:
    """Each case is a row; the directory and the file in it give the same table."""
    ended = command("show", finished)
    assert ended.code == 0
    for outcome in read_results(finished / "results.h5").outcomes:
        assert sum(line.startswith(f"{outcome.case_id[:7]} not_achieved") for line in ended.out.splitlines()) >= 1
    assert command("show", finished / "results.h5").out == ended.out


def test_the_document_is_that_of_the_run(command: Command, finished: Path) -> None:
    """``show --json`` says of the cases what ``run --json`` said when they ended."""
    then = json.loads((finished.parent / "done.json").read_text("utf-8"))
    now = json.loads(command("show", finished, "--json").out)
    assert now["cases"] == then["cases"]
    assert now["report"] == str(finished / "report" / "index.html")


@pytest.mark.parametrize("name", ["show", "report"])
def test_what_is_no_results_file_is_told(command: Command, tmp_path: Path, name: str) -> None:
    """A missing file and one that is not HDF5 are exit code 2, in one sentence."""
    (tmp_path / "odd.h5").write_bytes(b"not HDF5")
    assert command(name, "nowhere").code == 2
    assert command(name, tmp_path).code == 2
    ended = command(name, "odd.h5")
    assert ended.code == 2
    assert "odd.h5" in ended.err
    assert "Traceback" not in ended.err


def test_a_run_that_was_killed_is_told_how_to_go_on(command: Command, tiny: Path, tmp_path: Path) -> None:
    """A directory with a study and without results is answered with the command that makes them."""
    (tmp_path / "killed").mkdir()
    shutil.copy(tiny, tmp_path / "killed" / "study.yaml")
    ended = command("show", "killed")
    assert ended.code == 2
    assert "magbear run killed/study.yaml -o killed" in ended.err


def test_a_report_is_drawn_again_where_it_is_asked_for(command: Command, finished: Path, tmp_path: Path) -> None:
    """The page goes into the given directory, and its name is all that is printed; it is the page of the run."""
    ended = command("report", finished, "-o", tmp_path / "a page")
    assert (ended.code, ended.out) == (0, f"{tmp_path / 'a page' / 'index.html'}\n")
    again = (tmp_path / "a page" / "index.html").read_bytes()
    assert again == (finished / "report" / "index.html").read_bytes()


def test_a_report_cannot_go_where_a_file_is(command: Command, finished: Path, tmp_path: Path) -> None:
    """A file in the way is told before anything is drawn."""
    (tmp_path / "file").write_text("mine", "utf-8")
    ended = command("report", finished, "-o", "file")
    assert ended.code == 2
    assert "file is a file, not a directory" in ended.err


def test_a_run_does_not_differ_from_itself(command: Command, finished: Path) -> None:
    """Equal results give no line and exit code 0."""
    ended = command("compare", finished, finished / "results.h5")
    assert (ended.code, ended.out) == (0, "")
    assert "0 differences" in ended.err


@pytest.fixture
def moved(finished: Path, tmp_path: Path) -> Path:
    """The results with one figure moved by 0.1 % and one case left out."""
    results = read_results(finished / "results.h5")
    first = results.outcomes[0]
    assert first.summary.worst_case is not None
    changed = replace(first, summary=replace(first.summary, worst_case=first.summary.worst_case * 1.001))
    write_results(tmp_path / "moved.h5", replace(results, outcomes=(changed,)))
    return tmp_path / "moved.h5"


def test_differences_are_listed_and_end_with_one(command: Command, finished: Path, moved: Path) -> None:
    """A moved figure and a missing case are one line each; a tolerance forgives the figure and not the case."""
    ended = command("compare", finished, moved)
    assert ended.code == 1
    assert len(ended.out.splitlines()) == 2
    assert "worst_case" in ended.out
    assert "present != missing" in ended.out
    assert len(command("compare", finished, moved, "--rtol", "0.01").out.splitlines()) == 1


def test_differences_as_a_document(command: Command, finished: Path, moved: Path) -> None:
    """``compare --json`` gives the same differences as plain values."""
    ended = command("compare", finished, moved, "--json")
    assert ended.code == 1
    assert {found["figure"] for found in json.loads(ended.out)["differences"]} == {"worst_case", "case"}


def test_a_results_file_is_enough(command: Command, finished: Path, tmp_path: Path) -> None:
    """Everything can be shown from the one file, away from its directory; there is no report beside it then."""
    shutil.copy(finished / "results.h5", tmp_path / "alone.h5")
    assert json.loads(command("show", "alone.h5", "--json").out)["report"] is None
    assert command("compare", "alone.h5", finished).code == 0


def test_a_case_alone_has_a_report_beside_the_others(command: Command, finished: Path, tmp_path: Path) -> None:
    """``--case`` draws what the page of a large study leaves out, and touches no other report; a wrong one is told."""
    shutil.copytree(finished, tmp_path / "run")
    case = read_results(tmp_path / "run" / "results.h5").outcomes[1].case_id
    before = (tmp_path / "run" / "report" / "index.html").read_bytes()
    ended = command("report", "run", "--case", case[:6])
    assert (ended.code, ended.out) == (0, f"run/report-{case[:6]}/index.html\n")
    page = (tmp_path / "run" / f"report-{case[:6]}" / "index.html").read_text("utf-8")
    assert page.count("data-case=") == 1
    assert case in page
    assert (tmp_path / "run" / "report" / "index.html").read_bytes() == before
    wrong = command("report", "run", "--case", "zz")
    assert wrong.code == 2
    assert "no case of run/results.h5 has that identity" in wrong.err

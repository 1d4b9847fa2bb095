"""Tests of opening: a file that cannot be a study is refused without waiting and without end."""

from __future__ import annotations

import io
import os
import sys
from pathlib import Path

import pytest

from magbear_cli.spec.files import LARGEST_BYTES
from magbear_cli.spec.problems import Problem, StudyError
from magbear_cli.spec.study import read_study


def refusal(path: Path | str) -> Problem:
    """The one problem with a file."""
    with pytest.raises(StudyError) as caught:
        read_study(path)
    (problem,) = caught.value.problems
    return problem


def test_a_missing_file_is_named_with_its_neighbour(tmp_path: Path, base: str) -> None:
    """The nearest YAML file beside it is suggested."""
    (tmp_path / "quickstart.yaml").write_text(base)
    problem = refusal(tmp_path / "quikstart.yaml")
    assert problem.code == "E100"
    assert "quickstart.yaml" in problem.remedy


def test_a_directory_a_pipe_and_a_device_are_not_files(tmp_path: Path) -> None:
    """None of them is waited for or read."""
    pipe = tmp_path / "pipe.yaml"
    os.mkfifo(pipe)
    for path in (tmp_path, pipe, Path("/dev/zero"), Path("/dev/null")):
        assert refusal(path).code == "E100"


def test_a_dangling_link_and_a_loop_are_refused(tmp_path: Path) -> None:
    """The sentence says that it is a link."""
    link, loop = tmp_path / "link.yaml", tmp_path / "loop.yaml"
    link.symlink_to(tmp_path / "gone.yaml")
    loop.symlink_to(loop)
    assert "link" in refusal(link).sentence
    assert refusal(loop).code == "E100"


def test_a_file_that_may_not_be_opened_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The reason of the system is told."""

    def deny(*_: object) -> int:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "open", deny)
    assert "permission denied" in refusal(tmp_path / "study.yaml").sentence


def test_a_file_that_fails_while_it_is_read_is_refused(
    tmp_path: Path, base: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An input error of the disk is told like any other."""

    def fail(*_: object, **__: object) -> object:
        raise OSError(5, "Input/output error")

    path = tmp_path / "study.yaml"
    path.write_text(base)
    monkeypatch.setattr(os, "fdopen", fail)
    assert "input/output error" in refusal(path).sentence


@pytest.mark.parametrize("name", ["a\0b.yaml", "x" * 5000 + ".yaml", "no/such/folder/study.yaml", ""])
def test_a_name_that_no_file_can_have_is_refused(name: str) -> None:
    """It is a sentence, whatever the name."""
    assert refusal(name).code == "E100"


def test_a_name_that_is_not_utf8_is_shown(tmp_path: Path) -> None:
    """A message about it can be printed anywhere."""
    path = os.fsdecode(os.fsencode(tmp_path) + b"/caf\xe9.yaml")
    str(refusal(path)).encode("utf-8")


@pytest.mark.parametrize(
    ("data", "code", "line", "column"),
    [
        (b"magbear: 1\nname: caf\xe9\n", "E111", 2, 10),
        (b"magbear: 1\nname: \xc3\x28\n", "E111", 2, 7),
        ("magbear: 1\n".encode("utf-16"), "E111", 1, 1),
        (b"\xfe\xff\0m", "E111", 1, 1),
        ("magbear: 1\n".encode("utf-32"), "E111", 1, 1),
        (b"magbear: 1\nname: a\0b\n", "E111", 2, 8),
        (b"magbear: \xe2", "E111", 1, 10),
    ],
)
def test_bytes_that_are_not_utf8_are_refused_at_their_place(
    tmp_path: Path, data: bytes, code: str, line: int, column: int
) -> None:
    """Line and column count characters, not bytes."""
    path = tmp_path / "study.yaml"
    path.write_bytes(data)
    problem = refusal(path)
    assert (problem.code, problem.line, problem.column) == (code, line, column)


def test_a_large_file_is_refused_unread(tmp_path: Path) -> None:
    """Ten megabytes are refused for their size."""
    path = tmp_path / "study.yaml"
    with path.open("wb") as stream:
        stream.truncate(10 * LARGEST_BYTES)
    assert refusal(path).code == "E110"


def test_one_line_of_a_megabyte_is_answered(tmp_path: Path) -> None:
    """The message shows a part of the line only."""
    path = tmp_path / "study.yaml"
    path.write_text("mass_kg: " + "x" * (LARGEST_BYTES - 20))
    with pytest.raises(StudyError) as caught:
        read_study(path)
    assert max(len(line) for line in str(caught.value).splitlines()) < 400


def test_standard_input_is_read_for_a_dash(monkeypatch: pytest.MonkeyPatch, base: str) -> None:
    """A study can be piped in."""
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(base.encode())))
    study = read_study("-")
    assert (study.name, study.source, study.text) == ("base", "<stdin>", base)


def test_standard_input_without_end_or_closed_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is read up to the limit; without it there is a sentence."""
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b" " * (LARGEST_BYTES + 100))))
    assert refusal("-").code == "E110"
    monkeypatch.setattr(sys, "stdin", None)
    assert refusal("-").code == "E100"


def test_a_file_is_given_back_exactly(studies: Path) -> None:
    """The text of a study without overrides is the file's."""
    for path in studies.glob("*.yaml"):
        assert read_study(path).text == path.read_text(encoding="utf-8")

"""``magbear check``: legal or not, with every mistake."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Command = Callable[..., Any]


def test_a_legal_study_is_called_legal(command: Command, tiny: Path) -> None:
    """The answer counts the cases."""
    ended = command("check", tiny)
    assert (ended.code, ended.err) == (0, "")
    assert ended.out == f"{tiny}: legal, 2 cases\n"


def test_an_override_takes_part(command: Command, tiny: Path) -> None:
    """What ``--set`` changes is what is checked."""
    assert "legal, 1 case\n" in command("check", tiny, "--set", "controller.r=1e-9").out
    assert command("check", tiny, "--set", "mass_kg=-1").code == 2


def test_every_mistake_is_told_with_its_place(command: Command, tiny: Path) -> None:
    """Two mistakes on two lines give two places, one exit code 2 and nothing on standard output."""
    text = tiny.read_text("utf-8").replace("mass_kg: 3.6\n", "mas_kg: 3.6\n").replace("corner_rad_s", "corner_hz")
    tiny.write_text(text, "utf-8")
    ended = command("check", tiny)
    assert (ended.code, ended.out) == (2, "")
    assert f"{tiny}:4:1: error[E102]" in ended.err
    assert "did you mean 'mass_kg'?" in ended.err
    assert f"{tiny}:5:" in ended.err


@pytest.mark.parametrize(
    "content", [b"", b"\x00", b"{", b"- 1", b"magbear: 2", b"\xff\xfe", b"a: &a [*a, *a]", b"[" * 4000, b"name: on"]
)
def test_what_is_no_study_is_refused_in_a_sentence(command: Command, tmp_path: Path, content: bytes) -> None:
    """Whatever stands in the file, the answer is a place, a sentence and exit code 2."""
    path = tmp_path / "odd.yaml"
    path.write_bytes(content)
    ended = command("check", path)
    assert (ended.code, ended.out) == (2, "")
    assert "error[E1" in ended.err
    assert "Traceback" not in ended.err


@pytest.mark.parametrize("name", ["nowhere.yaml", ".", "/dev/null", "a" * 300])
def test_what_is_no_file_is_refused_in_a_sentence(command: Command, name: str) -> None:
    """A missing file, a directory, a device and an impossible name are all told."""
    ended = command("check", name)
    assert ended.code == 2
    assert "error[E1" in ended.err


def test_a_missing_stored_controller_is_found(command: Command, tiny: Path) -> None:
    """A study is not legal when the controller that it names is not there."""
    ended = command("check", tiny, "--set", "controller={method: stored, path: nowhere.h5}")
    assert ended.code == 2
    assert "nowhere.h5" in ended.err

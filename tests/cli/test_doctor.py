"""``magbear doctor``: what is looked at, and what it says of a machine that is not fit."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any, NoReturn

import pytest

from magbear_cli.cli import doctor
from magbear_cli.cli.doctor import LOOKS, Look

Command = Callable[..., Any]


def test_this_machine_is_fit(command: Command) -> None:
    """Where the tests pass, the doctor finds nothing; every look is one line."""
    ended = command("doctor")
    assert (ended.code, ended.err) == (0, "")
    assert [line.split()[0] for line in ended.out.splitlines()] == ["ok"] * len(LOOKS)


def test_the_findings_as_a_document(command: Command) -> None:
    """``--json`` names each look with what it found."""
    document = json.loads(command("doctor", "--json").out)
    assert document["fit"] is True
    assert [finding["name"] for finding in document["findings"]] == list(LOOKS)


def test_a_broken_library_is_a_finding_with_a_remedy(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """A look that raises is told in one line with what to do, and the exit code is 1."""

    def broken() -> NoReturn:
        raise ImportError("libopenblas is\nmissing")

    monkeypatch.setattr(doctor, "LOOKS", {"SLICOT": Look(broken, "install it anew")})
    ended = command("doctor")
    assert ended.code == 1
    assert ended.out.splitlines()[0].split()[:2] == ["BAD", "SLICOT"]
    assert "ImportError: libopenblas is missing" in ended.out
    assert "install it anew" in ended.out


def test_a_full_disk_is_a_finding(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """Too little room is said with the remedy."""
    monkeypatch.setattr(doctor, "LEAST_FREE_MB", 1e15)
    ended = command("doctor")
    assert ended.code == 1
    assert "make room" in ended.out

"""What happens when nobody reads, nothing fits, or the terminal is poor."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Process = Callable[..., Any]


@pytest.mark.parametrize("arguments", [["--help"], ["schema"], ["run", "--help"]])
def test_a_reader_that_goes_away_is_no_error(process: Process, arguments: list[str]) -> None:
    """``| true`` closes the pipe before anything is written; the command ends quietly and well."""
    ended = process(*arguments, through="| true")
    assert (ended.code, ended.err) == (0, "")


def test_a_comparison_keeps_its_code_when_its_reader_goes_away(process: Process, finished: Path) -> None:
    """The answer of a comparison survives a closed pipe."""
    other = finished.parent / "other.h5"
    _write_changed(finished / "results.h5", other)
    ended = process("compare", finished, other, through="| true")
    assert ended.code == 1
    assert "Traceback" not in ended.err


def test_a_full_disk_behind_standard_output_is_told(process: Process) -> None:
    """Data that could not be written are not passed over in silence."""
    ended = process("schema", through="> /dev/full")
    assert ended.code == 4
    assert "No space left on device" in ended.err


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&-", ">&- 2>&- <&-", "2> /dev/full"])
def test_closed_streams_are_survived(process: Process, tiny: Path, closed: str) -> None:
    """A command that was started without one of its streams does its work."""
    ended = process("check", tiny, through=closed)
    assert ended.code == 0
    assert "Traceback" not in ended.err


def test_a_poor_encoding_costs_letters_and_not_the_command(process: Process, finished: Path) -> None:
    """Letters that the terminal does not know are replaced."""
    ended = process("show", finished, changed={"PYTHONIOENCODING": "iso8859-2"})
    assert ended.code == 0
    assert "?_c" in ended.out


def test_no_color_means_no_escapes(process: Process, finished: Path) -> None:
    """Neither a pipe nor NO_COLOR nor TERM=dumb gets an escape character."""
    for changed in ({}, {"NO_COLOR": "1"}, {"TERM": "dumb"}):
        ended = process("show", finished, changed=changed)
        assert ended.code == 0
        assert "\x1b" not in ended.out + ended.err


def test_a_file_name_that_is_not_text_is_named_as_it_is(process: Process) -> None:
    """A name with bytes that are not UTF-8 does not upset the sentence about it."""
    ended = process("check", b"caf\xe9.yaml".decode("utf-8", "surrogateescape"))
    assert ended.code == 2
    assert "there is no such file" in ended.err


def _write_changed(source: Path, target: Path) -> None:
    from dataclasses import replace

    from magbear_cli.store.results import read_results, write_results

    results = read_results(source)
    first, *rest = results.outcomes
    changed = replace(first, summary=replace(first.summary, worst_case=12.5))
    write_results(target, replace(results, outcomes=(changed, *rest)))

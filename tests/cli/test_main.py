"""The command line as a whole: help, suggestions, and how each kind of error ends."""

from __future__ import annotations

import errno
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click
import pytest

from magbear_cli import __version__
from magbear_cli.cli import main as main_module
from magbear_cli.cli.main import COMMANDS, Terminated
from magbear_cli.errors import InputError, NumericsError, ResumableError

Command = Callable[..., Any]


@pytest.fixture
def failing(command: Command, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """A function that runs a command which ends with this error."""

    def run(error: BaseException, *arguments: str) -> Any:  # noqa: ANN401 - what the command left behind
        @click.command()
        def schema() -> None:
            raise error

        monkeypatch.setattr("magbear_cli.cli.schema.schema", schema)
        return command("schema", *arguments)

    return run


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_explains_itself_with_an_example(command: Command, name: str) -> None:
    """The help page of a command has a sentence, an example of itself, and its options."""
    ended = command(name, "--help")
    assert ended.code == 0
    assert f"Example:  magbear {name}" in ended.out or f"magbear {name} " in ended.out
    assert "--debug" in ended.out
    assert ended.err == ""


def test_the_help_page_lists_every_command_with_a_whole_sentence(command: Command) -> None:
    """No sentence of the overview is cut off."""
    lines = command("--help").out.splitlines()
    for name in COMMANDS:
        (line,) = [line for line in lines if line.startswith(f"  {name} ")]
        assert not line.endswith("...")


def test_the_version_is_told(command: Command) -> None:
    """``--version`` prints the version of the package."""
    assert __version__ in command("--version").out


def test_no_arguments_are_answered_with_the_help(command: Command) -> None:
    """A bare ``magbear`` shows what there is, as a wrong command line."""
    ended = command()
    assert (ended.code, ended.out) == (2, "")
    assert "Commands:" in ended.err


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        (["rn"], "did you mean 'run'?"),
        (["swepe"], "did you mean 'sweep'?"),
        (["xyzzy"], "there are run, sweep"),
        (["run", "--jbos", "2", "x.yaml"], "--jobs"),
        (["sweep", "--mas", "3:4"], "--mass"),
        (["--versoin"], "--version"),
        (["run"], "STUDY"),
        (["run", "x.yaml", "-j", "two"], "not a valid integer"),
        (["compare", "a", "b", "--rtol", "-1"], "-1"),
    ],
)
def test_a_wrong_command_line_is_told_in_sentences(command: Command, arguments: list[str], hint: str) -> None:
    """A misspelt command or option is answered with the nearest one and exit code 2."""
    ended = command(*arguments)
    assert (ended.code, ended.out) == (2, "")
    assert hint in ended.err
    assert "Traceback" not in ended.err


@pytest.mark.parametrize(
    ("error", "code", "says"),
    [
        (InputError("the study is odd"), 2, "error: the study is odd"),
        (ResumableError("the disk is full"), 4, "error: the disk is full"),
        (NumericsError("the numbers are odd"), 3, "error: the numbers are odd"),
        (OSError(errno.EACCES, "Permission denied", "some/file"), 4, "error: some/file: Permission denied"),
        (MemoryError(), 4, "too little memory"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (Terminated(), 143, "terminated"),
    ],
)
def test_an_error_ends_with_its_sentence_and_code(failing: Command, error: BaseException, code: int, says: str) -> None:
    """Every kind of end has one exit code and one sentence, and no traceback."""
    ended = failing(error)
    assert (ended.code, ended.out) == (code, "")
    assert says in ended.err
    assert "Traceback" not in ended.err


def test_debug_shows_the_traceback_of_a_users_mistake(failing: Command) -> None:
    """With ``--debug`` the place in the code is shown beside the sentence."""
    ended = failing(InputError("the study is odd"), "--debug")
    assert ended.code == 2
    assert "Traceback" in ended.err
    assert "error: the study is odd" in ended.err


def test_a_bug_is_one_line_with_the_place_of_its_details(
    failing: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An exception that nobody expected is called a bug, and a file holds its traceback."""
    _put_crash_files_into(tmp_path, monkeypatch)
    ended = failing(ZeroDivisionError("in\ntwo lines"))
    assert ended.code == 70
    assert len(ended.err.splitlines()) == 1
    assert "this is a bug of magbear (ZeroDivisionError: in two lines)" in ended.err
    assert "Please report it." in ended.err
    (crash,) = tmp_path.glob("magbear-crash-*.txt")
    assert str(crash) in ended.err
    assert "Traceback" in crash.read_text("utf-8")


def test_a_bug_is_told_where_no_file_can_be_written(
    failing: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a place for the details the user is told how to see them."""
    _put_crash_files_into(tmp_path / "nowhere", monkeypatch)
    ended = failing(ZeroDivisionError("by zero"))
    assert ended.code == 70
    assert "--debug" in ended.err


def _put_crash_files_into(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    elsewhere = partial(tempfile.NamedTemporaryFile, dir=folder)
    monkeypatch.setattr(main_module, "tempfile", SimpleNamespace(NamedTemporaryFile=elsewhere))


def test_every_command_module_is_named_in_the_overview() -> None:
    """The overview has the commands of the folder, no more and no fewer."""
    folder = Path(main_module.__file__).parent
    found = {path.stem for path in folder.glob("*.py") if "@click.command()" in path.read_text("utf-8")}
    assert found == set(COMMANDS)

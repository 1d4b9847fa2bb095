"""``magbear explain`` and the completion of the shells."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from magbear_cli.errors import ExitCode, Status
from magbear_cli.spec import CODES

Command = Callable[..., Any]
BIN = Path(sys.executable).parent


@pytest.mark.parametrize("code", [*CODES, *(status.value for status in Status), *(str(int(code)) for code in ExitCode)])
def test_every_code_and_status_is_explained(command: Command, code: str) -> None:
    """Whatever a message, a table or a shell may show has its explanation, in either case of letters."""
    for spelling in (code, code.lower()):
        ended = command("explain", spelling)
        assert ended.code == 0, ended.err
        assert code in ended.out
        assert len(ended.out.split()) > 8


def test_all_of_them_are_listed(command: Command) -> None:
    """Without a code the list has every one."""
    listed = command("explain").out
    for code in [*CODES, *(status.value for status in Status), *(str(int(code)) for code in ExitCode)]:
        assert f"  {code} " in listed


def test_a_code_that_is_none_gets_the_nearest(command: Command) -> None:
    """A slip gets the code that was meant."""
    ended = command("explain", "infeasable")
    assert ended.code == 2
    assert "did you mean 'infeasible'" in ended.err


BASH = """\
source <(_MAGBEAR_COMPLETE=bash_source magbear)
COMP_WORDS=({words})
COMP_CWORD={at}
_magbear_completion magbear
printf "%s\\n" "${{COMPREPLY[@]}}"
"""


def _shell(name: str, script: str) -> list[str]:
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"{name} is not installed")
    environment = {**os.environ, "PATH": f"{BIN}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(
        [found, "-c", script], env=environment, capture_output=True, encoding="utf-8", timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.parametrize(
    ("words", "answers"), [("magbear expo", ["export"]), ("magbear explain E10", sorted(CODES)[:10])]
)
def test_bash_completes(words: str, answers: list[str]) -> None:
    """The line of the README makes bash complete commands and codes."""
    script = BASH.format(words=words, at=len(words.split()) - 1)
    assert _shell("bash", script) == answers


def test_fish_completes() -> None:
    """Fish, asked for the completions of a line after the README's line, gives them."""
    script = '_MAGBEAR_COMPLETE=fish_source magbear | source; complete -C "magbear export --format "'
    assert {line.split("\t")[0] for line in _shell("fish", script)} == {"mat", "json", "c", "python", "ross"}


def test_zsh_completes() -> None:
    """In zsh the function that the README's line defines is registered, and offers what the command answers."""
    script = (
        'autoload -Uz compinit; compinit -u -D; eval "$(_MAGBEAR_COMPLETE=zsh_source magbear)"; '
        'print -r -- "$_comps[magbear]"; '
        'COMP_WORDS="magbear expo" COMP_CWORD=1 _MAGBEAR_COMPLETE=zsh_complete magbear'
    )
    registered, kind, offered, *_ = _shell("zsh", script)
    assert registered == "_magbear_completion"
    assert (kind, offered) == ("plain", "export")

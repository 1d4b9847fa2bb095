"""The ``magbear`` command: which commands there are, and the one place where an error becomes a sentence and a code."""

from __future__ import annotations

import importlib
import signal
import sys
import tempfile
import traceback
from collections.abc import Sequence
from difflib import get_close_matches
from types import FrameType
from typing import Never

import click

from magbear_cli import __version__
from magbear_cli.cli.output import settle_streams, silence, tell
from magbear_cli.errors import ExitCode, MagbearError

COMMANDS = (
    "run", "sweep", "limits", "reproduce", "merge", "status", "slurm", "check", "plan", "new", "schema",
    "explain", "show", "report", "export", "compare", "verify", "doctor",
)  # fmt: skip


class LateCommands(click.Group):
    """A group that imports a command when it is asked for."""

    def list_commands(self, _context: click.Context) -> list[str]:
        """The commands in the order in which they are met."""
        return list(COMMANDS)

    def get_command(self, _context: click.Context, name: str) -> click.Command | None:
        """The command of that name, with ``--debug`` added where it has none of its own."""
        if name not in COMMANDS:
            return None
        command: click.Command = getattr(importlib.import_module(f"magbear_cli.cli.{name}"), name)
        if not any(parameter.name == "debug" for parameter in command.params):
            command.params.append(
                click.Option(["--debug"], is_flag=True, expose_value=False, help="Show the traceback of an error.")
            )
        return command

    def resolve_command(
        self, context: click.Context, arguments: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command that the arguments begin with, or the nearest one in a sentence."""
        name = arguments[0]
        if name not in COMMANDS and not name.startswith("-") and not context.resilient_parsing:
            near = get_close_matches(name, COMMANDS, n=1)
            hint = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(COMMANDS)}"
            raise click.UsageError(f"There is no command '{name}': {hint}", context)
        return super().resolve_command(context, arguments)


class Terminated(BaseException):
    """SIGTERM arrived, or the terminal is gone."""


@click.command(cls=LateCommands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="magbear")
def magbear() -> None:
    """Robust control of precision magnetic bearings: proven limits and the simplest controller that reaches them.

    \b
    Start with:  magbear new study && magbear run study.yaml
    """


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and end the process with its exit code."""
    settle_streams()
    signal.signal(signal.SIGTERM, _terminate)
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # nohup asks for that
        signal.signal(signal.SIGHUP, _terminate)
    given = list(sys.argv[1:] if arguments is None else arguments)
    code = _guarded(given)
    try:
        sys.stdout.flush()
    except OSError:
        silence(sys.stdout)
    sys.exit(int(code))


def _terminate(_number: int, _frame: FrameType | None) -> Never:
    raise Terminated


def _guarded(arguments: list[str]) -> int:
    """The exit code of a command line, whatever happens in it."""
    debug = "--debug" in arguments
    try:
        answer = magbear.main(arguments, prog_name="magbear", standalone_mode=False)
        return int(answer) if isinstance(answer, int) else ExitCode.DONE
    except SystemExit:  # click's answer to a reader of its help that has gone
        silence(sys.stdout)
        return ExitCode.DONE
    except click.ClickException as error:
        tell(_usage(error))
        return ExitCode.USAGE
    except (click.Abort, KeyboardInterrupt):
        tell("interrupted")
        return ExitCode.INTERRUPTED
    except Terminated:
        tell("terminated")
        return ExitCode.TERMINATED
    except Exception as error:  # noqa: BLE001 - whatever it is, the user gets a sentence
        return _ended_by(error, debug=debug)


def _usage(error: click.ClickException) -> str:
    """What is wrong with a command line, and where its help is."""
    context = error.ctx if isinstance(error, click.UsageError) else None
    if isinstance(error, click.exceptions.NoArgsIsHelpError):
        return error.format_message()
    path = "magbear" if context is None else context.command_path
    return f"error: {error.format_message()}\n{path} --help tells more"


def _ended_by(error: Exception, *, debug: bool) -> int:
    """Tell of an error as what it is, and answer its exit code."""
    if debug:
        tell(traceback.format_exc())
    if isinstance(error, MagbearError):
        tell(str(error) if "error[" in str(error) else f"error: {error}")
        return error.exit_code
    if isinstance(error, OSError) and error.strerror:
        place = f"{error.filename}: " if error.filename else ""
        tell(f"error: {place}{error.strerror}")
        return ExitCode.RESUMABLE
    if isinstance(error, MemoryError):
        tell("error: this machine has too little memory for it")
        return ExitCode.RESUMABLE
    return _bug(error)


def _bug(error: Exception) -> int:
    """Tell of a bug of ours in one line, with the place of its traceback."""
    try:
        with tempfile.NamedTemporaryFile("w", prefix="magbear-crash-", suffix=".txt", delete=False) as file:
            file.write(f"magbear {__version__}, Python {sys.version}\n{sys.argv}\n{traceback.format_exc()}")
        place = f"the details are in {file.name}"
    except OSError:
        place = "run it again with --debug for the details"
    what = " ".join(f"{type(error).__name__}: {error}".split())
    tell(f"error: this is a bug of magbear ({what}); {place}. Please report it.")
    return ExitCode.BUG

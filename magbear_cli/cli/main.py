"""The ``magbear`` command: which commands there are, and the one place where an error becomes a sentence and a code."""

from __future__ import annotations

import importlib
import os
import sys
import tempfile
import traceback
from collections.abc import Sequence

import click

from magbear_cli import __version__
from magbear_cli.errors import ExitCode, MagbearError

COMMANDS = ("run", "sweep", "check", "plan", "new", "schema", "show", "report", "compare", "doctor")


class LateCommands(click.Group):
    """A group that imports a command when it is asked for."""

    def list_commands(self, _context: click.Context) -> list[str]:
        """The commands in the order in which they are met."""
        return list(COMMANDS)

    def get_command(self, _context: click.Context, name: str) -> click.Command | None:
        """The command of that name, with ``--debug`` added."""
        if name not in COMMANDS:
            return None
        command: click.Command = getattr(importlib.import_module(f"magbear_cli.cli.{name}"), name)
        if not any(parameter.name == "debug" for parameter in command.params):
            command.params.append(
                click.Option(["--debug"], is_flag=True, expose_value=False, help="Show the traceback of an error.")
            )
        return command


@click.command(cls=LateCommands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="magbear")
def magbear() -> None:
    """Robust control of precision magnetic bearings: studies, limits, and the simplest controller that gets there.

    \b
    Start with:  magbear new study && magbear run study.yaml
    """


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and end the process with its exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    code = _guarded(given)
    try:
        sys.stdout.flush()
    except OSError:
        _silence(sys.stdout)
    sys.exit(int(code))


def _guarded(arguments: list[str]) -> int:  # noqa: PLR0911 - one return for each way to end
    debug = "--debug" in arguments
    try:
        answer = magbear.main(arguments, prog_name="magbear", standalone_mode=False)
        return int(answer) if isinstance(answer, int) else ExitCode.DONE
    except click.exceptions.Exit as end:
        return end.exit_code
    except click.ClickException as error:
        error.show()
        return ExitCode.USAGE
    except (click.Abort, KeyboardInterrupt):
        _say("interrupted; what was finished is stored")
        return ExitCode.INTERRUPTED
    except BrokenPipeError:
        _silence(sys.stdout)
        return ExitCode.DONE
    except MagbearError as error:
        if debug:
            traceback.print_exc()
        _say(str(error) if "error[" in str(error) else f"error: {error}")
        return error.exit_code
    except Exception as error:  # noqa: BLE001 - whatever it is, the user gets a sentence
        return _bug(error, debug=debug)


def _bug(error: Exception, *, debug: bool) -> int:
    """Tell of a bug of ours in one line, with the place of its traceback."""
    text = traceback.format_exc()
    if debug:
        _say(text)
    place = ""
    try:
        with tempfile.NamedTemporaryFile("w", prefix="magbear-crash-", suffix=".txt", delete=False) as file:
            file.write(f"magbear {__version__}, Python {sys.version}\n{text}")
        place = f"; the details are in {file.name}"
    except OSError:
        place = "; run it again with --debug for the details"
    _say(f"error: this is a bug of magbear ({type(error).__name__}: {error}){place}. Please report it.")
    return ExitCode.BUG


def _say(text: str) -> None:
    """Print to stderr, which may be closed."""
    try:
        click.echo(text, err=True)
    except (OSError, ValueError):
        _silence(sys.stderr)


def _silence(stream: object) -> None:
    """Point a closed stream at nothing, so that the interpreter's own flush at exit is quiet."""
    null = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(null, stream.fileno())  # type: ignore[attr-defined]
    except (OSError, ValueError, AttributeError):
        os.close(null)

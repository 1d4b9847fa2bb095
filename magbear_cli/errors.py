"""How things end: the statuses of a case, the exit codes of the command, and the exceptions that carry a sentence."""

from __future__ import annotations

from enum import IntEnum, StrEnum


class Status(StrEnum):
    """How a case ended; ``infeasible`` is a proof, ``not_achieved`` is not."""

    OK = "ok"
    INFEASIBLE = "infeasible"
    NOT_ACHIEVED = "not_achieved"
    UNVERIFIED = "unverified"
    UNSTABLE = "unstable"
    TIMEOUT = "timeout"
    CRASHED = "crashed"
    FAILED = "failed"

    @property
    def is_answer(self) -> bool:
        """Whether the case was computed; an infeasible case is a computed answer, a crashed one is not."""
        return self not in {Status.TIMEOUT, Status.CRASHED, Status.FAILED}


class ExitCode(IntEnum):
    """The exit codes of every command."""

    DONE = 0
    DIFFERENCE = 1
    USAGE = 2
    SOME_FAILED = 3
    RESUMABLE = 4
    BUG = 70
    INTERRUPTED = 130
    TERMINATED = 143


class MagbearError(Exception):
    """An end with a sentence for the user; its exit code says what kind of end."""

    exit_code = ExitCode.BUG


class InputError(MagbearError):
    """The command line, study or input file is wrong; the sentence names the place and the remedy."""

    exit_code = ExitCode.USAGE


class ResumableError(MagbearError):
    """The run stopped for a reason outside of it (full disk, another runner); running again goes on."""

    exit_code = ExitCode.RESUMABLE


class NumericsError(MagbearError):
    """A computation was given numbers it cannot use, or gave numbers that cannot be true."""

    exit_code = ExitCode.SOME_FAILED

"""What happens in a run, as the runner tells it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from magbear_cli.study.plan import Case

if TYPE_CHECKING:
    from magbear_cli.study.outcome import CaseOutcome


@dataclass(frozen=True)
class CaseStarted:
    """A worker was given a case."""

    case: Case
    attempt: int  # from 1
    pid: int


@dataclass(frozen=True)
class CaseRetried:
    """A worker was lost over a case, which goes to a fresh one."""

    case: Case
    sentence: str
    detail: str


@dataclass(frozen=True)
class CaseEnded:
    """A case ended; ``detail`` is the traceback or the end of what its worker printed, for a log."""

    outcome: CaseOutcome
    attempts: int
    elapsed_s: float
    detail: str = ""


@dataclass(frozen=True)
class RunStopped:
    """The run ends before its cases do; the last event."""

    sentence: str
    cases_left: int


Event = CaseStarted | CaseRetried | CaseEnded | RunStopped

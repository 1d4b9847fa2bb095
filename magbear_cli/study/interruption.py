"""Ctrl-C, SIGTERM and a lost terminal during a run: the first asks it to stop and keep, the second kills."""

from __future__ import annotations

import signal
from types import FrameType, TracebackType
from typing import Self

from magbear_cli.errors import ExitCode

CAUGHT = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Interruption:
    """A context in which a first signal is only noted and a second one raises KeyboardInterrupt.

    Call it to learn whether to stop; only the main thread can enter it.
    """

    def __init__(self) -> None:
        """Nothing has happened yet."""
        self.signal: signal.Signals | None = None
        self._before: dict[signal.Signals, object] = {}

    def __call__(self) -> bool:
        """Whether a signal asked the run to stop."""
        return self.signal is not None

    @property
    def exit_code(self) -> ExitCode:
        """The exit code that tells of the signal; DONE without one."""
        if self.signal is None:
            return ExitCode.DONE
        return ExitCode.INTERRUPTED if self.signal is signal.SIGINT else ExitCode.TERMINATED

    def __enter__(self) -> Self:
        """Take the signals over; a lost terminal that is ignored, as under nohup, stays ignored."""
        heard = [n for n in CAUGHT if n is not signal.SIGHUP or signal.getsignal(n) is not signal.SIG_IGN]
        self._before = {number: signal.signal(number, self._note) for number in heard}
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give the signals back."""
        for number, handler in self._before.items():
            signal.signal(number, handler)  # type: ignore[arg-type]

    def _note(self, number: int, _frame: FrameType | None) -> None:
        if self.signal is not None:
            raise KeyboardInterrupt
        self.signal = signal.Signals(number)

"""A first signal asks, a second one insists."""

from __future__ import annotations

import os
import signal

import pytest

from magbear_cli.errors import ExitCode
from magbear_cli.study.interruption import Interruption


@pytest.mark.parametrize(
    ("number", "code"),
    [
        (signal.SIGINT, ExitCode.INTERRUPTED),
        (signal.SIGTERM, ExitCode.TERMINATED),
        (signal.SIGHUP, ExitCode.TERMINATED),
    ],
)
def test_the_first_signal_is_noted_and_the_second_raises(number: signal.Signals, code: ExitCode) -> None:
    """One signal only changes the answer and the exit code; another raises; afterwards the old handlers are back."""
    before = signal.getsignal(number)
    with Interruption() as interruption:
        assert not interruption()
        assert interruption.exit_code is ExitCode.DONE
        os.kill(os.getpid(), number)
        assert interruption()
        assert interruption.exit_code is code
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), number)
    assert signal.getsignal(number) is before


def test_a_lost_terminal_that_nobody_minds_is_not_minded() -> None:
    """Under nohup a run goes on when its terminal has gone."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with Interruption() as interruption:
            os.kill(os.getpid(), signal.SIGHUP)
            assert not interruption()
    finally:
        signal.signal(signal.SIGHUP, before)

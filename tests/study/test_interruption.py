"""A first signal asks, a second one insists."""

from __future__ import annotations

import os
import signal

import pytest

from magbear_cli.errors import ExitCode
from magbear_cli.study.interruption import Interruption


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, ExitCode.INTERRUPTED), (signal.SIGTERM, ExitCode.TERMINATED)]
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

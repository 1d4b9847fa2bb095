"""Where the kernel does not kill orphans, a small process does."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys

import pytest

from magbear_cli.study import guardian

WORKER = """
import subprocess, sys, os, time
subprocess.Popen([sys.executable, "-I", "-S", sys.argv[1], sys.argv[2], str(os.getpid())], pass_fds=(int(sys.argv[2]),))
print("up", flush=True)
time.sleep(60)
"""


@pytest.mark.parametrize("is_worker_first", [False, True])
def test_the_guardian_kills_its_worker_when_the_parent_is_gone(is_worker_first: bool) -> None:  # noqa: FBT001
    """Closing the parent's end kills a worker that does nothing by itself; without a worker the guardian just ends."""
    ours, theirs = socket.socketpair()
    descriptor = str(theirs.fileno())
    worker = subprocess.Popen(
        [sys.executable, "-c", WORKER, guardian.__file__, descriptor],
        pass_fds=(theirs.fileno(),),
        stdout=subprocess.PIPE,
    )
    theirs.close()
    assert worker.stdout is not None
    assert worker.stdout.readline() == b"up\n"
    if is_worker_first:
        worker.kill()
        worker.wait(5)
    ours.close()
    assert worker.wait(5) == -signal.SIGKILL
    assert worker.stdout.read() == b""  # the guardian, which holds the other end, is gone too
    worker.stdout.close()

"""One worker process as the parent holds it: started, watched from outside, spoken to and killed.

A kernel that hangs with the interpreter lock held ignores signals and stops threads, so nothing inside the worker is
trusted to end it; only the parent ends it, with SIGKILL.
"""

from __future__ import annotations

import contextlib
import os
import selectors
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import psutil

from magbear_cli.study.protocol import FrameReader, pack_frame

ONE_THREAD = dict.fromkeys(
    (
        "OPENBLAS_NUM_THREADS",
        "OMP_NUM_THREADS",
        "MKL_NUM_THREADS",
        "VECLIB_MAXIMUM_THREADS",
        "NUMEXPR_NUM_THREADS",
        "BLIS_NUM_THREADS",
    ),
    "1",
)
PRINTED_TAIL_BYTES = 8192
RECEIVE_BYTES = 1 << 20
REAP_LIMIT_S = 2.0


@dataclass(frozen=True)
class WorkerSettings:
    """What every worker of a run is started with."""

    target: str
    warm_modules: tuple[str, ...]
    memory_bytes: int | None


class Worker:
    """A worker process with its socket and whatever it prints; it never outlives the parent.

    ``poll`` moves bytes and never blocks. ``close`` kills, reaps and frees, and may be called at any time.
    """

    def __init__(self, settings: WorkerSettings, selector: selectors.BaseSelector) -> None:
        """Start the process and register its two ends with the selector, with ``self`` as their data."""
        self.started_s = time.monotonic()
        self._selector = selector
        self._reader = FrameReader()
        self._outgoing = bytearray()
        self._printed = bytearray()
        self._socket, theirs = socket.socketpair()
        with theirs:
            try:
                self.process = _start(settings, theirs.fileno())
            except OSError:
                self._socket.close()
                raise
        self._socket.settimeout(0.0)
        assert self.process.stdout is not None  # noqa: S101 - asked for above; narrows the type
        self._printing = self.process.stdout.fileno()
        os.set_blocking(self._printing, False)
        selector.register(self._socket, selectors.EVENT_READ, self)
        selector.register(self._printing, selectors.EVENT_READ, self)

    @property
    def pid(self) -> int:
        """The process id."""
        return self.process.pid

    @property
    def is_running(self) -> bool:
        """Whether the process has not ended."""
        return self.process.poll() is None

    @property
    def printed_tail(self) -> str:
        """The end of what the worker printed since ``forget_printed``, on either stream."""
        return self._printed.decode("utf-8", "replace").replace("\x00", "")

    def forget_printed(self) -> None:
        """Start a new tail, so that a case is not blamed for what another one printed."""
        self._printed.clear()

    def send(self, message: object) -> None:
        """Hand a message to the worker, as fast as it takes it."""
        self._outgoing += pack_frame(message)
        self._flush()

    def poll(self) -> tuple[list[object], bool]:
        """The messages that have arrived, and whether the worker still holds its end of the socket.

        Raises
        ------
        GarbledError
            when it sent something that is not a message.
        """
        self._drain_printed()
        self._flush()
        messages: list[object] = []
        while True:
            try:
                received = self._socket.recv(RECEIVE_BYTES)
            except BlockingIOError:
                return messages, self.is_running
            except OSError:  # reset: it died with our request unread
                return messages, False
            if not received:
                return messages, False
            messages += self._reader.messages(received)

    def resident_bytes(self) -> int:
        """The memory the worker holds now; zero when it is gone."""
        try:
            return int(psutil.Process(self.process.pid).memory_info().rss)
        except psutil.Error:
            return 0

    def close(self) -> None:
        """Kill the process, reap it and free what the parent held for it."""
        if self._socket.fileno() < 0:
            return
        self.process.kill()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(REAP_LIMIT_S)
        self._drain_printed()
        for end in (self._socket, self._printing):
            with contextlib.suppress(KeyError, ValueError):
                self._selector.unregister(end)
        self._socket.close()
        if self.process.stdout is not None:
            self.process.stdout.close()

    def how_it_died(self) -> str:
        """How the process ended, with the name of the signal; to be asked before ``close``."""
        try:
            code = self.process.wait(REAP_LIMIT_S)
        except subprocess.TimeoutExpired:
            return "its process closed the connection"
        if code < 0:
            return f"its process was killed by {_signal_name(-code)}"
        return f"its process ended by itself with exit code {code}"

    def _flush(self) -> None:
        try:
            while self._outgoing:
                sent = self._socket.send(self._outgoing)
                del self._outgoing[:sent]
        except BlockingIOError:
            pass
        except OSError:  # it died; its end of the socket tells
            self._outgoing.clear()
        wanted = selectors.EVENT_READ | (selectors.EVENT_WRITE if self._outgoing else 0)
        if self._selector.get_key(self._socket).events != wanted:
            self._selector.modify(self._socket, wanted, self)

    def _drain_printed(self) -> None:
        with contextlib.suppress(OSError):
            while received := os.read(self._printing, RECEIVE_BYTES):
                self._printed += received
                del self._printed[:-PRINTED_TAIL_BYTES]
            with contextlib.suppress(KeyError):  # closed by the worker: an end that is always readable
                self._selector.unregister(self._printing)


@contextlib.contextmanager
def interrupts_held() -> Iterator[None]:
    """Hold Ctrl-C back while a process is started and noted, so that none is started and not noted.

    The worker inherits the mask and so is deaf to Ctrl-C from its first instruction.
    """
    previous = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, previous)


def _start(settings: WorkerSettings, descriptor: int) -> subprocess.Popen[bytes]:
    arguments = [str(descriptor), str(os.getpid()), str(settings.memory_bytes or 0), settings.target]
    return subprocess.Popen(  # noqa: S603 - this interpreter, arguments of our own
        [*fresh_interpreter(), "-m", "magbear_cli.study.worker", *arguments, ",".join(settings.warm_modules)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        pass_fds=(descriptor,),
        env=quiet_environment(),
    )


def fresh_interpreter() -> list[str]:
    """The running interpreter with its warning and optimisation flags; files beside the study never shadow modules."""
    flags = subprocess._args_from_interpreter_flags()  # type: ignore[attr-defined]  # noqa: SLF001 - as multiprocessing does
    return [sys.executable, "-P", *(flag for flag in flags if flag != "-P")]


def quiet_environment() -> dict[str, str]:
    """The caller's environment with one thread for every numerical library, and this very package importable."""
    house = str(Path(__file__).resolve().parents[2])
    paths = [path for path in os.environ.get("PYTHONPATH", "").split(os.pathsep) if path]
    return {**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join([*paths, house])}


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"

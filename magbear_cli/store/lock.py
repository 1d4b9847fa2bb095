"""A lock that one run holds on its directory and that the kernel releases, however the run ends."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import socket
from pathlib import Path

from magbear_cli.errors import ResumableError
from magbear_cli.store.durable import told_as_sentence

LOCK_NAME = ".lock"
HELD = frozenset({errno.EAGAIN, errno.EACCES})  # another process has the lock


class DirectoryLock:
    """The lock of a directory, held until ``release``; the file stays, only its lock matters.

    ``warning`` is a sentence when there is none, because the file system cannot lock; else empty.
    """

    def __init__(self, folder: Path, *, must_lock: bool = True) -> None:
        """Take the lock at once or say who holds it.

        Parameters
        ----------
        folder : the directory to hold
        must_lock : False to go on without a lock where the file system cannot lock; a lock that another process holds
            is respected all the same

        Raises
        ------
        ResumableError
            when another process holds it, or the file system cannot lock.
        """
        self._path = folder / LOCK_NAME
        self.warning = ""
        with told_as_sentence(self._path, 0):
            self._descriptor = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            cannot = f"{folder} is on a file system that cannot lock ({error.strerror})"
            if error.errno in HELD:
                sentence = f"{folder} is in use by another run ({_holder(self._descriptor)}); wait for it or choose "
                sentence += "another --output"
            else:
                sentence = f"{cannot}; choose another --output, or give --no-lock and keep other runs out yourself"
            if must_lock or error.errno in HELD:
                os.close(self._descriptor)
                raise ResumableError(sentence) from error
            self.warning = f"{cannot}: nothing keeps another run out, and two at a time there break each other off"
        with told_as_sentence(self._path, 0):
            os.ftruncate(self._descriptor, 0)
            os.pwrite(self._descriptor, json.dumps({"pid": os.getpid(), "host": socket.gethostname()}).encode(), 0)

    def release(self) -> None:
        """Let go of the lock; twice is as good as once."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1


def is_locked(path: Path) -> bool:
    """Whether a process holds the lock of this file; where there is no file nobody does."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno in HELD
    finally:
        os.close(descriptor)
    return False


def _holder(descriptor: int) -> str:
    try:
        noted = json.loads(os.pread(descriptor, 4096, 0))
        return f"process {noted['pid']} on {noted['host']}"
    except (OSError, ValueError, KeyError, TypeError):
        return "which has not yet said who it is"

"""The lock of a run's directory: one holder, and what happens where there can be none."""

from __future__ import annotations

import errno
import fcntl
import os
from pathlib import Path

import pytest

from magbear_cli.errors import ResumableError
from magbear_cli.store.lock import LOCK_NAME, DirectoryLock, is_locked
from magbear_cli.store.run_directory import RunDirectory


@pytest.fixture
def no_locks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A file system that cannot lock, as some network ones."""

    def flock(_descriptor: int, _operation: int) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", flock)


@pytest.mark.parametrize("must_lock", [True, False])
def test_a_held_directory_is_refused(tmp_path: Path, *, must_lock: bool) -> None:
    """A lock that works is respected, asked for or not, and free again when it is released."""
    lock = DirectoryLock(tmp_path, must_lock=must_lock)
    assert lock.warning == ""
    assert is_locked(tmp_path / LOCK_NAME)
    with pytest.raises(ResumableError, match=f"in use by another run .process {os.getpid()}"):
        DirectoryLock(tmp_path, must_lock=must_lock)
    lock.release()
    lock.release()
    DirectoryLock(tmp_path).release()


@pytest.mark.usefixtures("no_locks")
def test_a_file_system_that_cannot_lock_is_refused_with_the_option(tmp_path: Path) -> None:
    """The reason and both remedies stand in the sentence, and no descriptor stays open."""
    before = len(list(Path("/proc/self/fd").iterdir()))
    with pytest.raises(
        ResumableError, match=r"cannot lock \(No locks available\); choose another --output, or give --no-lock"
    ):
        DirectoryLock(tmp_path)
    assert len(list(Path("/proc/self/fd").iterdir())) == before


@pytest.mark.usefixtures("no_locks")
def test_a_run_without_a_lock_is_warned(tmp_path: Path) -> None:
    """On request the directory can be used, and a note says what nobody guards against."""
    with RunDirectory(tmp_path / "out", "text", must_lock=False) as directory:
        (note,) = directory.notes
    assert "cannot lock (No locks available): nothing keeps another run out" in note
    with pytest.raises(ResumableError, match="--no-lock"):
        RunDirectory(tmp_path / "out", "text")

"""Write a file whole and for good, or leave no trace of the attempt.

Temporary file in the same directory, every byte, fsync, rename, fsync of the directory: at every instant the name
holds the old content or the new one, and after the last step a power cut cannot take it back.
"""

from __future__ import annotations

import contextlib
import errno
import os
from collections.abc import Iterator
from pathlib import Path

from magbear_cli.errors import ResumableError

TEMPORARY_PREFIX = ".tmp-"
MEGABYTE = 1e6
AGAIN = "run the same command again to go on, what was finished is kept"

REASONS = {
    errno.EROFS: "the file system is read-only",
    errno.EIO: "the disk reports an error",
    errno.EACCES: "this is not permitted",
    errno.EPERM: "this is not permitted",
    errno.EMFILE: "too many files are open",
    errno.ENFILE: "too many files are open",
    errno.ENOENT: "the directory is gone",
    errno.ENOTDIR: "a part of the path is not a directory",
    errno.ENAMETOOLONG: "the path is too long",
    errno.EEXIST: "a file is in the way",
}


def write_durably(path: Path, content: bytes) -> None:
    """Put these bytes under this name, for good.

    Raises
    ------
    ResumableError
        when the system refuses any step; no temporary file is left.
    """
    temporary = path.with_name(f"{TEMPORARY_PREFIX}{path.name}")
    with told_as_sentence(path, len(content)):
        try:
            _write_file(temporary, content)
            os.replace(temporary, path)  # noqa: PTH105 - the one call the promise rests on
        except BaseException:
            with contextlib.suppress(OSError):
                temporary.unlink()
            raise
        _sync_directory(path.parent)


def make_directory(path: Path) -> None:
    """Make a directory and those above it, for good.

    Raises
    ------
    ResumableError
        when the system refuses.
    """
    if path.is_dir():
        return
    with told_as_sentence(path, 0):
        if not path.parent.is_dir():
            make_directory(path.parent)
        path.mkdir(exist_ok=True)
        _sync_directory(path.parent)


@contextlib.contextmanager
def told_as_sentence(path: Path, size: int) -> Iterator[None]:
    """Turn a refusal of the system into one sentence with the path, the reason and the remedy."""
    try:
        yield
    except OSError as error:
        if error.errno in {errno.ENOSPC, errno.EDQUOT}:
            needed = f"{max(size, 1) / MEGABYTE:.3g} MB are needed for the next file"
            raise ResumableError(f"{path.parent}: no space is left, {needed}; free some and {AGAIN}") from error
        reason = REASONS.get(error.errno or 0, error.strerror or str(error))
        raise ResumableError(f"{path} cannot be written: {reason}; {AGAIN}") from error


def _write_file(path: Path, content: bytes) -> None:
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o666)
    try:
        rest = memoryview(content)
        while rest:
            rest = rest[os.write(descriptor, rest) :]
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _sync_directory(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)

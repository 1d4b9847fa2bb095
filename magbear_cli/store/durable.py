"""Write a file whole and for good, or leave no trace of the attempt.

Temporary file in the same directory, every byte, fsync, rename, fsync of the directory: at every instant the name
holds the old content or the new one, and after the last step a power cut cannot take it back.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from magbear_cli.errors import ResumableError

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer as Buffer

TEMPORARY_PREFIX = ".tmp-"
MEGABYTE = 1e6
HELD_BACK_BYTES = 4 << 20
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


class WholeFile(io.RawIOBase):
    """A file open for writing that never complains while it is written.

    The HDF5 library does not survive a refusal of the system (a full disk ends the process), so the first one is kept
    here, everything after it is taken and thrown away, and ``settle`` raises it. The library writes a case in four
    hundred pieces; the end of the file is held back in memory until it is worth a call of the system.
    """

    def __init__(self, descriptor: int) -> None:
        """Write through this descriptor of an empty file, which stays the caller's."""
        self._descriptor = descriptor
        self._place = 0
        self._base = 0  # what is before it was written, what is from it on is held back
        self._tail = bytearray()
        self._refusal: OSError | None = None

    def look_for_refusal(self) -> None:
        """Raise what the system said when it refused something; do nothing if it did not."""
        if self._refusal is not None:
            raise self._refusal

    def settle(self) -> None:
        """Write what was held back, and raise what the system refused now or before."""
        held, self._tail = self._tail, bytearray()
        self._put(self._base, held)
        self._base += len(held)
        self.look_for_refusal()

    def write(self, content: Buffer, /) -> int:
        """Take these bytes, all of them."""
        whole = memoryview(content).cast("B")
        before = max(0, min(len(whole), self._base - self._place))
        if before:
            self._put(self._place, whole[:before])
        if rest := whole[before:]:
            start = self._place + before - self._base
            self._tail.extend(bytes(max(0, start - len(self._tail))))
            self._tail[start : start + len(rest)] = rest
        self._place += len(whole)
        if len(self._tail) > HELD_BACK_BYTES:
            with contextlib.suppress(OSError):  # it is kept
                self.settle()
        return len(whole)

    def readinto(self, buffer: Buffer, /) -> int:
        """Give back what was written; nothing of sense after a refusal."""
        whole = memoryview(buffer).cast("B")
        before = max(0, min(len(whole), self._base - self._place))
        found = self._get(self._place, before)
        start = max(0, self._place - self._base)
        found += self._tail[start : start + len(whole) - before]
        whole[: len(found)] = found
        whole[len(found) :] = bytes(len(whole) - len(found))
        self._place += len(whole)
        return len(whole)

    def seek(self, offset: int, whence: int = os.SEEK_SET, /) -> int:
        """Go to a place."""
        end = self._base + len(self._tail)
        self._place = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._place, os.SEEK_END: end}[whence]
        return self._place

    def tell(self) -> int:
        """The place of the next byte."""
        return self._place

    def truncate(self, size: int | None = None, /) -> int:
        """Make the file so long."""
        length = self._place if size is None else size
        with contextlib.suppress(OSError):  # it is kept
            self.settle()
        try:
            if self._refusal is None:
                os.ftruncate(self._descriptor, length)
        except OSError as error:
            self._refusal = error
        self._base = length
        return length

    def _put(self, place: int, content: Buffer) -> None:
        with memoryview(content) as rest:
            done = 0
            try:
                while done < len(rest) and self._refusal is None:
                    done += os.pwrite(self._descriptor, rest[done:], place + done)
            except OSError as error:
                self._refusal = error

    def _get(self, place: int, size: int) -> bytes:
        """Bytes that were written; zeros where there are none."""
        try:
            found = b"" if self._refusal or not size else os.pread(self._descriptor, size, place)
        except OSError as error:
            self._refusal, found = error, b""
        return found + bytes(size - len(found))

    def readable(self) -> bool:
        """What was written can be read."""
        return True

    def writable(self) -> bool:
        """Yes."""
        return True

    def seekable(self) -> bool:
        """Yes."""
        return True


@contextlib.contextmanager
def written_durably(path: Path, size: int) -> Iterator[WholeFile]:
    """A file that stands under this name, for good, when the context ends well; ``size`` is what it takes, in bytes.

    Raises
    ------
    ResumableError
        when the system refuses any step; no temporary file is left, and an older file stands as it was.
    """
    temporary = path.with_name(f"{TEMPORARY_PREFIX}{path.name}")
    with told_as_sentence(path, size):
        try:
            descriptor = os.open(temporary, os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o666)
            try:
                file = WholeFile(descriptor)
                yield file
                file.settle()
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
            os.replace(temporary, path)  # noqa: PTH105 - the one call the promise rests on
        except BaseException:
            with contextlib.suppress(OSError):
                os.unlink(temporary)  # noqa: PTH108 - beside its opposite
            raise
        _sync_directory(path.parent)


def write_durably(path: Path, content: bytes) -> None:
    """Put these bytes under this name, for good.

    Raises
    ------
    ResumableError
        when the system refuses any step; no temporary file is left.
    """
    with written_durably(path, len(content)) as file:
        file.write(content)


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


def _sync_directory(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)

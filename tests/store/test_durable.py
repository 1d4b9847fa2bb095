"""A file is written whole or not at all, and a refusal of the system becomes a sentence."""

from __future__ import annotations

import errno
import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from magbear_cli.errors import ResumableError
from magbear_cli.store.durable import make_directory, write_durably


def test_a_full_disk_loses_nothing_and_says_what_is_needed(mounted: Callable[[str], Path]) -> None:
    """On a file system that is really full the old file stands, no temporary file is left, and the MB are named."""
    folder = mounted("size=1m")
    path = folder / "results.h5"
    write_durably(path, b"a" * 400_000)
    with pytest.raises(ResumableError, match=r"no space is left, 0\.9 MB"):
        write_durably(path, b"b" * 900_000)
    assert path.read_bytes() == b"a" * 400_000
    assert [left.name for left in folder.iterdir()] == ["results.h5"]
    write_durably(path, b"c" * 500_000)


def test_a_read_only_file_system_is_named(mounted: Callable[[str], Path]) -> None:
    """Where nothing can be written the sentence says so; root is refused like everyone."""
    folder = mounted("size=1m")
    subprocess.run(["mount", "-o", "remount,ro", folder], check=True)
    with pytest.raises(ResumableError, match="read-only"):
        write_durably(folder / "x", b"1")
    with pytest.raises(ResumableError, match="read-only"):
        make_directory(folder / "a" / "b")


@pytest.mark.parametrize("call", ["open", "pwrite", "fsync", "replace"])
@pytest.mark.parametrize("number", [errno.EIO, errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EMFILE, errno.EPROTO])
def test_every_step_may_be_refused(call: str, number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whichever call fails, and how: a sentence, the old content or the new one, and no temporary file."""
    path = tmp_path / "x"
    write_durably(path, b"old")

    def refuse(*_: object, **__: object) -> None:
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as patch:
        patch.setattr(os, call, refuse)
        with pytest.raises(ResumableError, match="run the same command again"):
            write_durably(path, b"new")
    assert path.read_bytes() == b"old"
    assert [left.name for left in tmp_path.iterdir()] == ["x"]


def test_short_writes_are_continued(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The system may take fewer bytes than offered; the rest is offered again."""
    write = os.pwrite
    monkeypatch.setattr(os, "pwrite", lambda descriptor, content, at: write(descriptor, bytes(content)[:3], at))
    write_durably(tmp_path / "x", b"0123456789")
    assert (tmp_path / "x").read_bytes() == b"0123456789"


def test_a_file_in_the_way_of_a_directory_is_named(tmp_path: Path) -> None:
    """A path that runs through a file ends in a sentence."""
    (tmp_path / "file").touch()
    with pytest.raises(ResumableError, match="file"):
        make_directory(tmp_path / "file" / "below")

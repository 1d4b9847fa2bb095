"""Where matplotlib keeps its cache."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from magbear_cli.report.matplotlib_home import VARIABLE, settle_matplotlib_home


def test_a_home_that_cannot_be_written_is_replaced(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Below a file no cache can be kept: matplotlib is pointed to a directory of its own."""
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file" / "cache"))
    monkeypatch.setenv(VARIABLE, "")
    settle_matplotlib_home()
    directory = Path(os.environ[VARIABLE])
    assert directory.is_dir()
    shutil.rmtree(directory)


@pytest.mark.parametrize("own", ["", "chosen"])
def test_a_home_that_works_is_left_alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, own: str) -> None:
    """A writable cache, and a directory that the user chose, stay as they are."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv(VARIABLE, own)
    settle_matplotlib_home()
    assert os.environ[VARIABLE] == own

"""Somewhere for matplotlib to keep its font cache, also where the home directory is read-only or missing."""

from __future__ import annotations

import atexit
import os
import shutil
import tempfile
from pathlib import Path

VARIABLE = "MPLCONFIGDIR"


def settle_matplotlib_home() -> None:
    """Before matplotlib is imported: point it to a directory for this process alone where its own cannot be written."""
    if os.environ.get(VARIABLE) or any(_is_writable(path) for path in _own_homes()):
        return
    directory = tempfile.mkdtemp(prefix="magbear-matplotlib-")
    os.environ[VARIABLE] = directory
    atexit.register(shutil.rmtree, directory, ignore_errors=True)


def _own_homes() -> list[Path]:
    """Where matplotlib would look, as it documents."""
    try:
        home = Path.home()
    except RuntimeError:  # no such user, no HOME
        return []
    base = os.environ.get("XDG_CACHE_HOME")
    return [Path(base) / "matplotlib"] if base else [home / ".cache" / "matplotlib"]


def _is_writable(path: Path) -> bool:
    existing = next((place for place in (path, *path.parents) if place.exists()), None)
    return existing is not None and existing.is_dir() and os.access(existing, os.W_OK | os.X_OK)

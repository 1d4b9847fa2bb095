"""The files of an export on disk."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path

from magbear_cli.errors import ResumableError
from magbear_cli.export.c_header import c_files
from magbear_cli.export.handover import Handover
from magbear_cli.export.json_file import json_files
from magbear_cli.export.mat_file import mat_files
from magbear_cli.export.scripts import python_files, ross_files

FORMATS: Mapping[str, Callable[[Handover], dict[str, bytes]]] = {
    "mat": mat_files,
    "json": json_files,
    "c": c_files,
    "python": python_files,
    "ross": ross_files,
}


def write_export(handover: Handover, form: str, directory: Path) -> list[Path]:
    """Write the files of one format into a directory and answer their paths; the same controller gives the same bytes.

    Raises
    ------
    InputError
        when the format does not fit the controller.
    ResumableError
        when the system refuses a file.
    """
    files = FORMATS[form](handover)
    written = []
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            path = directory / name
            temporary = path.with_name(f".tmp-{name}")
            temporary.write_bytes(content)
            temporary.replace(path)
            written.append(path)
    except OSError as error:
        where = error.filename or directory
        raise ResumableError(f"{os.fspath(where)}: it could not be written: {error.strerror or error}") from error
    return written

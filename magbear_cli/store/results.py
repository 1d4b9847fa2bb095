"""The one file of a whole study, ``results.h5``: the same study gives the same bytes, and it reads back exactly."""

from __future__ import annotations

from pathlib import Path

from magbear_cli.errors import InputError, ResumableError
from magbear_cli.store.durable import write_durably
from magbear_cli.store.forms import RESULTS_FORMAT, grow_study, harvest_study
from magbear_cli.store.hdf5 import build_image, is_hdf5, read_file
from magbear_cli.store.layout import LAYOUT_VERSION
from magbear_cli.study.outcome import StudyResults


def write_results(path: Path, results: StudyResults) -> None:
    """Write a study's results under this name, whole or not at all; cases lie in the order of their index.

    Raises
    ------
    ResumableError
        when the system refuses; an older file of this name then stands as it was.
    """
    write_durably(path, build_image(grow_study(results)))


def read_results(path: Path) -> StudyResults:
    """The study that a results file holds, exactly as it was written.

    Raises
    ------
    InputError
        when there is no such file, or it is not a results file of this layout.
    ResumableError
        when it is one and is damaged.
    """
    if not path.is_file():
        raise InputError(f"{path}: there is no such results file")
    if not is_hdf5(path):
        raise InputError(f"{path} is not an HDF5 file; a run's results are in the results.h5 of its directory")
    try:
        root = read_file(path)
    except (OSError, KeyError, RuntimeError, ValueError, UnicodeDecodeError) as error:
        raise ResumableError(f"{path} cannot be read as a results file: {_first_line(error)}") from error
    if root.attributes.get("format") != RESULTS_FORMAT:
        raise InputError(f"{path} is an HDF5 file, but not one of magbear results")
    version = root.attributes.get("layout_version")
    if version != LAYOUT_VERSION:
        raise InputError(f"{path} has layout {version}, this version of magbear reads {LAYOUT_VERSION}")
    try:
        return harvest_study(root)
    except (KeyError, TypeError, ValueError) as error:
        raise ResumableError(
            f"{path} is damaged: {_first_line(error)}; run the study again to write it anew"
        ) from error


def _first_line(error: Exception) -> str:
    return str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__

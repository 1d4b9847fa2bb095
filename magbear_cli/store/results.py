"""The one file of a whole study, ``results.h5``: the same study gives the same bytes, and it reads back exactly.

Cases go through one at a time, on the way in and on the way out, so a study of many takes no more memory than one of
few.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from magbear_cli.errors import InputError, ResumableError
from magbear_cli.store.durable import written_durably
from magbear_cli.store.forms import (
    RESULTS_FORMAT,
    case_index,
    case_name,
    counted,
    grow_case,
    grow_overview,
    grow_provenance,
    harvest_case,
    harvest_provenance,
    is_intact,
    overview_row,
    root_attributes,
    sealed,
)
from magbear_cli.store.hdf5 import FileReader, FileWriter, is_hdf5
from magbear_cli.store.layout import LAYOUT_VERSION, TABLE_FIELDS
from magbear_cli.store.tree import Branch
from magbear_cli.study.outcome import CaseOutcome, StudyResults

OVERVIEW, PROVENANCE = "cases", "provenance"
CASE_BYTES = 300_000  # what a case with simulations takes, to say how much room is missing


def write_results(path: Path, results: StudyResults) -> None:
    """Write a study's results under this name, whole or not at all; cases lie in the order of their index.

    Raises
    ------
    ResumableError
        when the system refuses; an older file of this name then stands as it was.
    """
    outcomes = sorted(results.outcomes, key=lambda outcome: outcome.index)
    write_outcomes(path, results, outcomes, len(outcomes) * CASE_BYTES)


def write_outcomes(path: Path, about: StudyResults, outcomes: Iterable[CaseOutcome], size: int) -> None:
    """Write these outcomes, which come in the order of their index, with the origin that ``about`` tells.

    Each outcome is asked for when the one before is written; ``size`` is what the file will take, about, in bytes.

    Raises
    ------
    ResumableError
        when the system refuses; an older file of this name then stands as it was.
    """
    columns: dict[str, list[object]] = {entry.name: [] for entry in TABLE_FIELDS}
    with written_durably(path, size) as file:
        writer = FileWriter(file)
        try:
            for outcome in outcomes:
                writer.add(case_name(outcome.index), sealed(grow_case(outcome)))
                for name, cell in overview_row(outcome).items():
                    columns[name].append(cell)
            writer.add(OVERVIEW, sealed(grow_overview(columns)))
            writer.add(PROVENANCE, sealed(grow_provenance(about)))
            writer.close(root_attributes(str(next(iter(columns["group"]), OVERVIEW))))
        finally:
            writer.discard()


def read_results(path: Path, most_whole: int | None = None, only: Sequence[str] = ()) -> StudyResults:
    """The study that a results file holds, exactly as it was written.

    Of cases after the first ``most_whole`` the samples are left out (None: all are whole); ``only`` leaves out the
    cases whose identity begins with none of these.

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
        with FileReader(path) as file:
            _look_at(file, path)
            return _harvested(file, path, most_whole, only)
    except (OSError, KeyError, RuntimeError, ValueError, UnicodeDecodeError) as error:
        raise ResumableError(f"{path} cannot be read as a results file: {_first_line(error)}") from error


def _look_at(file: FileReader, path: Path) -> None:
    """Refuse what is no results file of this layout."""
    attributes = file.attributes()
    if attributes.get("format") != RESULTS_FORMAT:
        raise InputError(f"{path} is an HDF5 file, but not one of magbear results")
    version = attributes.get("layout_version")
    if version != LAYOUT_VERSION:
        raise InputError(f"{path} has layout {version}, this version of magbear reads {LAYOUT_VERSION}")


def _harvested(file: FileReader, path: Path, most_whole: int | None, only: Sequence[str]) -> StudyResults:
    names = counted(file.names())
    outcomes: list[CaseOutcome] = []
    name = PROVENANCE
    try:
        about = harvest_provenance(_intact(file, PROVENANCE))
        for name in names:
            branch = _intact(file, name)
            if name not in {OVERVIEW, PROVENANCE}:
                outcome = harvest_case(branch, case_index(name))
                if only and not outcome.case_id.startswith(tuple(only)):
                    continue
                is_whole = most_whole is None or len(outcomes) < most_whole
                outcomes.append(outcome if is_whole else outcome.without_samples())
    except (KeyError, TypeError, ValueError) as error:
        what = _first_line(error)
        raise ResumableError(f"{path} is damaged at {name}: {what}; run the study again to write it anew") from error
    return replace(about, outcomes=tuple(outcomes))


def _intact(file: FileReader, name: str) -> Branch:
    branch = file.branch(name)
    if not is_intact(branch):
        raise ValueError("it is not what was stored")
    return branch


def _first_line(error: Exception) -> str:
    return str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__

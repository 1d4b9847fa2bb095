"""Controllers that exist already: the matrices of a case of a results file, or of a JSON file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from magbear_cli.errors import InputError

if TYPE_CHECKING:
    from magbear_cli.study.outcome import StudyResults

MATRICES = ("a", "b", "c", "d")


def results_file(path: Path) -> Path:
    """The results file that a path means: itself, or the one in a run's directory.

    Raises
    ------
    InputError
        when the directory is that of a run that was killed before it could write one.
    """
    if not path.is_dir():
        return path
    file, study = path / "results.h5", path / "study.yaml"
    if study.is_file() and not file.exists():
        raise InputError(f"{path} is a run without results yet; magbear run {study} -o {path} goes on with it")
    return file


class StoredControllers:
    """The controllers that a study names by a path from its folder, each file read once."""

    def __init__(self, folder: Path | None) -> None:
        """Nothing is read yet."""
        self._folder = Path() if folder is None else folder
        self._results: dict[Path, StudyResults] = {}

    def put_into(self, inputs: Mapping[str, Any]) -> dict[str, Any]:
        """The inputs of a case with the matrices of a ``stored`` controller in place of its file's name.

        Raises
        ------
        InputError
            when the file, or the case in it, holds no controller.
        """
        controller = inputs["controller"]
        if controller["method"] != "stored":
            return dict(inputs)
        path = self._folder / controller["path"]
        found = _from_json(path) if path.suffix == ".json" else self._from_results(path, controller["case"])
        return {**inputs, "controller": {"method": "stored", **found}}

    def _from_results(self, path: Path, case: str | None) -> dict[str, Any]:
        holders = [outcome for outcome in self._read(path).outcomes if outcome.controller is not None]
        chosen = {outcome.case_id: outcome for outcome in holders if case is None or outcome.case_id.startswith(case)}
        if len(chosen) != 1:
            known = ", ".join(outcome.case_id for outcome in holders[:8]) or "none"
            wish = "name one of its cases with the key case" if case is None else f"no single case of it is '{case}'"
            raise InputError(f"{path}: {wish}; cases with a controller: {known}")
        ((case_id, outcome),) = chosen.items()
        matrices = {name: getattr(outcome.controller, name).tolist() for name in MATRICES}
        return {"source": f"{path.name}, case {case_id}", **matrices}

    def _read(self, path: Path) -> StudyResults:
        if path not in self._results:
            from magbear_cli.store.results import read_results

            self._results[path] = read_results(results_file(path))
        return self._results[path]


def _from_json(path: Path) -> dict[str, Any]:
    """A controller of a JSON file {"a": [[…]], "b": …, "c": …, "d": …}, SI units, u = K y."""
    import json

    from magbear_cli.spec.files import read_text
    from magbear_cli.spec.problems import Faults

    faults = Faults()
    text = read_text(path, faults)
    faults.stop()
    try:
        document = json.loads(text or "")
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: this is not JSON: {error}") from error
    if not isinstance(document, dict) or not set(MATRICES) <= set(document):
        raise InputError(f'{path}: a controller is an object with the matrices "a", "b", "c" and "d"')
    matrices = {name: _matrix(document[name], name, path) for name in MATRICES}
    states = len(matrices["a"])
    for name, rows, columns in (("a", states, states), ("b", states, 1), ("c", 1, states), ("d", 1, 1)):
        found = matrices[name]
        if len(found) != rows or any(len(row) != columns for row in found):
            raise InputError(
                f"{path}: {name} must have {rows} rows and {columns} columns: one position in, one current out"
            )
    return {"source": path.name, **matrices}


def _matrix(value: object, name: str, path: Path) -> list[list[float]]:
    rows = value if isinstance(value, list) else None
    if rows is None or not all(isinstance(row, list) and all(_is_number(entry) for entry in row) for row in rows):
        raise InputError(f"{path}: {name} must be a matrix, a list of lists of finite numbers")
    return [[float(entry) for entry in row] for row in rows]


def _is_number(value: object) -> bool:
    try:
        return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:  # an integer beyond the largest double
        return False

"""Controllers that exist already: the matrices of a case of a results file, or of a JSON or MAT-file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from magbear_cli.errors import InputError
from magbear_cli.library.controller_file import MATRICES, SUFFIXES, read_controller_file

if TYPE_CHECKING:
    from magbear_cli.study.outcome import StudyResults


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
        if path.suffix.lower() in SUFFIXES:
            found: dict[str, Any] = {"source": path.name, **read_controller_file(path)}
        else:
            found = self._from_results(path, controller["case"])
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

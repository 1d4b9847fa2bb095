"""Controllers that exist already: the matrices of a case of a results file, or of a JSON file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from magbear_cli.errors import InputError

MATRICES = ("a", "b", "c", "d")


def with_stored_controllers(inputs: Mapping[str, Any], folder: Path | None) -> dict[str, Any]:
    """The inputs of a case with the matrices of a ``stored`` controller in place of its file's name.

    Raises
    ------
    InputError
        when the file, or the case in it, holds no controller.
    """
    controller = inputs["controller"]
    if controller["method"] != "stored":
        return dict(inputs)
    path = (folder or Path()) / controller["path"]
    found = _from_json(path) if path.suffix == ".json" else _from_results(path, controller["case"])
    return {**inputs, "controller": {"method": "stored", **found}}


def _from_json(path: Path) -> dict[str, Any]:
    """A controller of a JSON file {"a": [[…]], "b": …, "c": …, "d": …}, SI units, positive feedback."""
    try:
        document = json.loads(path.read_text("utf-8"))
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise InputError(f"{path}: no controller can be read from it: {error}") from error
    if not isinstance(document, dict) or not set(MATRICES) <= set(document):
        raise InputError(f'{path}: a controller is an object with the matrices "a", "b", "c" and "d"')
    return {"source": path.name, **{name: _matrix(document[name], name, path) for name in MATRICES}}


def _matrix(value: object, name: str, path: Path) -> list[list[float]]:
    rows = value if isinstance(value, list) else None
    if rows is None or not all(
        isinstance(row, list) and all(isinstance(x, int | float) and not isinstance(x, bool) for x in row)
        for row in rows
    ):
        raise InputError(f"{path}: {name} must be a matrix, a list of lists of numbers")
    return [[float(x) for x in row] for row in rows]


def _from_results(path: Path, case: str | None) -> dict[str, Any]:
    from magbear_cli.store.results import read_results

    results = read_results(results_file(path))
    holders = [outcome for outcome in results.outcomes if outcome.controller is not None]
    chosen = [outcome for outcome in holders if case is None or outcome.case_id.startswith(case)]
    if len(chosen) != 1 or chosen[0].controller is None:
        known = ", ".join(outcome.case_id for outcome in holders[:8]) or "none"
        wish = "exactly one case must hold a controller" if case is None else f"no single case is {case}"
        raise InputError(f"{path}: {wish}; cases with a controller: {known}")
    system = chosen[0].controller
    matrices = {name: getattr(system, name).tolist() for name in MATRICES}
    return {"source": f"{path.name}, case {chosen[0].case_id}", **matrices}


def results_file(path: Path) -> Path:
    """The results file that a path means: itself, or the one in a run's directory."""
    return path / "results.h5" if path.is_dir() else path

"""Controllers that exist already, believed or refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from magbear_cli.errors import InputError, MagbearError
from magbear_cli.library.stored import StoredControllers
from magbear_cli.store.results import read_results

LEAD = {"a": [[-2e4]], "b": [[1.0]], "c": [[1.5e11]], "d": [[-7.6e6]]}


def _inputs(path: Path | str, case: str | None = None) -> dict[str, Any]:
    return {"mass_kg": 3.6, "controller": {"method": "stored", "path": str(path), "case": case}}


def test_other_methods_are_left_alone() -> None:
    """Inputs without a stored controller are given back as they are."""
    inputs = {"controller": {"method": "lqg", "r": 1.0}}
    assert StoredControllers(None).put_into(inputs) == inputs


def test_a_json_controller_is_put_in(tmp_path: Path) -> None:
    """The matrices stand in the inputs in place of the path, which is counted from the study's folder."""
    (tmp_path / "lead.json").write_text(json.dumps(LEAD), "utf-8")
    found = StoredControllers(tmp_path).put_into(_inputs("lead.json"))
    assert found == {"mass_kg": 3.6, "controller": {"method": "stored", "source": "lead.json", **LEAD}}


@pytest.mark.parametrize("name", ["nowhere.json", "nowhere.h5", ".", "study.yaml"])
def test_a_file_that_is_none_is_refused(tmp_path: Path, name: str) -> None:
    """A missing file, a folder without results and a file of another kind are told."""
    (tmp_path / "study.yaml").write_text("magbear: 1", "utf-8")
    with pytest.raises(MagbearError):
        StoredControllers(tmp_path).put_into(_inputs(name))


def test_a_case_of_a_run_is_taken(finished: Path) -> None:
    """A controller comes out of a results file with the very numbers that went in."""
    outcome = read_results(finished / "results.h5").outcomes[1]
    for path in (finished, finished / "results.h5"):
        found = StoredControllers(None).put_into(_inputs(path, outcome.case_id[:9]))["controller"]
        assert outcome.controller is not None
        assert found["a"] == outcome.controller.a.tolist()
        assert found["source"] == f"{path.name}, case {outcome.case_id}"


@pytest.mark.parametrize(("case", "says"), [(None, "name one of its cases"), ("zz", "no single case of it is 'zz'")])
def test_an_unclear_case_is_refused_with_those_there_are(finished: Path, case: str | None, says: str) -> None:
    """Two controllers and no name, or a name of none, are answered with the list."""
    with pytest.raises(InputError, match=says) as caught:
        StoredControllers(None).put_into(_inputs(finished, case))
    assert read_results(finished / "results.h5").outcomes[0].case_id in str(caught.value)

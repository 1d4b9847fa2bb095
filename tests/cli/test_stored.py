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


def test_a_static_gain_has_no_states(tmp_path: Path) -> None:
    """Empty matrices are those of a controller without states."""
    gain = {"a": [], "b": [], "c": [[]], "d": [[-1e6]]}
    (tmp_path / "gain.json").write_text(json.dumps(gain), "utf-8")
    assert StoredControllers(tmp_path).put_into(_inputs("gain.json"))["controller"]["d"] == [[-1e6]]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "not JSON"),
        ("[" * 100_000, "not JSON"),
        ("[]", "a controller is an object"),
        ('{"a": 1}', "a controller is an object"),
        (json.dumps({**LEAD, "a": 1}), "a must be a matrix"),
        (json.dumps({**LEAD, "b": [[True]]}), "b must be a matrix"),
        (json.dumps({**LEAD, "b": [1]}), "b must be a matrix"),
        (json.dumps({**LEAD, "c": [["1"]]}), "c must be a matrix"),
        (json.dumps({**LEAD, "d": [[float("nan")]]}), "d must be a matrix"),
        (json.dumps({**LEAD, "d": [[10**400]]}), "d must be a matrix"),
        (json.dumps({**LEAD, "d": [[1, 2]]}), "d must have 1 rows and 1 columns"),
        (json.dumps({**LEAD, "a": [[1, 2], [3]]}), "a must have 2 rows and 2 columns"),
        (json.dumps({**LEAD, "b": [[1], [1]]}), "b must have 1 rows and 1 columns"),
    ],
)
def test_what_is_no_controller_is_refused_with_the_files_name(tmp_path: Path, text: str, says: str) -> None:
    """Every way in which a file can be wrong has its sentence."""
    (tmp_path / "odd.json").write_text(text, "utf-8")
    with pytest.raises(InputError, match=r"odd\.json") as caught:
        StoredControllers(tmp_path).put_into(_inputs("odd.json"))
    assert says in str(caught.value)


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

"""Controller files, believed or refused: matrices of continuous time, and no key without a meaning."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from magbear_cli.errors import InputError
from magbear_cli.library.controller_file import read_controller_file

LEAD = {"a": [[-2e4]], "b": [[1.0]], "c": [[1.5e11]], "d": [[-7.6e6]]}
SAMPLED = {"a": [[-0.5]], "b": [[1.0]], "c": [[-1000.0]], "d": [[-4000.0]], "dt": 2e-5}


def _json(folder: Path, document: object) -> Path:
    path = folder / "k.json"
    path.write_text(json.dumps(document), "utf-8")
    return path


def _mat(folder: Path, **variables: Any) -> Path:  # noqa: ANN401 - scipy takes anything
    path = folder / "k.mat"
    savemat(path, {**{key.upper(): np.array(value) for key, value in LEAD.items()}, **variables})
    return path


def test_a_static_gain_has_no_states(tmp_path: Path) -> None:
    """Empty matrices are those of a controller without states."""
    gain = {"a": [], "b": [], "c": [[]], "d": [[-1e6]]}
    (tmp_path / "gain.json").write_text(json.dumps(gain), "utf-8")
    assert read_controller_file(tmp_path / "gain.json")["d"] == [[-1e6]]


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
        ('{"num": [1], "den": [1, 2]}', "unknown key 'num'"),
        ('{"a": [], "a": [], "b": [], "c": [[]], "d": [[1.0]]}', "the key 'a' stands twice"),
        (json.dumps({**LEAD, "a": [[1, 2], [3]]}), "a must have 2 rows and 2 columns"),
        (json.dumps({**LEAD, "b": [[1], [1]]}), "b must have 1 rows and 1 columns"),
    ],
)
def test_what_is_no_controller_is_refused_with_the_files_name(tmp_path: Path, text: str, says: str) -> None:
    """Every way in which a file can be wrong has its sentence."""
    (tmp_path / "odd.json").write_text(text, "utf-8")
    with pytest.raises(InputError, match=r"odd\.json") as caught:
        read_controller_file(tmp_path / "odd.json")
    assert says in str(caught.value)


def test_a_sampled_controller_is_refused_with_the_reason(tmp_path: Path) -> None:
    """A sample time is told to be one, and that the controller must be continuous."""
    with pytest.raises(
        InputError, match=r"k\.json: 'dt' says that the controller is sampled, and it must be continuous"
    ):
        read_controller_file(_json(tmp_path, SAMPLED))


@pytest.mark.parametrize("key", ["dt", "Ts", "ts", "sample_time_s", "sampling_time"])
@pytest.mark.parametrize("value", [2e-5, -1, True, "1 ms"])
def test_every_name_of_a_sample_time_is_known(tmp_path: Path, key: str, value: object) -> None:
    """Whatever it is called and however it is written, also where other tools mean an unknown sample time."""
    with pytest.raises(InputError, match="must be continuous"):
        read_controller_file(_json(tmp_path, {**LEAD, key: value}))


@pytest.mark.parametrize("key", ["dt", "Ts"])
@pytest.mark.parametrize("value", [None, 0, 0.0])
def test_continuous_time_may_be_said(tmp_path: Path, key: str, value: object) -> None:
    """Null and 0 are how other tools write that a controller is continuous."""
    assert read_controller_file(_json(tmp_path, {**LEAD, key: value})) == LEAD


@pytest.mark.parametrize(
    ("key", "says"),
    [
        ("conventon", "unknown key 'conventon', did you mean 'convention'"),
        ("zeta", "unknown key 'zeta', legal are a, b, c, d"),
        ("e", "unknown key 'e', legal are a, b, c, d"),
    ],
)
def test_a_key_without_a_meaning_is_refused_with_the_nearest(tmp_path: Path, key: str, says: str) -> None:
    """No key of a file is silently left unread, a descriptor matrix least of all."""
    with pytest.raises(InputError) as caught:
        read_controller_file(_json(tmp_path, {**LEAD, key: [[1.0]]}))
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_capital_letters_are_told_the_small_ones(tmp_path: Path) -> None:
    """A file with A to D is answered with the keys that are missing."""
    with pytest.raises(InputError, match="unknown key 'A', did you mean 'a'"):
        read_controller_file(_json(tmp_path, {key.upper(): value for key, value in LEAD.items()}))


def test_a_mat_file_is_read(tmp_path: Path) -> None:
    """A, B, C and D of a MAT-file are those of the same JSON file; Ts = 0, empty or not there is continuous time."""
    for times in ({}, {"Ts": 0.0}, {"dt": np.zeros((0, 0))}):
        assert read_controller_file(_mat(tmp_path, **times)) == LEAD


def test_a_static_gain_of_a_mat_file_has_no_states(tmp_path: Path) -> None:
    """Empty matrices keep their sizes."""
    empty = {"A": np.zeros((0, 0)), "B": np.zeros((0, 1)), "C": np.zeros((1, 0)), "D": -1e6}
    assert read_controller_file(_mat(tmp_path, **empty)) == {"a": [], "b": [], "c": [[]], "d": [[-1e6]]}


@pytest.mark.parametrize(
    ("variables", "says"),
    [
        ({"Ts": 2e-5}, "'Ts' says that the controller is sampled"),
        ({"dt": -1}, "'dt' says that the controller is sampled"),
        ({"a": 1.0}, "unknown key 'a', did you mean 'A'"),
        ({"E": np.eye(1)}, "unknown key 'E', legal are A, B, C, D"),
        ({"A": 1j}, "A must be a matrix"),
        ({"D": np.nan}, "D must be a matrix"),
        ({"B": [[1.0, 2.0]]}, "B must have 1 rows and 1 columns"),
    ],
)
def test_a_mat_file_is_refused_as_a_json_file_is(tmp_path: Path, variables: dict[str, Any], says: str) -> None:
    """One sentence with the file, the key and what is wrong with it."""
    with pytest.raises(InputError, match=r"k\.mat: ") as caught:
        read_controller_file(_mat(tmp_path, **variables))
    assert says in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"no MAT-file", b"MATLAB 5.0 MAT-file".ljust(126) + b"\0\1", b"\xff" * 4096])
def test_what_is_no_mat_file_is_told(tmp_path: Path, content: bytes) -> None:
    """Damage and other formats are a sentence."""
    (tmp_path / "k.mat").write_bytes(content)
    with pytest.raises(InputError, match=r"k\.mat: "):
        read_controller_file(tmp_path / "k.mat")


def test_a_mat_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    """The system's reason stands in the sentence."""
    with pytest.raises(InputError, match="No such file"):
        read_controller_file(tmp_path / "gone.mat")

"""The file of a controller that exists already: JSON or MAT, of continuous time, every key of it understood or refused.

A JSON file is ``{"a": [[…]], "b": …, "c": …, "d": …}``, a MAT-file has the variables A, B, C and D; SI units, u = K y.
Keys that magbear's own exports write beside the matrices are legal too.
"""

from __future__ import annotations

import io
import math
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from magbear_cli.errors import InputError

SUFFIXES = (".json", ".mat")
MATRICES = ("a", "b", "c", "d")
SAMPLE_TIMES = frozenset(
    {"dt", "ts", "tsam", "sample_time", "sample_time_s", "sampling_time", "sampling_time_s", "sampletime"}
)
JSON_EXPORT_KEYS = frozenset({"name", "study", "case", "units", "convention", "specification", "plant", "sampled"})
MAT_EXPORT_KEYS = frozenset(
    {
        *("name", "about", "input_name", "input_unit", "output_name", "output_unit", "k_i", "k_z", "mass_kg"),
        *("sos", "delay_s", "F", "G", "H", "J", "test_positions_m", "test_currents_a"),
        *("members_mass_kg", "members_k_i", "members_k_z", "members_about"),
        *("W1_num", "W1_den", "omega_c_rad_s", "worst_case"),
        *("A_continuous", "B_continuous", "C_continuous", "D_continuous"),
    }
)
LARGEST_MAT_BYTES = 1 << 24
MOST_NAMED = 3  # unknown keys in one sentence


def read_controller_file(path: Path) -> dict[str, Any]:
    """The matrices of a controller as lists of rows, under ``a``, ``b``, ``c`` and ``d``.

    Raises
    ------
    InputError
        when the file is none of a controller in continuous time, or holds a key that has no meaning here.
    """
    if path.suffix.lower() == ".mat":
        document, names, export_keys = _mat_variables(path), [name.upper() for name in MATRICES], MAT_EXPORT_KEYS
    else:
        document, names, export_keys = _json_object(path), list(MATRICES), JSON_EXPORT_KEYS
    _refuse_sampled(document, path)
    _refuse_unknown(document, names, export_keys, path)
    matrices = {name: _matrix(document[key], key, path) for name, key in zip(MATRICES, names, strict=True)}
    states = len(matrices["a"])
    sizes = ((states, states), (states, 1), (1, states), (1, 1))
    for (rows, columns), key, found in zip(sizes, names, matrices.values(), strict=True):
        if len(found) != rows or any(len(row) != columns for row in found):
            raise InputError(
                f"{path}: {key} must have {rows} rows and {columns} columns: one position in, one current out"
            )
    return matrices


def _json_object(path: Path) -> dict[str, Any]:
    """The object of a JSON file."""
    import json

    from magbear_cli.spec.files import read_text
    from magbear_cli.spec.problems import Faults

    faults = Faults()
    text = read_text(path, faults)
    faults.stop()
    try:
        document = json.loads(text or "", object_pairs_hook=_each_key_once)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: this is not JSON: {error}") from error
    if not isinstance(document, dict):
        raise InputError(f'{path}: a controller is an object with the matrices "a", "b", "c" and "d"')
    return document


def _each_key_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The object of these pairs.

    Raises
    ------
    ValueError
        when a key stands twice, of which JSON would silently keep the last.
    """
    found = dict(pairs)
    if len(found) != len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"the key '{next(key for key in keys if keys.count(key) > 1)}' stands twice")
    return found


def _mat_variables(path: Path) -> dict[str, Any]:
    """The variables of a MAT-file, numbers as nested lists."""
    from scipy.io import loadmat

    _refuse_odd_file(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # a variable that stands twice is told by a warning
            found = loadmat(io.BytesIO(path.read_bytes()))
    except OSError as error:
        raise InputError(f"{path}: the file cannot be read: {error.strerror or error}") from error
    except NotImplementedError as error:
        raise InputError(f"{path}: this is a MAT-file of version 7.3; save it with the option -v7") from error
    except Exception as error:  # scipy answers damage with whatever its parser stumbles over
        raise InputError(f"{path}: this is not a MAT-file") from error
    return {name: _listed(value) for name, value in found.items() if not name.startswith("__")}


def _refuse_odd_file(path: Path) -> None:
    """Refuse what would be waited for, or read without end."""
    if path.exists() and not path.is_file():
        raise InputError(f"{path}: this is not a regular file")
    if path.exists() and path.stat().st_size > LARGEST_MAT_BYTES:
        raise InputError(f"{path}: the file is larger than {LARGEST_MAT_BYTES >> 20} MiB; save the matrices alone")


def _listed(value: Any) -> Any:  # noqa: ANN401 - a MAT-file may hold anything
    """A matrix of real numbers as a list of rows, a matrix of one entry where a number is asked for likewise."""
    kind = getattr(getattr(value, "dtype", None), "kind", "")
    return value.tolist() if kind in {"f", "i", "u"} and hasattr(value, "tolist") else value


def _refuse_sampled(document: Mapping[str, Any], path: Path) -> None:
    """Refuse a sample time; 0 and null are how other tools write continuous time."""
    for key, value in document.items():
        if key.casefold() not in SAMPLE_TIMES:
            continue
        time = value[0][0] if isinstance(value, list) and value and value[0] else value  # a MAT-file knows matrices
        if time is None or value == [] or (_is_number(time) and time == 0):
            continue
        raise InputError(
            f"{path}: '{key}' says that the controller is sampled, and it must be continuous in time: "
            "its loop is judged in s, not in z; give the controller before it was sampled"
        )


def _refuse_unknown(document: Mapping[str, Any], names: list[str], export_keys: Iterable[str], path: Path) -> None:
    """Refuse keys without a meaning and missing matrices, in one sentence."""
    from magbear_cli.spec.problems import did_you_mean, nearest, quoted

    known = {*names, *export_keys}
    unknown = [key for key in document if key not in known and key.casefold() not in SAMPLE_TIMES]
    missing = [name for name in names if name not in document]
    if missing:
        wanted = ", ".join(f'"{name}"' for name in names[:-1]) + f' and "{names[-1]}"'
        sentence = f"a controller is an object with the matrices {wanted}"
    elif unknown:
        sentence = "a controller file has keys that have no meaning here"
    else:
        return
    told = []
    for key in unknown[:MOST_NAMED]:
        meant = nearest(key, missing or [*names, *sorted(export_keys)])
        told.append(f"unknown key {quoted(key)}, {did_you_mean(key, [meant] if meant else names)}")
    raise InputError(f"{path}: " + "; ".join([sentence, *told]))


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

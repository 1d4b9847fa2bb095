"""A grid given on the command line, and the study file it compiles to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

from magbear_cli.errors import InputError
from magbear_cli.spec.cases import LARGEST_COUNT
from magbear_cli.spec.grammar import method_names
from magbear_cli.spec.limits import ASIDE, set_aside
from magbear_cli.spec.models import LARGEST_KG, PARTS, SMALLEST_KG
from magbear_cli.spec.nodes import Node, child_of, plain, rewrite
from magbear_cli.spec.parts import Shelf
from magbear_cli.spec.problems import Faults, did_you_mean, quoted
from magbear_cli.spec.reading import read_nodes
from magbear_cli.spec.scalars import ScalarError, number_hint, plain_scalar
from magbear_cli.spec.sentences import EXAMPLES
from magbear_cli.spec.writing import written

_HEADER: Final = "# Compiled by magbear sweep from its command line; run it again with magbear run.\n"
_THESIS: Final[dict[str, Any]] = {
    "magbear": 1,
    "name": "sweep",
    "bearing": "thesis_thrust",
    "mass_kg": [3.0, 4.5],
    "performance": {"dc_gain": 10.0, "corner_rad_s": 200.0},
    "bandwidth": {"omega_c_rad_s": 20000.0},
    "controller": {"method": "mu_convex"},
}


def parse_grid(text: str) -> list[float]:
    """The values of ``LOW:HIGH:N`` (N of them, evenly spaced in the logarithm, ends exact) or ``a,b,c``.

    Raises
    ------
    InputError
        When the text is neither, or its values are not positive, finite and distinct.
    """
    if ":" not in text:
        values = [_positive(part, text) for part in text.split(",")]
        for index, value in enumerate(values):
            if value in values[:index]:
                raise InputError(f"the grid {quoted(text)} holds {value:g} twice: remove one of the two")
        return values
    parts = text.split(":")
    if len(parts) != 3:
        raise InputError(f"{quoted(text)} is not a grid: write LOW:HIGH:N, as 5000:20000:8, or a list, as 7000,10000")
    low, high, count = _positive(parts[0], text), _positive(parts[1], text), _positive(parts[2], text)
    if low >= high:
        raise InputError(f"the grid {quoted(text)} begins at {low:g} and ends at {high:g}: give the lower end first")
    if count != int(count) or not 2 <= count <= LARGEST_COUNT:
        raise InputError(
            f"the grid {quoted(text)} asks for {count:g} values: give a whole number from 2 to {LARGEST_COUNT}"
        )
    steps = int(count) - 1
    inner = (math.exp(math.log(low) + (math.log(high) - math.log(low)) * i / steps) for i in range(1, steps))
    values = [low, *(float(f"{value:.12g}") for value in inner), high]  # 10000, not 10000.00000000001
    if any(early >= late for early, late in pairwise(values)):
        raise InputError(f"the grid {quoted(text)} is finer than numbers can tell: take fewer values")
    return values


def parse_mass(text: str) -> float | tuple[float, float]:
    """A mass in kg, ``3.6``, or an uncertain range, ``3.0:4.5``.

    Raises
    ------
    InputError
        When the text is neither, or its ends are not positive and rising.
    """
    parts = text.split(":")
    if len(parts) > 2:
        raise InputError(f"{quoted(text)} is not a mass: write 3.6, or a range as 3.0:4.5")
    masses = [_positive(part, text) for part in parts]
    for mass in masses:
        if not SMALLEST_KG <= mass <= LARGEST_KG:
            raise InputError(f"the mass {quoted(text)} does not lie in {SMALLEST_KG:g} to {LARGEST_KG:g} kg")
    if len(masses) == 1:
        return masses[0]
    low, high = masses
    if low >= high:
        remedy = "write one number for a known mass" if low == high else f"write {high:g}:{low:g}"
        raise InputError(f"the mass range {quoted(text)} must rise: {remedy}")
    return low, high


def _positive(part: str, whole: str) -> float:
    """A positive number, read as strictly as in a study."""
    text = part.strip()
    try:
        value = plain_scalar(text)
    except ScalarError as error:
        raise InputError(f"{error.sentence} (in {quoted(whole)}): {error.remedy}") from None
    if isinstance(value, bool) or not isinstance(value, int | float):
        hint = number_hint(text)
        raise InputError(f"{quoted(text)} in {quoted(whole)} is not a number" + (f": {hint}" if hint else ""))
    if value <= 0:
        raise InputError(f"{quoted(text)} in {quoted(whole)} must be greater than 0")
    return float(value)


def compile_sweep(
    wc: Sequence[float],
    masses: Sequence[float | tuple[float, float]],
    methods: Sequence[str],
    base: str | None = None,
    folder: Path | None = None,
) -> str:
    """The text of the study that sweeps a grid over a base study, or over the thesis's thrust bearing.

    One value is set in the base; several become a sweep of that key. What is not given stays as the base has it; a
    method keeps the options that the base gives it. Parts and controllers that the base names by a path from its
    ``folder`` are written out, so that the text can be run from anywhere.

    Raises
    ------
    InputError
        When a method does not exist or the base is not a mapping; the rest is told when the text is read.
    """
    document = dict(_THESIS) if base is None else _base_document(base, folder)
    sweep = document.pop("sweep", None) or {}
    if methods:
        values = [options for method in dict.fromkeys(methods) for options in _options(method, document, sweep)]
        _vary(document, sweep, "controller", values)
    if masses:
        pairs = dict.fromkeys(masses)
        _vary(document, sweep, "mass_kg", [list(mass) if isinstance(mass, tuple) else mass for mass in pairs])
    if wc:
        for key in [key for key in sweep if key == "bandwidth" or key.startswith("bandwidth.")]:
            del sweep[key]
        grid = list(dict.fromkeys(wc))
        document["bandwidth"] = {"omega_c_rad_s": grid[0]}
        if len(grid) > 1:
            sweep["bandwidth.omega_c_rad_s"] = grid
    if sweep:
        document["sweep"] = sweep
    return _HEADER + written(document)


def compile_limits(
    masses: Sequence[float | tuple[float, float]],
    over: Sequence[str],
    tolerance: float | None,
    base: str | None = None,
    folder: Path | None = None,
) -> str:
    """The text of the study that brackets the bandwidth limit over masses and any other keys.

    Controllers, reductions, bandwidth limits, simulations and figures of the base are put aside. ``over`` holds
    ``KEY=LOW:HIGH:N``, ``KEY=a,b,c``, or ``KEY`` alone for the values that the base sweeps it over; other sweeps of
    the base stay only when nothing is asked for.

    Raises
    ------
    InputError
        When the base does not sweep a key that was given without values, or the values are no grid; the rest is told
        when the text is read.
    """
    document = {**_THESIS, "name": "limits"} if base is None else _base_document(base, folder, for_limits=True)
    kept = document.pop("sweep", None) or {}
    asked = _asked_values(over, kept)
    if asked:
        kept = {key: values for key, values in kept.items() if key == "mass_kg"} | asked
    for key in ASIDE:
        document.pop(key, None)
    document["controller"] = {"method": "limit"} | ({} if tolerance is None else {"tolerance": tolerance})
    document["report"] = {"figures": ["limits"]}
    if masses:
        pairs = dict.fromkeys(masses)
        _vary(document, kept, "mass_kg", [list(mass) if isinstance(mass, tuple) else mass for mass in pairs])
    if kept:
        document["sweep"] = kept
    return _HEADER.replace("magbear sweep", "magbear limits") + written(document)


def _asked_values(over: Sequence[str], swept: dict[str, Any]) -> dict[str, list[Any]]:
    """The values of each key of ``--over``."""
    asked: dict[str, list[Any]] = {}
    for text in over:
        key, equals, grid = text.partition("=")
        if key in asked:
            raise InputError(f"--over names {quoted(key)} twice")
        if equals:
            asked[key] = list(parse_grid(grid))
        elif isinstance(swept.get(key), list):
            asked[key] = swept[key]
        else:
            raise InputError(f"--over {key}: the study does not sweep it; write {key}=LOW:HIGH:N or {key}=a,b,c")
    return asked


def _vary(document: dict[str, Any], sweep: dict[str, Any], key: str, values: list[Any]) -> None:
    """Set one value, or sweep several; a sweep of the key or of what lies below it is replaced."""
    for name in [name for name in sweep if name == key or name.startswith(f"{key}.")]:
        del sweep[name]
    document[key] = values[0]
    if len(values) > 1:
        sweep[key] = values


def _options(method: str, document: dict[str, Any], sweep: dict[str, Any]) -> list[dict[str, Any]]:
    """The options that a base gives a method: each swept entry of it, else the base's own, else the defaults."""
    if method not in method_names():
        raise InputError(f"there is no method {quoted(method)}: {did_you_mean(method, method_names())}")
    swept = sweep.get("controller")
    entries = [*(swept if isinstance(swept, list) else []), document.get("controller")]
    found = [entry for entry in entries if isinstance(entry, dict) and entry.get("method") == method]
    distinct: list[dict[str, Any]] = []
    for entry in found if len(found) == 1 else found[: len(entries) - 1]:
        if entry not in distinct:
            distinct.append(entry)
    return distinct or [{"method": method}]


def _base_document(base: str, folder: Path | None, *, for_limits: bool = False) -> dict[str, Any]:
    """A base study as plain data, with what it names by a relative path written out.

    ``for_limits`` puts the sections aside that a limit does not look at.

    Raises
    ------
    StudyError
        When it is not a mapping that can be read.
    """
    faults = Faults()
    root = read_nodes(base, "the base study", faults)
    faults.stop()
    if root is None or not isinstance(root.value, dict):
        raise InputError("the base study is not a mapping of keys: begin it with 'magbear: 1'")
    root = set_aside(root) if for_limits else root
    sweep = child_of(root, "sweep")
    if sweep is not None and not (sweep.value is None or isinstance(sweep.value, dict)):
        faults.add(
            sweep.mark, "E104", "sweep must be a mapping of dotted keys", f"write for example {EXAMPLES['sweep']}"
        )
    shelf = Shelf(folder, faults)
    for pattern, kind in PARTS.items():
        root = rewrite(root, pattern, lambda node, kind=kind: _inlined(shelf, kind, node))  # type: ignore[misc]
    faults.stop()
    document: dict[str, Any] = plain(root)
    if folder is not None:
        _make_absolute(document, folder)
    return document


def _inlined(shelf: Shelf, kind: str, node: Node) -> Node:
    """A part named by a path as its mapping; a part named by its name as it is."""
    is_path = isinstance(node.value, str) and node.value.endswith((".yaml", ".yml"))
    return shelf.opened(kind, node) if is_path else node


def _make_absolute(document: dict[str, Any], folder: Path) -> None:
    """Count the paths of stored controllers from the root of the file system."""
    sweep = document.get("sweep")
    swept = sweep.get("controller") if isinstance(sweep, dict) else None
    for entry in [document.get("controller"), *(swept if isinstance(swept, list) else [])]:
        if isinstance(entry, dict) and isinstance(entry.get("path"), str):
            entry["path"] = str((folder / entry["path"]).absolute())

"""What a validation found, in sentences that name the key, the place and the remedy."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any, Final

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from magbear_cli.spec.grammar import dotted_with_leaf, keys_beside, method_names, methods_with, section_keys
from magbear_cli.spec.nodes import Mark, Node, Path, child_of, descendant, is_refused
from magbear_cli.spec.problems import Faults, did_you_mean, nearest, quoted
from magbear_cli.spec.scalars import number_hint
from magbear_cli.spec.section import FAULT
from magbear_cli.spec.weights import WEIGHT_FORMS

EXAMPLES: Final = {
    "magbear": "magbear: 1",
    "name": "name: my-study",
    "bearing": "bearing: thesis_thrust",
    "mass_kg": "mass_kg: [3.0, 4.5]",
    "performance": "performance: {dc_gain: 10, corner_rad_s: 200}",
    "bandwidth": "bandwidth: {omega_c_rad_s: 20000}",
    "controller": "controller: {method: mu_convex}",
    "simulate": "simulate: [{step_m: 10.0e-6}]",
    "sweep": "sweep: {bandwidth.omega_c_rad_s: [10000, 20000]}",
    "report": "report: {figures: [mu, step]}",
    "run": "run: {timeout_s: 300}",
    "uncertain": "uncertain: {force_constant: [0.8, 1.25]}",
    "operating_point": "operating_point: {position_m: 0.0}",
    "prefilter": "prefilter: {omega_rad_s: 20000, zeta: 1.0}",
    "step_prefilter": "step_prefilter: {omega_rad_s: 20000, zeta: 1.0}",
    "sensor": "sensor: {omega_rad_s: 4000, damping_rad_s: 560}",
    "rotor": "rotor: thesis_flexible_c170",
    "disturbance": "disturbance: {force_n: 50, duration_s: 2.0e-3}",
}
MOST_ERRORS: Final = 200  # of one validation; the rest would not be shown
_UNITS: Final = (
    ("_n_m2_per_a2", "N m²/A²"), ("_n_s_per_m", "N s/m"), ("_n_per_m", "N/m"), ("_m_per_s2", "m/s²"),
    ("_rad_s", "rad/s"), ("_gib", "GiB"), ("_kg", "kg"), ("_m", "m"), ("_a", "A"), ("_n", "N"), ("_s", "s"),
)  # fmt: skip
_YES, _NO = {"yes", "on", "y", "t", "true", "1"}, {"no", "off", "n", "f", "false", "0"}
_WANTED: Final = {
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "int_from_float": "must be a whole number",
    "string_type": "must be text",
    "bool_type": "must be true or false",
    "list_type": "must be a list",
    "tuple_type": "must be a list",
    "finite_number": "must be a finite number",
}
_BOUNDS: Final = {
    "greater_than": ("must be greater than {}", "gt"),
    "greater_than_equal": ("must be at least {}", "ge"),
    "less_than": ("must be less than {}", "lt"),
    "less_than_equal": ("must be at most {}", "le"),
}


def note_errors(error: ValidationError, root: Node, faults: Faults) -> None:
    """Note every error of a validation at the place its value was written."""
    errors = error.errors(include_url=False, include_input=False)[:MOST_ERRORS]
    found = [(_path(details["loc"]), details) for details in errors]
    meant: set[Path] = set()
    for path, details in found:
        if details["type"] == "extra_forbidden":
            meant.add((*path[:-1], _unknown_key(path, root, faults) or ""))
    for path, details in found:
        node = descendant(root, path)
        if details["type"] == "extra_forbidden" or (node is not None and is_refused(node)):
            continue
        if details["type"] == "missing":
            if path not in meant:
                _missing_key(path, root, faults)
        elif details["type"] == FAULT:
            _own(path, details.get("ctx", {}), root, faults)
        else:
            _wrong_value(path, details, root, faults)


def _path(location: Iterable[str | int]) -> Path:
    """The path of a key, without the names of the alternatives that pydantic tried."""
    path = tuple(str(part) for part in location)
    tags: Iterable[str] = method_names() if path[:1] == ("controller",) else WEIGHT_FORMS
    is_tagged = path[:1] in {("controller",), ("performance",)} and len(path) > 1 and path[1] in tags
    return (path[0], *path[2:]) if is_tagged else path


def _unknown_key(path: Path, root: Node, faults: Faults) -> str | None:
    """Note a key that does not belong there, and say which was probably meant."""
    key, parent, node = path[-1], descendant(root, path[:-1]), descendant(root, path)
    if parent is None or node is None:
        return None
    where = f" in '{'.'.join(path[:-1])}'" if len(path) > 1 else ""
    if key in section_keys(path[:-1]):
        _foreign_key(path, parent, node.place, faults)
        return None
    method = child_of(parent, "method")
    legal = keys_beside(
        path[:-1], parent.value if isinstance(parent.value, dict) else (), None if method is None else method.value
    )
    elsewhere = dotted_with_leaf(key)
    absent = [name for name in legal if child_of(parent, name) is None]
    meant = nearest(key, absent) or nearest(key, legal)
    if elsewhere:
        meant, remedy = None, f"did you mean '{elsewhere}'?"
    else:
        remedy = did_you_mean(key, [meant] if meant else legal)
    faults.add(node.place, "E102", f"unknown key {quoted(key)}{where}", remedy)
    return meant


def _foreign_key(path: Path, parent: Node, mark: Mark, faults: Faults) -> None:
    """Note a key that belongs to another method or form."""
    key = path[-1]
    if path[0] == "controller":
        method = child_of(parent, "method")
        name = method.value if method else "this method"
        owners = ", ".join(methods_with(key))
        faults.add(mark, "E102", f"{name} has no option {quoted(key)}", f"it belongs to {owners}")
    else:
        sentence = f"the key {quoted(key)} does not go together with the others of '{'.'.join(path[:-1])}'"
        faults.add(mark, "E102", sentence, "give {dc_gain, corner_rad_s} or {num, den}, not both")


def _missing_key(path: Path, root: Node, faults: Faults) -> None:
    """Note a key that has no default and is not there."""
    parent = descendant(root, path[:-1])
    place = parent.place if parent else root.mark
    where = f" in '{'.'.join(path[:-1])}'" if len(path) > 1 else ""
    example = EXAMPLES.get(path[-1])
    faults.add(place, "E103", f"missing key '{path[-1]}'{where}", f"add for example {example}" if example else "add it")


def _own(path: Path, context: Mapping[str, Any], root: Node, faults: Faults) -> None:
    """Note an error that one of our validators raised."""
    path = (*path, *context["at"])
    node = descendant(root, path) or descendant(root, path[: len(path) - len(context["at"])]) or root
    sentence = context["sentence"]
    if context["code"] in {"E104", "E105", "E112"} and ", not" not in sentence:
        sentence = f"{sentence}{_not(node)}"
    remedy = context["remedy"] or (_unit(path) if context["code"] == "E105" else "")
    mark = node.place if context["code"] == "E103" else node.mark
    faults.add(mark, context["code"], f"{'.'.join(path)} {sentence}", remedy)


def _wrong_value(path: Path, details: ErrorDetails, root: Node, faults: Faults) -> None:
    """Note a value that is of the wrong kind, out of range or not one of the legal names."""
    kind, context = details["type"], details.get("ctx", {})
    node = descendant(root, path) or root
    key, value = ".".join(path) or "the study", node.value
    if kind in _BOUNDS:
        faults.add(node.mark, "E105", f"{key} {_bound(kind, context, value)}{_not(node)}", _unit(path))
    elif kind in {"union_tag_invalid", "union_tag_not_found"}:
        _method(path, node, faults)
    elif kind == "literal_error":
        _choice(path, node, str(context.get("expected", "")), faults)
    elif kind in {"too_short", "too_long"}:
        _length(key, node, context, faults)
    elif kind == "string_too_long":
        faults.add(node.mark, "E105", f"{key} is longer than {context['max_length']} characters", "shorten it")
    elif kind == "string_too_short":
        faults.add(node.mark, "E105", f"{key} must not be empty", "write a text, or leave the key out")
    elif kind == "string_pattern_mismatch":
        remedy = "use letters, digits, '.', '_' and '-', and begin with a letter or digit"
        faults.add(node.mark, "E106", f"{key} cannot be {quoted(str(value))}, for files are named by it", remedy)
    else:
        wanted = _WANTED.get(kind) or f"must be {_mapping_wanted(path)}"
        faults.add(node.mark, "E104", f"{key} {wanted}{_not(node)}", _kind_remedy(kind, path, node))


def _not(node: Node) -> str:
    """What a value is instead."""
    value = node.value
    if value is None:
        return ", but it is empty"
    if isinstance(value, bool):
        return f", not the truth value {'true' if value else 'false'}"
    if isinstance(value, str):
        return f", not the text {quoted(value)}"
    if isinstance(value, dict):
        return ", not a mapping"
    return ", not a list" if isinstance(value, tuple) else f", not {quoted(value)}"


def _bound(kind: str, context: Mapping[str, Any], value: object) -> str:
    """The bound that a number breaks."""
    words, name = _BOUNDS[kind]
    limit = context[name]
    if kind == "greater_than_equal" and limit > 0 and isinstance(value, int | float) and value <= 0:
        return "must be greater than 0"
    return words.format(f"{limit:g}")


def _unit(path: Path) -> str:
    """A reminder of the unit that a key ends in."""
    key = next((name for name in reversed(path) if not name.isdecimal()), "").removesuffix("masses_kg") or "_kg"
    return next((f"the unit is {unit}" for ending, unit in _UNITS if key.endswith(ending)), "")


def _mapping_wanted(path: Path) -> str:
    """What belongs at a place where a section stands."""
    if path == ("performance",):
        return "the name of a weight, {dc_gain, corner_rad_s} or {num, den}"
    if path == ("bearing",) or (path and path[-1] in {"prefilter", "step_prefilter", "sensor", "rotor"}):
        return "the name of a part or a mapping of keys"
    return "a mapping of keys"


def _kind_remedy(kind: str, path: Path, node: Node) -> str:
    """What to write instead of a value of the wrong kind."""
    value = node.value
    if kind in {"float_type", "int_type"} and isinstance(value, str):
        return number_hint(value) or _unit(path)
    if kind in {"float_type", "int_type"}:
        return _unit(path)
    if kind == "string_type" and value is not None and not isinstance(value, dict | tuple):
        return "put it between quotes if it is meant as text"
    if kind == "bool_type":
        word = str(value).casefold()
        return "write true" if word in _YES else "write false" if word in _NO else ""
    if path == ("controller",) and isinstance(value, str):
        name = nearest(value, method_names())
        return f"write {{method: {name or method_names()[0]}}}"
    example = EXAMPLES.get(path[-1]) if path else None
    if path and path[-1].isdecimal():
        example = "- {step_m: 10.0e-6}"
    return f"write for example {example}" if example else ""


def _method(path: Path, node: Node, faults: Faults) -> None:
    """Note a synthesis method that does not exist, or is not named."""
    method = child_of(node, "method")
    if method is None:
        faults.add(node.place, "E103", "missing key 'method' in 'controller'", did_you_mean("", method_names()))
    elif isinstance(method.value, str):
        remedy = did_you_mean(method.value, method_names())
        faults.add(method.mark, "E106", f"there is no method {quoted(method.value)}", remedy)
    else:
        faults.add(
            method.mark, "E104", f"{'.'.join(path)}.method must be text{_not(method)}", did_you_mean("", method_names())
        )


def _choice(path: Path, node: Node, expected: str, faults: Faults) -> None:
    """Note a value that is not one of the few legal ones."""
    legal = re.findall(r"'([^']*)'", expected)
    key = ".".join(path)
    if isinstance(node.value, str):
        remedy = did_you_mean(node.value, legal)
        faults.add(node.mark, "E106", f"{key} must be one of {', '.join(legal)}{_not(node)}", remedy)
    else:
        faults.add(node.mark, "E104", f"{key} must be one of {', '.join(legal)}{_not(node)}")


def _length(key: str, node: Node, context: Mapping[str, Any], faults: Faults) -> None:
    """Note a list of the wrong length."""
    least, most, actual = context.get("min_length"), context.get("max_length"), context.get("actual_length")
    if actual == 0:
        faults.add(node.mark, "E113", f"{key} is an empty list", "give it a value, or leave the key out")
    else:
        bound = f"at least {least}" if least is not None else f"at most {most}"
        faults.add(node.mark, "E104", f"{key} needs {bound} values, not {actual}")

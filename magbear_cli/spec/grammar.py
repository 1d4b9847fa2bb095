"""Which dotted keys exist, and the nearest one to a key that does not."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import get_args

from magbear_cli.spec.methods import METHODS
from magbear_cli.spec.models import CASE_KEYS, LISTS, SECTIONS, Case, pattern_of
from magbear_cli.spec.nodes import Node, Path, child_of
from magbear_cli.spec.problems import nearest
from magbear_cli.spec.section import Section


def section_keys(path: Path) -> list[str]:
    """All legal keys of the section at a path, whichever form it has; empty when there is no section."""
    sections = SECTIONS.get(pattern_of(path), ())
    return list(dict.fromkeys(key for section in sections for key in section.model_fields))


def keys_beside(path: Path, given: Collection[str], method: object = None) -> list[str]:
    """The legal keys of a section of which some are given: those of its method, or of its form, alone.

    Parameters
    ----------
    path : where the section is
    given : its keys as written
    method : the value of its key ``method``; where it names no method the options of all are legal
    """
    if path == ("controller",):
        chosen = method_section(method) if isinstance(method, str) else None
        return section_keys(path) if chosen is None else list(chosen.model_fields)
    if path == ("performance",):
        forms = [form for form in SECTIONS[path] if any(key in form.model_fields for key in given)]
        if len(forms) == 1:
            return list(forms[0].model_fields)
    return section_keys(path)


def _method_name(section: type[Section]) -> str:
    """The name of the method whose options a section holds."""
    return str(get_args(section.model_fields["method"].annotation)[0])


def method_section(name: str) -> type[Section] | None:
    """The options of a method, or None when there is no such method."""
    return next((section for section in METHODS if _method_name(section) == name), None)


def method_names() -> list[str]:
    """The methods, in the order in which they are documented."""
    return [_method_name(section) for section in METHODS]


def methods_with(option: str) -> list[str]:
    """The methods that know an option."""
    return [_method_name(section) for section in METHODS if option in section.model_fields]


def exists(path: Path) -> bool:
    """Whether a dotted key is legal; indices are checked for being numbers only."""
    if not path:
        return False
    if len(path) == 2 and path[0] == "simulate":
        return _is_index(path[1])
    if len(path) > 2 and path[0] == "simulate" and not _is_index(path[1]):
        return False
    parent = path[:-1]
    if pattern_of(parent) in LISTS:
        return exists(parent) and _is_index(path[-1])
    return path[-1] in section_keys(parent)


def _is_index(key: str) -> bool:
    """Whether a part of a dotted key can be an index."""
    return key.isascii() and key.isdecimal() and len(key) < 6


def dotted_keys(*, of_cases_only: bool, methods: Collection[str] = ()) -> list[str]:
    """Every legal dotted key without indices but ``simulate.0``.

    Parameters
    ----------
    of_cases_only : those that can be swept
    methods : of the controller, those that one of these methods knows; of every method where none is named
    """
    options = {option for name in methods for option in keys_beside(("controller",), (), name)}
    found = []
    for pattern in SECTIONS:
        prefix = tuple("0" if key == "*" else key for key in pattern)
        keys = [key for key in section_keys(prefix) if prefix != ("controller",) or not methods or key in options]
        found += [".".join((*prefix, key)) for key in keys]
    if of_cases_only:
        found = [key for key in found if key.split(".", maxsplit=1)[0] in CASE_KEYS]
    return found


def dotted_with_leaf(leaf: str) -> str | None:
    """The only dotted key that ends so, or None."""
    found = [key for key in dotted_keys(of_cases_only=False) if key.rpartition(".")[2] == leaf]
    return found[0] if len(found) == 1 else None


def nearest_dotted(key: str, *, of_cases_only: bool, methods: Collection[str] = ()) -> str | None:
    """The dotted key that was probably meant; of an option of ``controller``, one that these methods know."""
    methods = methods if key.startswith("controller.") else ()
    legal = dotted_keys(of_cases_only=of_cases_only, methods=methods)
    leaf = dotted_with_leaf(key.rpartition(".")[2])
    if leaf in dotted_keys(of_cases_only=of_cases_only):  # only the section is misspelled
        return leaf
    parts = tuple(key.split("."))
    own = ".".join(("simulate", "0", *parts[2:])) if parts[0] == "simulate" and len(parts) > 2 else key
    if parts[0] == "controller" and len(parts) == 2 and methods:
        return _nearest_option(parts[1], legal)
    found = nearest(own, legal)
    if found and own != key and _is_index(parts[1]):
        found = ".".join(("simulate", parts[1], *found.split(".")[2:]))
    return found


def dotted_remedy(key: str, *, of_cases_only: bool, methods: Collection[str] = ()) -> str:
    """What to write instead of a dotted key that does not exist; empty where nothing is near."""
    meant = nearest_dotted(key, of_cases_only=of_cases_only, methods=methods)
    if meant is not None:
        return f"did you mean '{meant}'?"
    if not methods or not key.startswith("controller."):
        return ""
    legal = dotted_keys(of_cases_only=of_cases_only, methods=methods)
    return f"legal are {', '.join(name for name in legal if name.startswith('controller.') and name.count('.') == 1)}"


def _nearest_option(option: str, legal: Iterable[str]) -> str | None:
    """The nearest of the controller's options, as a dotted key."""
    options = [key.partition(".")[2] for key in legal if key.startswith("controller.") and key.count(".") == 1]
    meant = nearest(option, options)
    return None if meant is None else f"controller.{meant}"


def methods_in(study: Node) -> list[str]:
    """The methods that a study names: that of ``controller`` and those of its sweeps."""
    sweep = child_of(study, "sweep")
    controller = child_of(study, "controller")
    named = [] if controller is None else [child_of(controller, "method")]
    for key, axis in sweep.value.items() if sweep is not None and isinstance(sweep.value, dict) else ():
        values = axis.value if isinstance(axis.value, tuple) else ()
        if key == "controller":
            named += [child_of(entry, "method") for entry in values]
        elif key == "controller.method":
            named += values
    return list(dict.fromkeys(node.value for node in named if node is not None and isinstance(node.value, str)))


def required_keys() -> list[str]:
    """The keys of a case that have no default."""
    return [key for key, field in Case.model_fields.items() if field.is_required()]

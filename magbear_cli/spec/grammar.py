"""Which dotted keys exist, and the nearest one to a key that does not."""

from __future__ import annotations

from typing import get_args

from magbear_cli.spec.methods import METHODS
from magbear_cli.spec.models import CASE_KEYS, LISTS, SECTIONS, Case, pattern_of
from magbear_cli.spec.nodes import Path
from magbear_cli.spec.problems import nearest
from magbear_cli.spec.section import Section


def section_keys(path: Path) -> list[str]:
    """All legal keys of the section at a path, whichever form it has; empty when there is no section."""
    sections = SECTIONS.get(pattern_of(path), ())
    return list(dict.fromkeys(key for section in sections for key in section.model_fields))


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


def dotted_keys(*, of_cases_only: bool) -> list[str]:
    """Every legal dotted key without indices but ``simulate.0``; of cases only: those that can be swept."""
    found = []
    for pattern in SECTIONS:
        prefix = tuple("0" if key == "*" else key for key in pattern)
        found += [".".join((*prefix, key)) for key in section_keys(prefix)]
    if of_cases_only:
        found = [key for key in found if key.split(".", maxsplit=1)[0] in CASE_KEYS]
    return found


def dotted_with_leaf(leaf: str) -> str | None:
    """The only dotted key that ends so, or None."""
    found = [key for key in dotted_keys(of_cases_only=False) if key.rpartition(".")[2] == leaf]
    return found[0] if len(found) == 1 else None


def nearest_dotted(key: str, *, of_cases_only: bool) -> str | None:
    """The dotted key that was probably meant."""
    legal = dotted_keys(of_cases_only=of_cases_only)
    leaf = dotted_with_leaf(key.rpartition(".")[2])
    if leaf in legal:
        return leaf
    parts = tuple(key.split("."))
    own = ".".join(("simulate", "0", *parts[2:])) if parts[0] == "simulate" and len(parts) > 2 else key
    found = nearest(own, legal)
    if found and own != key and _is_index(parts[1]):
        found = ".".join(("simulate", parts[1], *found.split(".")[2:]))
    return found


def required_keys() -> list[str]:
    """The keys of a case that have no default."""
    return [key for key, field in Case.model_fields.items() if field.is_required()]

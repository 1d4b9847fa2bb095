"""What the bandwidth limit of a study is sought for: all of it but the sections that a limit does not look at."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from magbear_cli.spec.nodes import Node, child_of

ASIDE: Final = ("controller", "reduction", "bandwidth", "simulate", "report")


def _is_aside(key: str) -> bool:
    """Whether a dotted key lies in a section that a limit does not look at."""
    return key.partition(".")[0] in ASIDE


def set_aside(study: Node) -> Node:
    """The study with the method ``limit`` as its controller, and without the other sections and their sweeps."""
    if not isinstance(study.value, dict):
        return study
    value = {key: child for key, child in study.value.items() if key not in ASIDE}
    sweep = child_of(study, "sweep")
    if sweep is not None and isinstance(sweep.value, dict):
        kept = {key: axis for key, axis in sweep.value.items() if not _is_aside(key)}
        value = {**value, "sweep": replace(sweep, value=kept or None)}
    controller = study.value.get("controller", study)
    method = replace(controller, value="limit")
    return replace(study, value={**value, "controller": replace(controller, value={"method": method})})

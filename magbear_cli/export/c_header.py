"""A sampled controller as C99: one header with double and single precision, and a program that checks it."""

from __future__ import annotations

from importlib import resources

import numpy as np
from jinja2 import Environment, StrictUndefined

from magbear_cli.errors import InputError
from magbear_cli.export.handover import Handover
from magbear_cli.export.mat_file import padded_sections

TOLERANCES = {"double": 1e-12, "float": 1e-4}  # of the largest current: what the test program accepts


def c_files(handover: Handover) -> dict[str, bytes]:
    """The header and the test program.

    Raises
    ------
    InputError
        when the controller is not sampled.
    """
    if handover.sampled is None:
        raise InputError("C code runs at a fixed rate: give --sample-time")
    f, g, h, d = padded_sections(handover)
    chain, sampling = handover.sampled.controller, handover.sampled.sampling
    sections = [
        {"f": f[place].ravel().tolist(), "g": g[place].tolist(), "h": h[place].tolist(), "d": float(d[place])}
        for place in range(d.size)
    ]
    values = {
        "name": handover.name,
        "upper": handover.name.upper(),
        "about": _in_comment(handover.summary),
        "family": [_in_comment(line) for line in handover.family],
        "found": _in_comment(handover.sampled.sentence),
        "sections": sections,
        "sample_time_s": sampling.sample_time_s,
        "delay_s": sampling.delay_s,
        "direct": float(np.prod(d)),
        "conditioned": _is_conditionable(handover),
        "positions": handover.test_positions_m.tolist(),
        "currents": handover.test_currents_a.tolist(),
        "tolerances": TOLERANCES,
        "order": chain.order,
    }
    return {
        f"{handover.name}.h": _rendered("controller.h.j2", values),
        f"{handover.name}_test.c": _rendered("controller_test.c.j2", values),
    }


def _is_conditionable(handover: Handover) -> bool:
    """Whether the controller can be run backwards: a direct gain, and all zeros well inside the circle."""
    if handover.sampled is None:
        return False
    for row in handover.sampled.controller.second_order_sections():
        if row[0] == 0.0 or np.any(np.abs(np.roots(row[:3])) > 1.0 - 1e-9):
            return False
    return True


def _rendered(template: str, values: dict[str, object]) -> bytes:
    # the result is C, in which nothing is to be escaped for HTML
    environment = Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)  # noqa: S701
    environment.filters["c_double"] = _literal
    text = resources.files("magbear_cli.export").joinpath(template).read_text(encoding="utf-8")
    return (environment.from_string(text).render(values) + "\n").encode("ascii")


def _literal(value: float) -> str:
    """The number as C reads it back exactly: never an integer."""
    text = repr(float(value))
    return text if any(mark in text for mark in ".en") else f"{text}.0"


def _in_comment(text: str) -> str:
    """The text in ASCII, unable to end a comment."""
    plain = text.replace("π", "pi").replace("ω", "omega").encode("ascii", "replace").decode("ascii")
    return plain.replace("*/", "* /")

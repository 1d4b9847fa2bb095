"""Studies to spoil, and a way to see what a refusal says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from magbear_cli.spec.problems import Problem, StudyError
from magbear_cli.spec.study import read_study_text

BASE = """\
magbear: 1
name: base
bearing: {air_gap_m: 400.0e-6, force_constant_n_m2_per_a2: 4.0e-6, bias_current_a: 0.5, current_law: full}
operating_point: {position_m: 0.0, current_a: 0.0}
mass_kg: [3.0, 4.5]
performance: {dc_gain: 10, corner_rad_s: 200}
bandwidth: {omega_c_rad_s: 20000}
controller: {method: mu_convex}
simulate:
  - {step_m: 10.0e-6, masses_kg: [3.0, 4.5], prefilter: {omega_rad_s: 20000, zeta: 1.0}}
report: {figures: [mu, step]}
run: {timeout_s: 300, memory_gib: 4}
"""


@pytest.fixture(scope="session")
def base() -> str:
    """A legal study with every section, one key a line."""
    return BASE


@pytest.fixture(scope="session")
def studies() -> Path:
    """The studies that ship with the project."""
    return Path(__file__).resolve().parents[2] / "studies"


@pytest.fixture(scope="session")
def refused() -> Callable[..., tuple[Problem, ...]]:
    """Read a text that must be refused, and give what is wrong with it."""

    def read(text: str, *overrides: str, folder: Path | None = None) -> tuple[Problem, ...]:
        with pytest.raises(StudyError) as caught:
            read_study_text(text, "study.yaml", overrides, folder)
        assert caught.value.problems
        assert str(caught.value)
        return caught.value.problems

    return read


@pytest.fixture(scope="session")
def spoiled() -> Callable[[str, str], str]:
    """The base with the line of a top-level key replaced (for ``simulate`` both lines); empty to leave it out.

    A key that the base has not is added at its end.
    """

    def replace(key: str, line: str) -> str:
        lines = BASE.splitlines()
        start = next((i for i, text in enumerate(lines) if text.startswith(f"{key}:")), len(lines))
        stop = start + 1
        while stop < len(lines) and lines[stop].startswith(" "):
            stop += 1
        return "\n".join([*lines[:start], *([line] if line else []), *lines[stop:], ""])

    return replace

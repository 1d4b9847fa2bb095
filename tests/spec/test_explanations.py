"""Every code is explained, and the examples are what they say."""

from __future__ import annotations

import pytest

from magbear_cli.spec import CODES, StudyError, read_study_text
from magbear_cli.spec.explanations import explain_code

BASE = """\
magbear: 1
name: base
bearing: thesis_thrust
mass_kg: [3.0, 4.5]
performance: {dc_gain: 10, corner_rad_s: 200}
bandwidth: {omega_c_rad_s: 20000}
controller: {method: mu_convex}
"""
EXAMPLES = [code for code in CODES if (found := explain_code(code)) is not None and found.wrong]


def _with(line: str) -> str:
    """The base study with a key's line put in place of its own."""
    meant = line.split(":", maxsplit=1)[0].replace("mas_kg", "mass_kg")
    rest = [own for own in BASE.splitlines() if not own.startswith(f"{meant}:")]
    return "\n".join([*rest, line]) + "\n"


@pytest.mark.parametrize("code", list(CODES))
def test_every_code_has_an_example_or_a_remedy(code: str) -> None:
    """No code is left with its sentence alone."""
    found = explain_code(code)
    assert found is not None
    assert (found.wrong and found.right) or found.remedy
    assert str(found).startswith(f"{code}: {CODES[code]}")


@pytest.mark.parametrize("code", EXAMPLES)
def test_an_example_is_refused_by_its_code_and_its_mending_is_legal(code: str) -> None:
    """The wrong line brings the code about; the right one makes a legal study."""
    found = explain_code(code)
    assert found is not None
    with pytest.raises(StudyError) as refused:
        read_study_text(_with(found.wrong), "study.yaml")
    assert code in {problem.code for problem in refused.value.problems}, str(refused.value)
    assert read_study_text(_with(found.right), "study.yaml").case_count >= 1


def test_what_is_no_code_is_none() -> None:
    """An unknown code has no explanation."""
    assert explain_code("E999") is None

"""Tests of the study that `magbear new` begins with."""

from __future__ import annotations

import pytest

from magbear_cli.errors import InputError
from magbear_cli.spec.grammar import method_names
from magbear_cli.spec.study import read_study_text
from magbear_cli.spec.template import SCHEMA_FILE, template


@pytest.mark.parametrize("name", ["demo", "a", "mass-3.0-4.5", "010", "1e3", "null", "true", "x" * 80])
def test_the_template_is_legal_under_any_name(name: str) -> None:
    """Names that look like numbers or truths are quoted."""
    study = read_study_text(template(name), "template")
    assert study.name == name
    assert study.case_count == 2


def test_the_template_tells_editors_its_schema_and_names_the_methods() -> None:
    """The first line is what YAML editors look for."""
    text = template("demo")
    assert text.splitlines()[0] == f"# yaml-language-server: $schema={SCHEMA_FILE}"
    assert all(name in text for name in method_names())
    assert max(len(line) for line in text.splitlines()) <= 120


@pytest.mark.parametrize("name", ["", "a b", "../up", "-x", "x" * 81, "é", "a\n"])
def test_a_name_that_no_study_can_have_is_refused(name: str) -> None:
    """With a sentence."""
    with pytest.raises(InputError, match="cannot name a study"):
        template(name)

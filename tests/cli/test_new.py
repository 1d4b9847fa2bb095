"""``magbear new`` and ``magbear schema``: a study that runs as it is."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

Command = Callable[..., Any]


def test_a_new_study_is_legal_and_names_its_schema(command: Command, tmp_path: Path) -> None:
    """What ``new`` writes, ``check`` accepts, and editors find the schema beside it."""
    ended = command("new", "spindle")
    assert (ended.code, ended.out) == (0, "spindle.yaml\nmagbear.schema.json\n")
    assert command("check", "spindle.yaml").code == 0
    text = (tmp_path / "spindle.yaml").read_text("utf-8")
    assert text.startswith("# yaml-language-server: $schema=magbear.schema.json\n")
    jsonschema.validate(yaml.safe_load(text), json.loads((tmp_path / "magbear.schema.json").read_text("utf-8")))


def test_an_existing_study_is_not_touched(command: Command, tmp_path: Path) -> None:
    """A second ``new`` of the same name is refused."""
    (tmp_path / "study.yaml").write_text("mine", "utf-8")
    ended = command("new")
    assert ended.code == 2
    assert "study.yaml exists and is not overwritten" in ended.err
    assert (tmp_path / "study.yaml").read_text("utf-8") == "mine"


@pytest.mark.parametrize("name", ["nowhere/study", "a b", "é", "", "."])
def test_a_name_that_cannot_be_is_refused(command: Command, name: str) -> None:
    """A folder that is not there and a name that no study may have are told."""
    ended = command("new", name)
    assert ended.code == 2
    assert "Traceback" not in ended.err


def test_the_schema_is_one_document(command: Command) -> None:
    """``schema`` prints a JSON Schema that is one itself."""
    ended = command("schema")
    assert (ended.code, ended.err) == (0, "")
    jsonschema.Draft202012Validator.check_schema(json.loads(ended.out))

"""Tests of the JSON Schema: it takes what the reader takes, and refuses the plain mistakes."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from magbear_cli.spec.grammar import dotted_keys
from magbear_cli.spec.schema import json_schema
from magbear_cli.spec.template import template


@pytest.fixture(scope="module")
def validator() -> Any:  # noqa: ANN401 - jsonschema is untyped
    """A validator of the schema, the schema itself being checked first."""
    schema = json.loads(json.dumps(json_schema()))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def errors(validator: Any, text: str) -> list[Any]:  # noqa: ANN401 - jsonschema is untyped
    """What the schema has against a study."""
    return list(validator.iter_errors(yaml.safe_load(text)))


def test_the_studies_and_the_template_are_valid(validator: Any, studies: Path, base: str) -> None:  # noqa: ANN401
    """What ships, what `magbear new` writes and what the tests use are legal to an editor."""
    for text in (base, template("mine"), *(path.read_text(encoding="utf-8") for path in studies.glob("*.yaml"))):
        assert errors(validator, text) == []


@pytest.mark.parametrize(
    "line",
    [
        "mass_kg: [3]",
        "mass_kg: -1",
        "magbear: 2",
        "name: a b",
        "bearing: 3",
        "bearing: no_such_part",
        "bearing: {air_gap_m: 1e-4}",
        "performance: {dc_gain: 10}",
        "performance: {num: [1]}",
        "bandwidth: {omega_c_rad_s: 0}",
        "controller: {method: mu_convx}",
        "controller: {method: mu_convex, order: 1}",
        "controller: {method: fixed_order, order: 9}",
        "simulate: []",
        "report: {figures: [stp]}",
        "run: {memory_gib: 0}",
        "",
    ],
)
def test_plain_mistakes_are_marked_in_the_editor(
    line: str,
    validator: Any,  # noqa: ANN401 - jsonschema is untyped
    spoiled: Callable[[str, str], str],
) -> None:
    """Kinds, names, bounds and missing keys."""
    assert errors(validator, spoiled(line.partition(":")[0] or "controller", line.replace("1e-4", "1.0e-4")))


@pytest.mark.parametrize(
    ("sweep", "legal"),
    [
        ("{mass_kg: [1.0, 2.0]}", True),
        ("{mass_kg.1: [4, 5]}", True),
        ("{simulate.12.step_m: [1.0e-6]}", True),
        ("{simulate.0: [{step_m: 1.0e-6}]}", True),
        ("{controller.order: [1, 2]}", True),
        ("null", True),
        ("{mas_kg: [1]}", False),
        ("{run.timeout_s: [1]}", False),
        ("{mass_kg: []}", False),
        ("{mass_kg: [1, 1]}", False),
        ("{mass_kg: 3}", False),
    ],
)
def test_swept_keys_are_known_to_the_editor(sweep: str, legal: bool, validator: Any, base: str) -> None:  # noqa: ANN401, FBT001
    """Any dotted key of a case, with a list of distinct values."""
    assert (not errors(validator, f"{base}sweep: {sweep}\n")) is legal


def test_a_swept_key_may_be_left_out(validator: Any, spoiled: Callable[[str, str], str]) -> None:  # noqa: ANN401
    """As the reader allows it, so does the schema."""
    text = spoiled("controller", "")
    assert errors(validator, text)
    assert not errors(validator, f"{text}sweep: {{controller: [{{method: lqg}}]}}\n")


def properties(schema: Any, path: str = "") -> Iterator[tuple[str, Any]]:  # noqa: ANN401 - JSON
    """Every property of a schema, wherever it stands."""
    if isinstance(schema, dict):
        for key, value in schema.get("properties", {}).items():
            yield f"{path}.{key}", value
        for key, value in schema.items():
            if key != "allOf":
                yield from properties(value, f"{path}/{key}")
    elif isinstance(schema, list):
        for index, value in enumerate(schema):
            yield from properties(value, f"{path}/{index}")


def test_every_key_has_a_description() -> None:
    """What an editor shows beside a key; only the name of a method speaks for itself."""
    without = [path for path, value in properties(json_schema()) if "description" not in value]
    assert all(path.endswith(".method") for path in without)


def test_every_dotted_key_ends_in_a_known_name() -> None:
    """The grammar lists the keys of all sections, the deepest too."""
    keys = dotted_keys(of_cases_only=True)
    assert {"mass_kg", "bearing.air_gap_m", "controller.order", "simulate.0.prefilter.zeta"} <= set(keys)
    assert not {"name", "run.timeout_s", "report.figures", "sweep"} & set(keys)

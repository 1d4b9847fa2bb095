"""The JSON Schema of a study file, for editors and for other programs that write studies."""

from __future__ import annotations

import re
from typing import Any

from magbear_cli.spec.grammar import dotted_keys, required_keys
from magbear_cli.spec.models import LISTS, StudyFile


def json_schema() -> dict[str, Any]:
    """The JSON Schema (2020-12) of a study file, made from the types that validate it."""
    schema = StudyFile.model_json_schema()
    # A key of the case may be left out when it is swept.
    needed = required_keys()
    schema["required"] = [key for key in schema["required"] if key not in needed]
    schema["allOf"] = [{"anyOf": [{"required": [key]}, _swept(key)]} for key in needed]
    schema["properties"]["sweep"] = {
        "description": StudyFile.model_fields["sweep"].description,
        "anyOf": [
            {
                "type": "object",
                "propertyNames": {"pattern": sweepable_pattern()},
                "additionalProperties": {"type": "array", "minItems": 1, "uniqueItems": True},
            },
            {"type": "null"},
        ],
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "magbear study",
        **{key: value for key, value in schema.items() if key != "title"},
    }


def _swept(key: str) -> dict[str, Any]:
    """Asks for a sweep of the key."""
    return {"required": ["sweep"], "properties": {"sweep": {"type": "object", "required": [key]}}}


def sweepable_pattern() -> str:
    """A regular expression of the dotted keys that may be swept."""
    indexed = {".".join(pattern) for pattern in LISTS}
    words = []
    for key in dotted_keys(of_cases_only=True):
        word = re.escape(key).replace(r"simulate\.0\.", r"simulate\.[0-9]+\.")
        general = key.replace("simulate.0.", "simulate.*.")
        words.append(word + (r"(\.[0-9]+)?" if general in indexed else ""))
    words.append(r"simulate\.[0-9]+")
    return f"^({'|'.join(words)})$"

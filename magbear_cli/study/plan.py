"""The cases of a study: each resolved input with the digest that identifies it for good."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from magbear_cli.errors import InputError

KERNEL_VERSION = 2  # raised when a change of the methods changes their answers
SCHEMA_VERSION = 1  # raised when the canonical inputs change their meaning
ID_DIGITS = 16


@dataclass(frozen=True)
class Case:
    """One case to compute: its identity, its place in the study (from 0) and its resolved, canonical inputs."""

    id: str
    index: int
    inputs: Mapping[str, Any]


def canonical_json(value: object) -> str:
    """The one JSON text of plain values: sorted keys, shortest exact floats, ASCII, no blanks.

    Raises
    ------
    InputError
        when a number is not finite or a value is not plain JSON; such inputs have no identity.
    """
    try:
        return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InputError(f"the inputs of a case are not plain, finite values: {error}") from error


def case_id(inputs: Mapping[str, Any]) -> str:
    """The identity of a case: 16 hex digits of the SHA-256 of its canonical inputs and of what they mean."""
    text = f"{canonical_json(inputs)}\nkernel {KERNEL_VERSION}\nschema {SCHEMA_VERSION}\n"
    return hashlib.sha256(text.encode("ascii")).hexdigest()[:ID_DIGITS]


def plan_cases(resolved: Iterable[Mapping[str, Any]]) -> tuple[Case, ...]:
    """The cases of these resolved inputs, in the order given; equal inputs have equal identities."""
    return tuple(Case(case_id(inputs), index, inputs) for index, inputs in enumerate(resolved))

"""The layout covers what the study room knows, field by field, and trees lose nothing."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.store.forms import PARTS, case_index, case_name, grow_case, harvest_case
from magbear_cli.store.layout import (
    CASE_FIELDS,
    COUNTED_AXES,
    ORIGIN,
    STATISTIC,
    STEP,
    STUDY_FIELDS,
    SUMMARY,
    TABLE_FIELDS,
    Group,
)
from magbear_cli.store.packing import pack_tree, unpack_attributes, unpack_tree
from magbear_cli.store.tree import Branch
from magbear_cli.study.outcome import CaseOutcome


@pytest.mark.parametrize("group", [SUMMARY, STEP, *PARTS], ids=lambda group: group.name)
def test_every_attribute_has_its_dataset(group: Group) -> None:
    """The fields of a group are the attributes of the class it holds, none forgotten, none invented."""
    stored = [entry.name for entry in group.fields]
    assert sorted(stored) == sorted(field.name for field in dataclasses.fields(group.holds))
    assert not group.signal or group.signal in stored


def test_every_part_of_an_outcome_is_stored() -> None:
    """Only the place in the study is not part of a stored case."""
    parts = {group.name for group in PARTS} | {entry.name for entry in CASE_FIELDS}
    known = {field.name for field in dataclasses.fields(CaseOutcome)}
    assert known - parts == {"index", "summary", "steps", "statistics", "tables"}


def test_names_and_axes_are_fit_for_every_reader() -> None:
    """Names begin with a letter and hold letters, digits and underscores; each axis has a coordinate; text is ASCII."""
    groups = [SUMMARY.fields, STEP.fields, *(group.fields for group in PARTS)]
    for fields in [*groups, CASE_FIELDS, TABLE_FIELDS, STUDY_FIELDS, STATISTIC, ORIGIN]:
        names = {entry.name for entry in fields}
        for entry in fields:
            assert re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", entry.name)
            assert entry.long_name.isascii()
            assert entry.unit.isascii()
            assert set(entry.axes) <= names | set(COUNTED_AXES)


@settings(deadline=None, max_examples=40)
@given(data=st.data())
def test_a_case_survives_its_image(
    data: st.DataObject, any_case: st.SearchStrategy[CaseOutcome], are_same: Callable[[object, object], bool]
) -> None:
    """An outcome read back from a shard's bytes is the same to the last bit."""
    outcome = data.draw(any_case)
    image = pack_tree(grow_case(outcome))
    assert are_same(harvest_case(unpack_tree(image), outcome.index), outcome)
    assert unpack_attributes(image) == grow_case(outcome).attributes
    assert image == pack_tree(grow_case(outcome))


@pytest.mark.parametrize("image", [b"", b"magbear\n", b"\x89HDF\r\n\x1a\n" + bytes(64), pack_tree(Branch({}))[:20]])
def test_bytes_that_hold_no_tree_are_refused(image: bytes) -> None:
    """Too short, of another format, cut off: an error that readers of shards expect."""
    with pytest.raises((ValueError, KeyError, TypeError)):
        unpack_tree(image)


@given(st.integers(0, 10**6))
def test_names_of_cases_count_from_one(index: int) -> None:
    """The name of a case's group gives its place back."""
    assert case_index(case_name(index)) == index

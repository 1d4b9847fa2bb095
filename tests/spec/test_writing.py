"""Tests of writing: what is written is read back as the same data."""

from __future__ import annotations

from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.spec.nodes import plain
from magbear_cli.spec.problems import Faults
from magbear_cli.spec.reading import read_nodes
from magbear_cli.spec.writing import written

TEXT = st.text(st.characters(exclude_categories=["Cs", "Cc", "Cn"], exclude_characters="\ufeff"), max_size=12)
SCALAR = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(10**15), 10**15),
    st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=False),
    TEXT,
    st.sampled_from(
        ["on", "010", "1e3", "null", "~", "", "1.5 kg", "1,5", "- a", "a: b", "#", "<<", "é", "a\nb", "a\tb"]
    ),
)
VALUE = st.recursive(
    SCALAR,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3), st.dictionaries(TEXT.filter(lambda key: key != "<<"), inner, max_size=3)
    ),
    max_leaves=12,
)
KEYS = st.sampled_from(["simulate", "sweep", "name", "mass_kg", "x", "a b", "on", "5"])


@settings(deadline=None, max_examples=300)
@given(st.dictionaries(KEYS, VALUE, min_size=1, max_size=4))
def test_what_is_written_is_read_back(document: dict[str, Any]) -> None:
    """Text stays text, numbers keep their value and their kind."""
    faults = Faults()
    node = read_nodes(written(document), "text", faults)
    faults.stop()
    assert node is not None
    assert plain(node) == document

"""The identity of a case depends on its resolved inputs and on nothing else."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.errors import InputError
from magbear_cli.study.plan import canonical_json, case_id, plan_cases

plain = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**53), 2**53)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)
inputs = st.dictionaries(st.text(), plain, max_size=4)


@settings(deadline=None, max_examples=50)
@given(inputs)
def test_identity_survives_json_and_the_order_of_keys(resolved: dict[str, Any]) -> None:
    """Inputs that went through a file, or were written in another order, are the same case."""
    turned = dict(reversed(json.loads(json.dumps(resolved)).items()))
    assert case_id(turned) == case_id(resolved)
    assert json.loads(canonical_json(resolved)) == resolved


@settings(deadline=None, max_examples=50)
@given(st.floats(allow_nan=False, allow_infinity=False), st.floats(allow_nan=False, allow_infinity=False))
def test_any_other_number_is_another_case(first: float, second: float) -> None:
    """Two cases share an identity only when their numbers have the same shortest exact form."""
    same = repr(first) == repr(second)
    assert (case_id({"mass_kg": first}) == case_id({"mass_kg": second})) is same


def test_cases_keep_the_order_of_the_study_and_equal_ones_their_identity() -> None:
    """Indexes count from 0 in the order given; twins differ only by their index."""
    cases = plan_cases([{"a": 1.0}, {"a": 2.0}, {"a": 1.0}])
    assert [case.index for case in cases] == [0, 1, 2]
    assert cases[0].id == cases[2].id != cases[1].id
    assert all(len(case.id) == 16 and int(case.id, 16) >= 0 for case in cases)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), {1, 2}, object()])
def test_values_without_an_identity_are_refused(value: object) -> None:
    """NaN, infinity and what JSON does not know are an input error, not a case."""
    with pytest.raises(InputError):
        plan_cases([{"mass_kg": value}])


def test_planning_and_supervising_load_no_numpy() -> None:
    """The parent plans and supervises without the numerical libraries."""
    script = (
        "import sys, magbear_cli.study.plan, magbear_cli.study.runner, magbear_cli.study.interruption;"
        "sys.exit('numpy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0

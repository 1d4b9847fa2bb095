"""Orthogonal functions over given poles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.synthesis.all_pass_sections import Sections

SPEEDS = st.floats(0.1, 100.0)
CHAINS = st.builds(
    lambda pairs, lag: Sections(np.array([[2.0 * zeta * w, w**2] for w, zeta in pairs]), lag),
    st.lists(st.tuples(SPEEDS, st.floats(0.05, 3.0)), min_size=1, max_size=4),
    st.one_of(st.none(), SPEEDS),
)
OMEGA = np.concatenate([[0.0], np.geomspace(1e-2, 1e3, 40), [np.inf]])


@settings(deadline=None, max_examples=60)
@given(sections=CHAINS)
def test_the_chain_has_a_unit_gramian(sections: Sections) -> None:
    """A + Aᵀ = −B Bᵀ: the states are orthogonal and of size one, whatever the poles."""
    a, enter, _ = sections.chain()
    assert a + a.T == pytest.approx(-np.outer(enter, enter), abs=1e-12 * np.abs(a).max())


@settings(deadline=None, max_examples=60)
@given(sections=CHAINS)
def test_functions_are_those_of_the_chain(sections: Sections) -> None:
    """Each function is a state of the chain times its size; at ∞ only the constant is left."""
    a, enter, size = sections.chain()
    found = sections.functions(OMEGA)
    for w, row in zip(OMEGA[:-1], found[:-1], strict=True):
        states = np.linalg.solve(1j * w * np.eye(sections.order) - a, enter)
        assert row == pytest.approx(np.append(1.0, size * states), rel=1e-8, abs=1e-8)
    assert found[-1] == pytest.approx(np.eye(sections.order + 1)[0], abs=0.0)


@settings(deadline=None, max_examples=60)
@given(sections=CHAINS)
def test_logarithms_are_all_there_is_to_know(sections: Sections) -> None:
    """A chain rebuilt from its logarithms has the same poles, within the least damping."""
    again = sections.with_logarithms(sections.logarithms)
    assert again.logarithms == pytest.approx(sections.logarithms)
    assert again.order == sections.order


def test_poles_go_in_and_come_out() -> None:
    """The chain of some poles, real, double and complex, has just these."""
    poles = np.array([-3.0 + 4.0j, -3.0 - 4.0j, -1.0, -1.0, -20.0], dtype=complex)
    sections = Sections.of_poles(poles)
    assert sections.order == 5
    found = np.linalg.eigvals(sections.chain()[0])
    assert np.poly(found) == pytest.approx(np.poly(poles).real, rel=1e-9)


def test_a_pole_cannot_leave_the_left_half_plane() -> None:
    """However little damping is asked for, some is left."""
    sections = Sections(np.array([[1.0, 100.0]]))
    moved = sections.with_logarithms(np.array([-50.0, np.log(100.0)]))
    assert moved.quadratics[0, 0] == pytest.approx(0.02 * 10.0)

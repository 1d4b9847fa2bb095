"""The search for the least H-infinity norm: a published figure, and norms that the loops really have."""

from __future__ import annotations

import numpy as np
import pytest

from magbear_cli.errors import NumericsError
from magbear_cli.lti.connection import lower_lft
from magbear_cli.lti.norm import hinf_norm
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.synthesis.gamma_search import Ports, search_gamma, with_unit_penalty

SCHERER = StateSpace.of(
    [[0, 10, 2], [-1, 1, 0], [0, 2, -5]],
    [[1, 0], [0, 1], [1, 0]],
    [[1, 0, 0], [0, 0, 0], [0, 1, 0]],
    [[0, 0], [0, 1], [2, 0]],
)


def test_the_seventh_example_of_scherer_gahinet_and_chilali() -> None:
    """Least H-infinity norm 9.508 (IEEE T. Automatic Control 42, 1997, example 7), reached and not undercut."""
    search = search_gamma(SCHERER, 1e-5)
    assert search.best is not None
    assert search.best.norm == pytest.approx(9.508, abs=5e-4)
    assert search.failed_gamma == pytest.approx(search.best.norm, rel=1e-4)
    loop = lower_lft(SCHERER, search.best.controller)
    assert loop.poles().real.max() < 0
    assert hinf_norm(loop)[0] == pytest.approx(search.best.norm, rel=1e-6)


def test_two_loops_side_by_side_have_the_norm_of_the_worse() -> None:
    """With two measurements and two controls the least norm of two separate plants is the larger of theirs."""
    doubled = StateSpace.of(*(np.kron(np.eye(2), matrix) for matrix in (SCHERER.a, SCHERER.b, SCHERER.c, SCHERER.d)))
    inputs, outputs = [0, 2, 1, 3], [0, 1, 3, 4, 2, 5]  # controls and measurements last
    plant = StateSpace(doubled.a, doubled.b[:, inputs], doubled.c[outputs], doubled.d[np.ix_(outputs, inputs)])
    search = search_gamma(plant, 1e-4, ports=Ports(2, 2))
    assert search.best is not None
    assert (search.best.controller.inputs, search.best.controller.outputs) == (2, 2)
    assert search.best.norm == pytest.approx(9.508, rel=1e-3)


def test_every_control_gets_a_unit_of_its_own() -> None:
    """After the change of units every column of D12 is one long, and a control that costs nothing keeps its unit."""
    d = np.array([[0.0, 3.0, 0.0], [0.0, 4.0, 0.0], [1.0, 0.0, 0.0]])
    plant = StateSpace(np.eye(1), np.ones((1, 3)), np.ones((3, 1)), d)
    scaled, units = with_unit_penalty(plant, Ports(1, 2))
    assert units == pytest.approx([0.2, 1.0])
    assert np.linalg.norm(scaled.d[:2, 1]) == pytest.approx(1.0)
    assert scaled.b[0] == pytest.approx([1.0, 0.2, 1.0])


def test_a_plant_outside_the_method_is_refused() -> None:
    """A control without a price ends in a sentence before SLICOT is called."""
    free = StateSpace(SCHERER.a, SCHERER.b, SCHERER.c, np.zeros((3, 2)))
    with pytest.raises(NumericsError, match="penalty"):
        search_gamma(free, 1e-3)

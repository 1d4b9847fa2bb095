"""Descent by steps that are believed only when recomputed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.synthesis.descent import Descent, Grids

Floats = NDArray[np.float64]
GRIDS = Grids(np.array([0.0, 1.0, np.inf]), np.array([0.0, 0.5, 1.0, 2.0, np.inf]))


@dataclass(frozen=True)
class Height:
    """A stand-in for a controller: its level at each frequency is its height."""

    height: float
    hidden: float = 0.0  # extra level at ω = 0.5, which the first coarse grid does not see

    def response(self, omega_rad_s: Floats) -> NDArray[np.complex128]:
        """Its height everywhere."""
        return np.full(omega_rad_s.shape, self.height, dtype=complex)

    def controller(self) -> StateSpace:
        """A static gain."""
        return StateSpace.gain([[self.height]])


def _measure(form: Height, omega: Floats) -> Floats:
    return np.where(omega == 0.5, form.height + form.hidden, form.height)


def test_it_stops_at_the_lowest_level_that_is_proposed() -> None:
    """With proposals down to 2 the descent ends within its precision of 2."""

    def propose(_: Height, __: Floats, target: float) -> tuple[Height, float]:
        return Height(target), target - 2.0

    end = Descent(_measure, propose, lambda _: True).run(Height(10.0), GRIDS)
    assert 2.0 <= end.level <= 2.0 * (1 + 2e-3)


def test_a_liar_gains_nothing() -> None:
    """A proposal whose recomputed level is not lower is never taken, whatever margin it claims."""

    def propose(_: Height, __: Floats, target: float) -> tuple[Height, float]:
        return Height(target, hidden=100.0), 1.0

    end = Descent(_measure, propose, lambda _: True).run(Height(10.0), GRIDS)
    assert (end.controller, end.level) == (Height(10.0), 10.0)


def test_a_hidden_peak_joins_the_constraints() -> None:
    """A frequency where the level turns out higher is constrained in the next step."""
    seen: list[int] = []

    def propose(_: Height, omega: Floats, target: float) -> tuple[Height, float]:
        seen.append(omega.size)
        return Height(target, hidden=0.0 if 0.5 in omega else 50.0), target - 2.0

    end = Descent(_measure, propose, lambda _: True).run(Height(10.0), GRIDS)
    assert end.level < 2.01
    assert max(seen) == 4


@pytest.mark.parametrize("reason", ["unstable", "no answer"])
def test_candidates_that_do_not_hold_are_left(reason: str) -> None:
    """A candidate that does not stabilise, and a step without an answer, leave the present controller."""

    def propose(_: Height, __: Floats, target: float) -> tuple[Height, float]:
        if reason == "no answer":
            raise NumericsError("nothing")
        return Height(target), 1.0

    end = Descent(_measure, propose, lambda _: False).run(Height(10.0), GRIDS)
    assert end.level == 10.0

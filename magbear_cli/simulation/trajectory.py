"""The course of a run between its samples: piecewise polynomials through the points of every step."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from magbear_cli.simulation.collocation import knots
from magbear_cli.simulation.loop import COMMAND, DEMAND, SENSOR, Loop

Floats = NDArray[np.float64]


class End(StrEnum):
    """How a run ended."""

    FINISHED = "finished"
    TOUCHED_DOWN = "touched_down"
    NOT_FINITE = "not_finite"
    DIVERGED = "diverged"


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The deviation of the sensor's position (m), the control current (A) and the filtered command (m) over time (s).

    ``state`` is the loop's at the last step; ``steps`` counts the steps taken, ``rejected`` those taken back.
    """

    position_m: PPoly
    current_a: PPoly
    command_m: PPoly
    end_s: float
    end: End
    sentence: str
    state: Floats
    steps: int
    rejected: int


@dataclass(frozen=True, eq=False)
class Pieces:
    """The steps of a run: their begin and width (pieces,), and the outputs at the knots (pieces, s + 1, 4)."""

    start_s: Floats
    width_s: Floats
    outputs: Floats

    def curves(self, loop: Loop) -> tuple[PPoly, PPoly, PPoly]:
        """Position at the sensor (deviation), control current and filtered command."""
        return (
            self.polynomials(self.outputs[:, :, SENSOR]),
            self.polynomials(loop.magnets.current(self.outputs[:, :, DEMAND])),
            self.polynomials(self.outputs[:, :, COMMAND]),
        )

    def polynomials(self, values: Floats) -> PPoly:
        """The polynomials through values at the knots of each piece, (pieces, s + 1)."""
        return piecewise(self.start_s, self.width_s, values)


def piecewise(start_s: Floats, width_s: Floats, values: Floats, end_s: float | None = None) -> PPoly:
    """The polynomials through the values at the knots of pieces that follow each other.

    Parameters
    ----------
    start_s, width_s : (pieces,) arrays; a piece may be followed before its width is over
    values : (pieces, knots) array
    end_s : the end of the last piece, where that is not the end of its width
    """
    degree = values.shape[1] - 1
    powers = np.arange(degree, -1, -1)
    by_fraction = np.linalg.solve(
        knots(degree)[:, None] ** powers, values.T
    )  # coefficients in the fraction of the width
    end = start_s[-1] + width_s[-1] if end_s is None else end_s
    return PPoly(by_fraction / width_s ** powers[:, None], np.append(start_s, end))

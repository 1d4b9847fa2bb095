"""The course of a run between its samples: piecewise polynomials through the points of every step."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from magbear_cli.simulation.collocation import STAGES, Step, knots
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


@dataclass(frozen=True)
class Piece:
    """A step with the time of its beginning and its width."""

    start_s: float
    width_s: float
    step: Step


def piecewise(pieces: list[Piece], values: Floats) -> PPoly:
    """The polynomials through the values at the knots of each piece.

    Parameters
    ----------
    values : (pieces, knots) array
    """
    widths = np.array([piece.width_s for piece in pieces])
    powers = np.arange(STAGES, -1, -1)
    by_fraction = np.linalg.solve(knots()[:, None] ** powers, values.T)  # coefficients in the fraction of the width
    breaks = np.array([piece.start_s for piece in pieces] + [pieces[-1].start_s + pieces[-1].width_s])
    return PPoly(by_fraction / widths ** powers[:, None], breaks)


def curves(loop: Loop, pieces: list[Piece]) -> tuple[PPoly, PPoly, PPoly]:
    """Position at the sensor (deviation), control current and filtered command of the pieces."""
    outputs = np.stack([piece.step.outputs for piece in pieces])
    return (
        piecewise(pieces, outputs[:, :, SENSOR]),
        piecewise(pieces, loop.magnets.current(outputs[:, :, DEMAND])),
        piecewise(pieces, outputs[:, :, COMMAND]),
    )

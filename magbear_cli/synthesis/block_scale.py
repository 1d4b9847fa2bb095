"""The rational D-scale of one block: a number on all of its channels, or a matrix where the block is repeated."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from magbear_cli.lti.balancing import with_balanced_states
from magbear_cli.lti.connection import append, inverse
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.synthesis.scale_fit import ScaleFit

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

UNIT = ScaleFit(0.0, np.empty(0), np.empty(0))


@dataclass(frozen=True, eq=False)
class NumberScale:
    """d(s)·I on the outputs and the inputs of a block."""

    fit: ScaleFit
    outputs: int
    inputs: int

    def left(self) -> StateSpace:
        """D on the outputs."""
        return reduce(append, [self.fit.system()] * self.outputs)

    def right_inverse(self) -> StateSpace:
        """D⁻¹ on the inputs."""
        return reduce(append, [inverse(self.fit.system())] * self.inputs)

    def response(self, omega_rad_s: Floats) -> tuple[Complexes, Complexes]:
        """D on the outputs (w, p, p) and D⁻¹ on the inputs (w, m, m), with the phase of d left out: σ is without it."""
        d = np.exp(self.fit.log_magnitude(omega_rad_s))[:, None, None]
        return np.asarray(d * np.eye(self.outputs), complex), np.asarray(np.eye(self.inputs) / d, complex)


@dataclass(frozen=True, eq=False)
class MatrixScale:
    """D(s) of a repeated block: square, stable, of minimum phase, with an invertible direct gain."""

    system: StateSpace

    def left(self) -> StateSpace:
        """D on the outputs."""
        return self.system

    def right_inverse(self) -> StateSpace:
        """D⁻¹ on the inputs."""
        return with_balanced_states(inverse(self.system))

    def response(self, omega_rad_s: Floats) -> tuple[Complexes, Complexes]:
        """D and D⁻¹ at finite frequencies, (w, r, r)."""
        d = frequency_response(self.system, omega_rad_s)
        return d, np.asarray(np.linalg.inv(d))


BlockScale = NumberScale | MatrixScale

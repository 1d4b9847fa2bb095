"""Systems as objects of python-control, for those who go on with it."""

from __future__ import annotations

import control
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def control_system(matrices: tuple[Floats, Floats, Floats, Floats], sample_time_s: float = 0.0) -> control.StateSpace:
    """The controller (A, B, C, D) as ``control.StateSpace``: of continuous time, or in z with a sample time."""
    return control.ss(*matrices, sample_time_s, inputs="position_m", outputs="current_a")

"""A step's figure speaks of a linear model only where one was computed."""

from __future__ import annotations

import numpy as np
import pytest

from magbear_cli.report.step_figure import _caption, _has_linear_beside
from magbear_cli.study.outcome import StepOutcome


def step(model: str, linear: float) -> StepOutcome:
    """A response of three samples, with a constant linear model beside it."""
    time = np.array([0.0, 1e-3, 2e-3])
    return StepOutcome(
        mass_kg=3.0,
        step_m=1e-5,
        model=model,
        controller="adaptive_lfe",
        scenario={},
        end="finished",
        sentence="",
        settling_time_s=1e-3,
        overshoot=0.0,
        rise_time_s=1e-3,
        peak_current_a=1.0,
        final_error_m=0.0,
        time_s=time,
        position_m=1e-2 * time,
        current_a=1e3 * time,
        reference_m=1e-2 * time,
        linear_position_m=np.full(3, linear),
        linear_current_a=np.full(3, linear),
    )


@pytest.mark.parametrize(
    ("model", "linear", "beside", "words"),
    [
        ("nonlinear", 1e-5, True, "thin: the linear model"),
        ("nonlinear", np.nan, False, "The response as simulated"),
        ("linear", 1e-5, False, "The response of the linear model"),
    ],
)
def test_the_linear_model_is_named_where_it_is(model: str, linear: float, *, beside: bool, words: str) -> None:
    """The caption tells which curves there are; an adaptive loop has no linear model."""
    steps = [step(model, linear)]
    assert _has_linear_beside(steps) is beside
    assert words in _caption(steps, (2e-3, 2e-3), cut=False)

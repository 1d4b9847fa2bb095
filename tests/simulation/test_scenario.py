"""A scenario describes one run, and cuts it where its force jumps."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from magbear_cli.errors import NumericsError
from magbear_cli.simulation.scenario import Disturbance, StepScenario

STEP = StepScenario(10e-6, 3.6)


def test_segments() -> None:
    """The spans meet, cover the run, and carry the pulse where it is."""
    scenario = replace(STEP, disturbance=Disturbance(50.0, 1e-3, 2e-3))
    assert scenario.segments(10e-3) == [(0.0, 1e-3, 0.0), (1e-3, 3e-3, 50.0), (3e-3, 10e-3, 0.0)]
    assert scenario.segments(2e-3) == [(0.0, 1e-3, 0.0), (1e-3, 2e-3, 50.0)]
    assert scenario.segments(1e-3) == [(0.0, 1e-3, 0.0)]
    assert STEP.segments(1e-3) == [(0.0, 1e-3, 0.0)]


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("step_m", float("nan")),
        ("mass_kg", 0.0),
        ("mass_kg", float("inf")),
        ("model", "quadratic"),
        ("samples", 1),
        ("duration_s", -1.0),
        ("current_limit_a", 0.0),
        ("gravity_m_per_s2", float("inf")),
    ],
)
def test_what_makes_no_sense_is_refused(field: str, value: Any) -> None:  # noqa: ANN401 - the point is a wrong value
    """A number that describes no run ends in a sentence with the field's name."""
    name = "samples" if field == "samples" else field
    with pytest.raises(NumericsError, match=name):
        replace(STEP, **{field: value})


def test_an_operating_current_beyond_the_limit_is_refused() -> None:
    """A rotor cannot rest at a current that the amplifier does not give."""
    with pytest.raises(NumericsError, match="beyond the limit"):
        replace(STEP, current_a=2.0, current_limit_a=1.0)


def test_a_pulse_without_extent_is_refused() -> None:
    """A pulse needs a duration and a beginning that is not in the past."""
    with pytest.raises(NumericsError, match="a pulse needs"):
        Disturbance(1.0, 0.0, 0.0)
    with pytest.raises(NumericsError, match="a pulse needs"):
        Disturbance(1.0, -1.0, 1.0)


@pytest.mark.parametrize(("samples", "runs"), [(2, 1), (5, 1), (101, 8), (1001, 8)])
def test_the_start_of_a_response_is_sampled_most_densely(samples: int, runs: int) -> None:
    """The times ascend from 0 to the end exactly, in runs of even spacing that double."""
    times = StepScenario(1e-5, 3.0, samples=samples).sample_times(0.15)
    widths = np.diff(times)
    assert (times[0], times[-1], times.size) == (0.0, 0.15, samples)
    assert np.unique(np.round(widths / widths[0], 6)).size == runs
    assert widths[-1] == pytest.approx(widths[0] * 2 ** (runs - 1))


def test_a_later_pulse_is_sampled_evenly() -> None:
    """A pulse of force that begins after the start gets an even spacing."""
    times = StepScenario(0.0, 3.0, disturbance=Disturbance(50.0, 5e-3, 2e-3)).sample_times(0.05)
    np.testing.assert_allclose(np.diff(times), 0.05 / 1000)

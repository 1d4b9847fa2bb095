"""Nyquist curves and K S: what is drawn is the loop, and the CSV rebuilds it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from magbear_cli.report.canvas import house_style
from magbear_cli.report.control_sensitivity_figure import control_sensitivity_drawing
from magbear_cli.report.nyquist_figure import loop_gain, nyquist_drawing
from magbear_cli.report.series import Labels
from magbear_cli.study.outcome import CaseOutcome

MakeCase = Callable[..., CaseOutcome]


def test_the_curves_are_the_loop_gain(make_case: MakeCase) -> None:
    """T/S is −K G of the bearing, and the circle about −1 has the radius of one over the peak of |S|."""
    case = make_case(0)
    study = case.frequency
    assert study is not None
    gain = loop_gain(study)
    plant = -50.0 / (study.masses_kg[:, None] * study.omega_rad_s**2 + 62_500.0)
    np.testing.assert_allclose(gain, -study.controller_a_per_m * plant, rtol=1e-9)
    with house_style():
        drawing = nyquist_drawing(case, (case,), Labels((case,)))
    assert drawing is not None
    (dashed,) = [patch for patch in drawing.figure.axes[0].patches if patch.center == (-1.0, 0.0)]  # type: ignore[attr-defined]
    assert dashed.radius == pytest.approx(1.0 / np.abs(study.sensitivity).max())  # type: ignore[attr-defined]
    columns = drawing.columns
    rebuilt = np.array(columns["real_loop_gain"]) + 1j * np.array(columns["imag_loop_gain"])
    np.testing.assert_array_equal(rebuilt, gain.ravel())


def test_templates_are_what_the_masses_do(make_case: MakeCase) -> None:
    """The disc over a template holds the gain of every mass of the range at its frequency, the bar its two ends."""
    case = make_case(0)
    with house_style():
        drawing = nyquist_drawing(case, (case,), Labels((case,)))
    assert drawing is not None
    axes = drawing.figure.axes[0]
    discs = [patch for patch in axes.patches if patch.center[0] not in {0.0, -1.0}]  # type: ignore[attr-defined]
    bars = [line for line in axes.lines if len(line.get_xdata()) == 2 and line.get_linewidth() == 1.6]  # type: ignore[arg-type]
    assert len(discs) == len(bars) >= 5
    for disc, bar in zip(discs, bars, strict=True):
        ends = np.asarray(bar.get_xdata()) + 1j * np.asarray(bar.get_ydata())
        centre = complex(*disc.center)  # type: ignore[attr-defined]
        np.testing.assert_allclose(np.abs(ends - centre), disc.radius, rtol=1e-9)  # type: ignore[attr-defined]
        assert abs((ends[0] / ends[1]).imag) < 1e-9  # the plant is real on the axis: a part of a ray


def test_one_mass_has_no_template(make_case: MakeCase) -> None:
    """A known mass gives one curve and a caption without templates; a case without curves gives no figure."""
    case = make_case(0)
    study = case.frequency
    assert study is not None
    single = replace(
        study,
        masses_kg=study.masses_kg[:1],
        negative_stiffness_n_per_m=study.negative_stiffness_n_per_m[:1],
        current_stiffness_n_per_a=study.current_stiffness_n_per_a[:1],
        sensitivity=study.sensitivity[:1],
        complementary_sensitivity=study.complementary_sensitivity[:1],
    )
    one = replace(case, frequency=single)
    with house_style():
        drawing = nyquist_drawing(one, (one,), Labels((one,)))
    assert drawing is not None
    assert "template" not in drawing.caption
    assert nyquist_drawing(replace(case, frequency=None), (case,), Labels((case,))) is None


def test_the_current_for_a_disturbance_is_drawn(make_case: MakeCase) -> None:
    """The curves are |K S| in dB and the phase of −K S in degrees; the largest is told with its mass."""
    case = make_case(0)
    study = case.frequency
    assert study is not None
    with house_style():
        drawing = control_sensitivity_drawing(case, (case,), Labels((case,)))
    assert drawing is not None
    sizes = np.array(drawing.columns["abs_ks_a_per_m"], dtype=float)
    np.testing.assert_allclose(sizes, np.abs(study.control_sensitivity_a_per_m).ravel(), rtol=1e-12)
    upper, lower = drawing.figure.axes[:2]
    assert upper.get_ylabel() == "|K S| (dB re 1 A/m)"
    assert lower.get_ylabel() == "phase of −K S (deg)"
    assert "A per micrometre" in drawing.alt
    assert control_sensitivity_drawing(replace(case, frequency=None), (case,), Labels((case,))) is None

"""A study as curves, and where they cross level 1."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from magbear_cli.errors import Status
from magbear_cli.report.series import Labels
from magbear_cli.report.sweep import Axis, Sweep, crossings, find_sweep, worst_case
from magbear_cli.study.outcome import CaseOutcome

MakeCase = Callable[..., CaseOutcome]


def with_level(case: CaseOutcome, level: float | None) -> CaseOutcome:
    """The case with another worst case."""
    return replace(case, summary=replace(case.summary, worst_case=level))


def sweep_of(*cases: CaseOutcome) -> Sweep:
    """The sweep of these cases, which is there."""
    sweep = find_sweep(cases, Labels(cases))
    assert sweep is not None
    return sweep


def test_each_case_lies_on_one_curve(make_case: MakeCase) -> None:
    """Two mass ranges and two methods over the limit are four curves with four names, by ascending limit."""
    cases = [
        make_case(index, mass_kg=mass, omega_c_rad_s=limit, controller={"method": method}, curves=False)
        for index, (method, mass, limit) in enumerate(
            (method, mass, limit)
            for method in ("hinf", "mu_convex")
            for mass in ((3.0, 4.0), (3.0, 4.5))
            for limit in (2e4, 1e4)
        )
    ]
    sweep = sweep_of(*cases)
    assert sweep.axis == Axis.OMEGA_C
    assert len({curve.label for curve in sweep.curves}) == len(sweep.curves) == 4
    assert all(curve.values == (1e4, 2e4) for curve in sweep.curves)
    assert sorted(case.index for curve in sweep.curves for case in curve.cases) == list(range(8))


@pytest.mark.parametrize(
    ("masses", "axis", "values"),
    [
        ([(3.0, 3.5), (3.0, 4.5)], Axis.HIGHEST_MASS, (3.5, 4.5)),
        ([(2.0, 2.0), (3.0, 3.0)], Axis.MASS, (2.0, 3.0)),
        ([(3.0, 4.0), (2.0, 5.0)], Axis.MASS_DEVIATION, (0.5, 1.5)),
    ],
)
def test_without_limits_the_mass_is_the_axis(
    make_case: MakeCase, masses: list[tuple[float, float]], axis: Axis, values: tuple[float, ...]
) -> None:
    """A sweep of the mass runs along its upper end, the mass itself, or the half-width of the range."""
    sweep = sweep_of(*(make_case(index, mass_kg=mass, curves=False) for index, mass in enumerate(masses)))
    assert (sweep.axis, sweep.curves[0].values) == (axis, values)


def test_one_point_is_no_sweep(make_case: MakeCase) -> None:
    """A study of one problem has no limitation curve."""
    cases = (make_case(0, curves=False), make_case(1, controller={"method": "hinf"}, curves=False))
    assert find_sweep(cases, Labels(cases)) is None
    assert find_sweep((), Labels(())) is None


def test_a_crossing_is_interpolated_on_a_power_law(make_case: MakeCase) -> None:
    """A level that falls like 1/ω_c from 2 at 3000 crosses 1 at 6000 rad/s."""
    cases = [with_level(make_case(i, omega_c_rad_s=limit), 6000.0 / limit) for i, limit in enumerate((3e3, 9e3, 1.2e4))]
    curve = sweep_of(*cases).curves[0]
    (crossing,) = crossings(curve, worst_case, Axis.OMEGA_C)
    assert crossing.value == pytest.approx(6000.0, rel=1e-12)
    assert crossing.text(Axis.OMEGA_C) == "near 6000 rad/s (interpolated)"


def test_between_a_proof_and_an_answer_nothing_is_interpolated(make_case: MakeCase) -> None:
    """Next to a proven impossibility the crossing is a bracket; next to a failure there is none."""
    proof = make_case(0, omega_c_rad_s=5e3, status=Status.INFEASIBLE, curves=False)
    failed = make_case(2, omega_c_rad_s=4e4, status=Status.FAILED, curves=False)
    curve = sweep_of(proof, make_case(1), failed).curves[0]
    (crossing,) = crossings(curve, worst_case, Axis.OMEGA_C)
    assert (crossing.low, crossing.high, crossing.value) == (5e3, 2e4, None)
    assert crossing.text(Axis.OMEGA_C) == "between 5000 rad/s (proven impossible) and 20\u202f000 rad/s"


def test_an_unstable_loop_has_no_level(make_case: MakeCase) -> None:
    """A supremum on the axis of a loop that is not stable is not drawn as a level."""
    assert worst_case(make_case(0, status=Status.UNSTABLE)) is None
    assert worst_case(with_level(make_case(0), float("inf"))) is None

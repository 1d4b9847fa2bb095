"""Tests of --set: the value replaces the study's before anything is validated, and a mistake names the option."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from magbear_cli.spec.problems import Problem
from magbear_cli.spec.study import read_study, read_study_text

Refused = Callable[..., tuple[Problem, ...]]
SWEPT = "sweep:\n  controller:\n    - {method: mu_convex}\n    - {method: fixed_order, order: 1}\n    - {method: lqg}\n"


def cases(text: str, *overrides: str) -> list[dict[str, Any]]:
    """The cases of a study with overrides."""
    return list(read_study_text(text, "text", overrides).cases())


@pytest.mark.parametrize(
    ("override", "path", "value"),
    [
        ("mass_kg=3.6", ("mass_kg",), 3.6),
        ("mass_kg=[2, 3]", ("mass_kg",), [2.0, 3.0]),
        ("mass_kg.1=4", ("mass_kg",), [3.0, 4.0]),
        ("bandwidth=null", ("bandwidth",), None),
        ("bandwidth.omega_c_rad_s=1e3", ("bandwidth", "omega_c_rad_s"), 1000.0),
        ("controller.uncertainty=complex", ("controller", "uncertainty"), "complex"),
        ("controller={method: lqg, r: 1e-9}", ("controller", "r"), 1e-9),
        ("simulate.0.step_m=390e-6", ("simulate", 0, "step_m"), 390e-6),
        ("simulate.0.prefilter=thesis_slow", ("simulate", 0, "prefilter", "omega_rad_s"), 1000.0),
        ("simulate.0.prefilter.zeta=0.7", ("simulate", 0, "prefilter", "zeta"), 0.7),
        ("bearing=thesis_thrust_half_switched", ("bearing", "current_law"), "half_switched"),
        (" mass_kg = 3.6", ("mass_kg",), 3.6),
    ],
)
def test_a_value_is_set_at_any_dotted_key(override: str, path: tuple[str | int, ...], value: object, base: str) -> None:
    """Sections, options, entries of lists, parts by name: each key of the study."""
    (found,) = cases(base, override)
    for key in path:
        found = found[key]  # type: ignore[index]
    assert found == value


def test_a_section_that_is_not_there_is_made(base: str) -> None:
    """Setting a bandwidth limit in a study without one makes the section; a part's name is opened."""
    text = base.replace("bandwidth: {omega_c_rad_s: 20000}\n", "").replace(
        "performance: {dc_gain: 10, corner_rad_s: 200}", "performance: thesis_precision"
    )
    (case,) = cases(text, "bandwidth.omega_c_rad_s=3000", "performance.corner_rad_s=100")
    assert case["bandwidth"] == {"omega_c_rad_s": 3000.0}
    assert case["performance"] == {"num": [1000.0], "den": [1.0, 100.0]}


def test_overrides_apply_in_their_order(base: str) -> None:
    """The last one wins."""
    (case,) = cases(base, "mass_kg=3.6", "mass_kg=3.7")
    assert case["mass_kg"] == 3.7


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("mass_kg", "KEY=VALUE"),
        ("=3", "KEY=VALUE"),
        ("", "KEY=VALUE"),
        ("mass_kg=", "null"),
        ("mass_kg=  ", "null"),
        ("mass_kg=# comment", "null"),
        ("mas_kg=3", "did you mean 'mass_kg'"),
        ("omega_c_rad_s=3", "did you mean 'bandwidth.omega_c_rad_s'"),
        ("controller.max_ordr=3", "did you mean 'controller.max_order'"),
        ("controller.ordr=3", "did you mean 'controller.max_order'"),
        ("controller.sample_time_s=2e-5", "legal are controller.method, controller.uncertainty"),
        ("simulate.first.step_m=3", "no key"),
        ("mass_kg=yes", "not the text 'yes'"),
        ("mass_kg=1,5", "1.5"),
        ("mass_kg=[4, 3]", "[3, 4]"),
        ("mass_kg=[3", "never closed"),
        ("mass_kg=010", "zero"),
        ("mass_kg=&a 3", "anchor"),
        ("mass_kg=3\0", "NUL"),
        ("controller.order=2", "it belongs to fixed_order"),
        ("controller.max_order=1", "at least 2"),
        ("performance.num=[1]", "does not go together"),
        ("simulate.7.step_m=1e-6", "no entry 7"),
        ("mass_kg.5=3", "no entry 5"),
        ("name.0=x", "no key"),
        ("name=a b", "letters"),
        ("run.memory_gib=0.5", "at least 1"),
        ("sweep.mas_kg=[3, 4]", "mass_kg"),
        ("sweep.mass_kg=3", "list"),
        ("magbear=2", "format"),
    ],
)
def test_a_wrong_override_is_named(override: str, words: str, base: str, refused: Refused) -> None:
    """The place is the option as typed, without a line."""
    problems = refused(base, override)
    found = [problem for problem in problems if words in f"{problem.sentence} {problem.remedy}"]
    assert found
    assert found[0].file.startswith("--set ")
    assert found[0].line is None
    assert str(found[0]).startswith("--set ")


def test_setting_a_swept_key_replaces_its_sweep(studies: Path) -> None:
    """The value given on the command line is the only one; so it is for a key above the swept one."""
    study = read_study(studies / "wc_sweep.yaml", ["bandwidth.omega_c_rad_s=5000"])
    assert list(study.sweep) == ["mass_kg"]
    assert {case["bandwidth"]["omega_c_rad_s"] for case in study.cases()} == {5000.0}
    without = read_study(studies / "wc_sweep.yaml", ["bandwidth=null", "mass_kg=3.6"])
    assert without.case_count == 1
    assert next(without.cases())["bandwidth"] is None


def test_an_option_is_set_in_each_swept_controller_that_has_it(base: str) -> None:
    """The others are left alone, and the base too if it has no such option."""
    found = [case["controller"] for case in cases(base + SWEPT, "controller.uncertainty=complex")]
    assert found[0]["uncertainty"] == "complex"
    assert [controller["method"] for controller in found] == ["mu_convex", "fixed_order", "lqg"]
    orders = [case["controller"].get("order") for case in cases(base + SWEPT, "controller.order=3")]
    assert orders == [None, 3, None]


def test_a_wrong_option_is_answered_with_those_of_the_methods_at_hand(base: str, refused: Refused) -> None:
    """Options of swept methods and of a method that an earlier --set names are near; those of others are not."""
    (problem,) = refused(base + SWEPT, "controller.ordr=3")
    assert problem.remedy == "did you mean 'controller.order'?"
    (problem,) = refused(base, "controller={method: fixed_order, order: 1}", "controller.ordr=3")
    assert problem.remedy == "did you mean 'controller.order'?"
    (problem,) = refused(base, "controller={method: lqg}", "controller.max_ordr=3")
    assert problem.remedy.startswith("legal are controller.method, controller.q, controller.r")


def test_an_option_that_no_swept_controller_has_is_refused(base: str, refused: Refused) -> None:
    """Nothing would have changed, so nothing is what the user would have got."""
    (problem,) = refused(base + SWEPT, "controller.gamma_tolerance=1e-4")
    assert problem.code == "E118"
    assert "it belongs to hinf" in problem.remedy


def test_entries_that_an_override_makes_equal_are_one(studies: Path) -> None:
    """Setting the order of two fixed-order entries that differ in nothing else leaves one of them."""
    study = read_study(studies / "quickstart.yaml", ["controller.order=3"])
    found = [case["controller"].get("minimise") for case in study.cases()]
    assert found == ["worst_case", "worst_case", "ks_peak"]


def test_a_key_below_a_swept_weight_is_set_in_each_form_that_has_it(base: str) -> None:
    """A corner is set in the weights that have one."""
    sweep = "sweep: {performance: [thesis_precision, thesis_regulator, {dc_gain: 5, corner_rad_s: 100}]}\n"
    found = [case["performance"]["den"] for case in cases(base + sweep, "performance.corner_rad_s=50")]
    assert found == [[1.0, 50.0], [1.0, 400.0, 40000.0], [1.0, 50.0]]


def test_the_sweep_itself_can_be_set(base: str) -> None:
    """One swept key, all of them, or none."""
    assert len(cases(base, "sweep.mass_kg=[3.1, 3.2, 3.3]")) == 3
    assert len(cases(base, "sweep.bandwidth.omega_c_rad_s=[1000, 2000]")) == 2
    assert len(cases(base, "sweep={mass_kg: [3.1, 3.2]}")) == 2
    assert len(cases(base + SWEPT, "sweep=null")) == 1
    assert len(cases(base + SWEPT, "sweep.controller=null")) == 1


@pytest.mark.parametrize(
    "overrides",
    [
        ["mass_kg=3.6"],
        ["description='a text with: colons, ''quotes'' \"both\" # and µ more'"],
        ["controller.uncertainty=complex", "sweep.mass_kg=[[3, 4], 3.5]"],
        ["simulate.0.prefilter=thesis_fast", "performance=thesis_regulator", "bandwidth=null"],
        ["mass_kg=  3.6\n# x"],
    ],
)
def test_a_study_with_overrides_is_written_so_that_it_reads_the_same(overrides: list[str], base: str) -> None:
    """Its text has the values in place, names the overrides in a comment and gives the same cases."""
    study = read_study_text(base, "text", overrides)
    again = read_study_text(study.text, "again")
    assert list(again.cases()) == list(study.cases())
    assert (again.name, again.description, again.report, again.run) == (
        study.name,
        study.description,
        study.report,
        study.run,
    )
    assert study.text.count("# --set ") == len(overrides)


def test_an_override_of_a_section_of_another_kind_is_refused(base: str, refused: Refused) -> None:
    """Nothing lies below a number, a text or what was already refused."""
    for line in ("mass_kg: 3.6", "mass_kg: {a: 1}", "mass_kg: [010, 4]"):
        assert refused(base.replace("mass_kg: [3.0, 4.5]", line), "mass_kg.1=4")
    assert refused("[1, 2]", "mass_kg=3")
    assert refused(base + "sweep: {controller: [{method: mu_convex, max_order: 010}]}\n", "controller.max_order=5")
    assert refused(base + "sweep: {controller: [3, mu_convex]}\n", "controller.max_order=5")
    assert refused(base.replace("{method: mu_convex}", "{method: 3}"), "controller.max_order=5")


def test_overrides_and_file_are_refused_together(base: str, refused: Refused) -> None:
    """All problems in one message, the file's and the option's."""
    problems = refused(base.replace("mu_convex", "mu_convx"), "mass_kg=-3", "nme=x")
    assert {problem.code for problem in problems} == {"E105", "E106", "E118"}

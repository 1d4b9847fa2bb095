"""Tests of grids on the command line: what they hold, and that the study they compile to can be run again."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.errors import InputError
from magbear_cli.spec.grid import compile_sweep, parse_grid, parse_mass
from magbear_cli.spec.problems import StudyError
from magbear_cli.spec.study import read_study, read_study_text


@settings(deadline=None, max_examples=60)
@given(low=st.floats(1e-2, 1e6), ratio=st.floats(1.1, 1e4), count=st.integers(2, 60))
def test_a_log_grid_has_exact_ends_and_equal_ratios(low: float, ratio: float, count: int) -> None:
    """N values, the ends as given, each the same factor above the one before."""
    high = low * ratio
    values = parse_grid(f"{low!r}:{high!r}:{count}")
    assert len(values) == count
    assert (values[0], values[-1]) == (low, high)
    step = math.log(high / low) / (count - 1)
    assert all(math.log(late / early) == pytest.approx(step, abs=1e-9) for early, late in pairwise(values))


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("7000,10000,2e4", [7000.0, 10000.0, 20000.0]),
        ("5000", [5000.0]),
        (" 1 , 2 ", [1.0, 2.0]),
        ("5000:20000:3", [5000.0, 10000.0, 20000.0]),
        ("1:1000:4", [1.0, 10.0, 100.0, 1000.0]),
    ],
)
def test_a_grid_is_a_list_or_a_range(text: str, values: list[float]) -> None:
    """Round numbers stay round."""
    assert parse_grid(text) == values


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "not a number"),
        ("a", "not a number"),
        ("1,,2", "not a number"),
        ("1,2,1.0", "twice"),
        ("0,1", "greater than 0"),
        ("-1", "greater than 0"),
        ("true", "not a number"),
        ("nan", "finite"),
        (".inf", "finite"),
        ("1e400", "larger than any float"),
        ("010", "zero"),
        ("1_000", "1000"),
        ("5 kHz", "write the number alone"),
        ("1:2", "LOW:HIGH:N"),
        ("1:2:3:4", "LOW:HIGH:N"),
        ("2:1:3", "lower end first"),
        ("1:1:3", "lower end first"),
        ("0:1:3", "greater than 0"),
        ("1:2:1", "whole number"),
        ("1:2:2.5", "whole number"),
        ("1:2:1e9", "whole number"),
        ("1:1.0000000000000002:50", "finer"),
        ("1:2:x", "not a number"),
    ],
)
def test_a_wrong_grid_is_a_sentence(text: str, words: str) -> None:
    """It names what was typed and what to write."""
    with pytest.raises(InputError, match=words):
        parse_grid(text)


def test_a_mass_is_a_number_or_a_range() -> None:
    """Both forms, in kg."""
    assert parse_mass("3.6") == 3.6
    assert parse_mass("3.0:4.5") == (3.0, 4.5)
    assert parse_mass("3:4") == (3.0, 4.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("4.5:3.0", "write 3:4.5"),
        ("3:3", "one number"),
        ("1:2:3", "3.0:4.5"),
        ("0", "greater than 0"),
        ("-1:2", "greater than 0"),
        ("3:", "not a number"),
        ("1e9", "does not lie"),
        ("3 kg", "write the number alone"),
    ],
)
def test_a_wrong_mass_is_a_sentence(text: str, words: str) -> None:
    """It says what to write."""
    with pytest.raises(InputError, match=words):
        parse_mass(text)


@settings(deadline=None, max_examples=300)
@given(st.text(max_size=12))
def test_no_text_ends_a_grid_or_a_mass_in_anything_but_a_sentence(text: str) -> None:
    """Whatever is typed is a grid or an InputError."""
    for parse in (parse_grid, parse_mass):
        try:
            assert parse(text)
        except InputError:
            continue


def test_without_a_base_the_thesis_bearing_is_swept() -> None:
    """The defaults are the thesis's thrust bearing at 20 000 rad/s and 3.0 to 4.5 kg."""
    (case,) = read_study_text(compile_sweep([], [], []), "text").cases()
    assert case["bearing"]["air_gap_m"] == 4e-4
    assert case["mass_kg"] == [3.0, 4.5]
    assert case["performance"] == {"num": [2000.0], "den": [1.0, 200.0]}
    assert case["bandwidth"] == {"omega_c_rad_s": 20000.0}
    assert case["controller"]["method"] == "mu_convex"


def test_the_grid_is_the_product_of_what_is_given() -> None:
    """Methods are the slowest, then masses, then limits; one value makes no sweep."""
    text = compile_sweep([7e3, 1e4], [(3.0, 4.5), 3.6], ["mu_convex", "lqg"])
    study = read_study_text(text, "text")
    assert list(study.sweep) == ["controller", "mass_kg", "bandwidth.omega_c_rad_s"]
    assert study.case_count == 8
    assert [case["mass_kg"] for case in study.cases()][:4] == [[3.0, 4.5], [3.0, 4.5], 3.6, 3.6]
    single = read_study_text(compile_sweep([1e4], [(3.0, 4.0)], ["lqg"]), "text")
    assert (single.case_count, single.sweep) == (1, {})
    assert next(single.cases())["bandwidth"] == {"omega_c_rad_s": 1e4}


def test_an_override_reaches_a_compiled_sweep() -> None:
    """The command line's method and the command line's option meet."""
    text = compile_sweep([1e4, 2e4], [(3.0, 4.5)], ["mu_convex"])
    study = read_study_text(text, "text", ["controller.uncertainty=complex"])
    assert {case["controller"]["uncertainty"] for case in study.cases()} == {"complex"}
    assert study.case_count == 2


def test_a_base_keeps_what_the_grid_does_not_name(studies: Path) -> None:
    """Simulations, report and the options of its controllers stay; the swept keys are the grid's."""
    base = (studies / "quickstart.yaml").read_text(encoding="utf-8")
    study = read_study_text(compile_sweep([1e4], [(3.0, 4.0), (3.0, 4.5)], ["fixed_order"], base), "text")
    assert [case["controller"]["order"] for case in study.cases()] == [1, 1, 2, 2, 2, 2]
    assert len(next(study.cases())["simulate"]) == 2
    assert study.report == read_study(studies / "quickstart.yaml").report
    untouched = read_study_text(compile_sweep([], [], [], base), "text")
    assert list(untouched.cases()) == list(read_study(studies / "quickstart.yaml").cases())


def test_the_grid_replaces_the_sweep_of_its_keys(studies: Path) -> None:
    """What the base sweeps and the command line gives is the command line's, the whole section too."""
    base = (studies / "wc_sweep.yaml").read_text(encoding="utf-8")
    study = read_study_text(compile_sweep([1e3, 2e3, 3e3], [], [], base), "text")
    assert [case["bandwidth"]["omega_c_rad_s"] for case in study.cases()][:3] == [1e3, 2e3, 3e3]
    assert study.case_count == 9
    whole = base.replace("bandwidth.omega_c_rad_s: [7000, 10000, 20000, 30000]", "bandwidth: [null]")
    assert read_study_text(compile_sweep([1e3], [3.6], [], whole), "text").sweep == {}


def test_a_base_with_paths_can_be_run_from_elsewhere(tmp_path: Path, base: str) -> None:
    """Parts by path are written out, paths of stored controllers are made absolute."""
    (tmp_path / "mine.yaml").write_text("air_gap_m: 3e-4\nforce_constant_n_m2_per_a2: 1e-6\nbias_current_a: 2\n")
    lines = [line for line in base.splitlines() if not line.startswith(("bearing", "controller"))]
    text = "\n".join([*lines, "bearing: mine.yaml", "controller: {method: stored, path: out/results.h5}"])
    (case,) = read_study_text(compile_sweep([1e3], [], [], text, tmp_path), "text").cases()
    assert case["bearing"]["air_gap_m"] == 3e-4
    assert case["controller"]["path"] == str(tmp_path / "out" / "results.h5")


def test_a_method_that_does_not_exist_is_named() -> None:
    """The nearest one is suggested."""
    with pytest.raises(InputError, match="did you mean 'mu_convex'"):
        compile_sweep([], [], ["mu_convx"])


@pytest.mark.parametrize("base", ["", "42", "- 1"])
def test_a_base_that_is_no_study_is_refused(base: str) -> None:
    """It must be a mapping before anything can be swept in it."""
    with pytest.raises(InputError, match="mapping"):
        compile_sweep([1e3], [], [], base)


@pytest.mark.parametrize("base", ["a: [", "a: 010", "bearing: missing.yaml", "magbear: 1\nsweep: 3\n", "controller: 3"])
def test_a_broken_base_is_refused_sooner_or_later(base: str, tmp_path: Path) -> None:
    """Either the compiling or the reading tells."""
    with pytest.raises(StudyError):
        read_study_text(compile_sweep([1e3, 2e3], [3.0], ["lqg", "hinf"], base, tmp_path), "text")

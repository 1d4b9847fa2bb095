"""Tests of a study that is believed: its cases, their order, their canonical form, and what reading costs."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from magbear_cli.spec.cases import EAGER_COUNT, LARGEST_COUNT
from magbear_cli.spec.problems import Problem, StudyError
from magbear_cli.spec.study import RunLimits, read_study, read_study_text

MINIMAL = """\
magbear: 1
name: minimal
bearing: thesis_thrust
mass_kg: 2
performance: thesis_precision
controller: {method: mu_convex}
"""
CONTROLLERS: dict[str, dict[str, Any]] = {
    "mu_convex": {"uncertainty": "real", "max_order": 12, "minimise": "worst_case", "step_prefilter": None},
    "limit": {"tolerance": 0.01, "max_order": None},
    "fixed_order": {"order": 1, "max_order": 6, "uncertainty": "real", "minimise": "worst_case"},
    "hinf": {"gamma_tolerance": 1e-3, "form": "mended"},
    "lqg": {"q": [1.0, 1e-5], "r": 3e-9, "xi": 1.0, "theta": 1e-15},
    "pole_placement": {"omega_rad_s": 600.0, "zeta": 1.0, "derivative_rad_s": None},
    "lqr": {"q": [1.0, 1e-5], "r": 3e-9, "derivative_rad_s": None},
    "adaptive_lfe": {
        "rho_m": 1e-6,
        "sigma_m": 0.5e-6,
        "gain": [1.71e4, 52.8],
        "design_mass_kg": None,
        "input_gain_m_per_s2_a": None,
        "adaptation_input_gain_m_per_s2_a": None,
        "reference_omega_rad_s": 600.0,
        "reference_zeta": 1.0,
        "taylor_order": 1,
        "trigger": "position",
        "gamma": 2e9,
    },
    "rotor_identification": {
        "resonance_rad_s": 4000.0,
        "touching_damping_n_s_per_m": 170.0,
        "growing_damping_n_s_per_m": 100.0,
        "pole_real_rad_s": 90.0,
        "pole_imag_rad_s": 3666.0,
    },
    "operating_range": {"position_m": [-2e-4, 2e-4], "current_a": [0.0, 0.0], "low_kg": 3.0, "points": 41},
    "lqg_ltr": {"xi": [1e-7, 50.0], "theta": 8e-9, "q": [1e6, 1e-3], "r": 1e-10},
}


def test_a_case_is_plain_json_with_every_default_filled_in() -> None:
    """The canonical inputs of the smallest study are complete."""
    (case,) = read_study_text(MINIMAL, "text").cases()
    assert json.loads(json.dumps(case, allow_nan=False)) == case
    assert case == {
        "bearing": {
            "air_gap_m": 4e-4,
            "force_constant_n_m2_per_a2": 4e-6,
            "bias_current_a": 0.5,
            "current_law": "full",
        },
        "operating_point": {"position_m": 0.0, "current_a": 0.0},
        "uncertain": None,
        "mass_kg": 2.0,
        "performance": {"num": [2000.0], "den": [1.0, 200.0]},
        "bandwidth": None,
        "controller": {
            "method": "mu_convex",
            "uncertainty": "real",
            "max_order": 12,
            "minimise": "worst_case",
            "step_prefilter": None,
        },
        "reduction": None,
        "simulate": [],
    }


def test_a_simulation_is_resolved_with_every_default() -> None:
    """Masses left out are the lowest, the middle of 1/m and the highest; parts are opened; whole numbers are floats."""
    text = MINIMAL.replace("mass_kg: 2", "mass_kg: [3, 4.5]") + (
        "simulate:\n  - {step_m: 1e-5, prefilter: thesis_fast, sensor: thesis_probe, rotor: thesis_flexible_c170}\n"
        "  - {disturbance: {force_n: 50, duration_s: 2e-3}, gravity_m_per_s2: 10}\n"
    )
    (case,) = read_study_text(text, "text").cases()
    first, second = case["simulate"]
    assert first == {
        "step_m": 1e-5,
        "masses_kg": [3.0, 3.6, 4.5],
        "model": "nonlinear",
        "prefilter": {"omega_rad_s": 20000.0, "zeta": 1.0},
        "sensor": {"omega_rad_s": 4000.0, "damping_rad_s": 560.0},
        "rotor": {"sensor_mass_kg": 0.1824, "stiffness_n_per_m": 2.612e6, "damping_n_s_per_m": 170.0},
        "gravity_m_per_s2": 0.0,
        "gravity_compensation": False,
        "current_limit_a": None,
        "disturbance": None,
        "duration_s": None,
        "samples": 1001,
    }
    assert second["step_m"] == 0.0
    assert second["disturbance"] == {"force_n": 50.0, "start_s": 0.0, "duration_s": 2e-3}
    assert isinstance(second["gravity_m_per_s2"], float)


@pytest.mark.parametrize("method", CONTROLLERS)
def test_each_method_has_its_documented_defaults(method: str) -> None:
    """A method alone carries all of its options into the case."""
    text = MINIMAL.replace("method: mu_convex", f"method: {method}")
    (case,) = read_study_text(text, "text").cases()
    assert case["controller"] == {"method": method, **CONTROLLERS[method]}


def test_weights_of_a_method_are_kept() -> None:
    """A zero in a pair is legal while the other is not zero."""
    text = MINIMAL.replace("{method: mu_convex}", "{method: lqg, q: [2, 0]}")
    (case,) = read_study_text(text, "text").cases()
    assert case["controller"]["q"] == [2.0, 0.0]


def test_a_stored_controller_keeps_its_path_and_case() -> None:
    """They are text here; whoever reads the file says whether it is there."""
    text = MINIMAL.replace("{method: mu_convex}", "{method: stored, path: out/results.h5}")
    (case,) = read_study_text(text, "text").cases()
    assert case["controller"] == {"method": "stored", "path": "out/results.h5", "case": None}


def test_what_means_the_same_is_the_same_case() -> None:
    """Forms of a weight, ways to write a number and leading zeros make no difference."""
    forms = (
        "{dc_gain: 10, corner_rad_s: 200}",
        "{num: [2000], den: [1, 200]}",
        "{num: [0, 2e3], den: [1.0, 2.0e2]}",
        "{num: [0.0, -0.0, 2000.0], den: [0, 1, 200]}",
    )
    texts = [MINIMAL.replace("thesis_precision", form) for form in forms]
    cases = {json.dumps(next(read_study_text(text, "text").cases()), sort_keys=True) for text in texts}
    assert len(cases) == 1


def test_a_touch_down_may_be_asked_for() -> None:
    """A step of 390 µm in a gap of 400 µm is a question, not a mistake."""
    study = read_study_text(f"{MINIMAL}simulate: [{{step_m: 390.0e-6}}]\n", "text")
    assert next(study.cases())["simulate"][0]["step_m"] == 390e-6


def test_the_first_swept_key_is_the_slowest(studies: Path) -> None:
    """Cases come in the order of nested loops over the keys as written."""
    study = read_study(studies / "wc_sweep.yaml")
    expected = [(high, wc) for high in (3.5, 4.0, 4.5) for wc in (7e3, 1e4, 2e4, 3e4)]
    found = [(case["mass_kg"][1], case["bandwidth"]["omega_c_rad_s"]) for case in study.cases()]
    assert found == expected
    assert study.case_count == 12
    assert study.swept(5) == {"mass_kg": [3.0, 4.0], "bandwidth.omega_c_rad_s": 10000}
    assert list(study.sweep) == ["mass_kg", "bandwidth.omega_c_rad_s"]


@pytest.mark.parametrize("index", [-1, 12])
def test_a_case_that_does_not_exist_is_an_index_error(index: int, studies: Path) -> None:
    """Indices count from 0 and do not wrap around."""
    study = read_study(studies / "wc_sweep.yaml")
    with pytest.raises(IndexError, match="12"):
        study.case(index)
    with pytest.raises(IndexError):
        study.swept(index)


def test_every_study_that_ships_is_legal(studies: Path) -> None:
    """All of their cases resolve and are distinct."""
    for path in studies.glob("*.yaml"):
        study = read_study(path)
        cases = [json.dumps(case, sort_keys=True) for case in study.cases()]
        assert len(set(cases)) == study.case_count >= 1


def test_a_sweep_may_stand_for_a_key_that_is_left_out(base: str) -> None:
    """A section without a value of its own takes it from the sweep, whole or in part."""
    text = base.replace("controller: {method: mu_convex}\n", "").replace("bandwidth: {omega_c_rad_s: 20000}\n", "")
    sweep = "sweep:\n  controller: [{method: mu_convex}, {method: lqg}]\n  bandwidth.omega_c_rad_s: [1000, 2000]\n"
    cases = list(read_study_text(text + sweep, "text").cases())
    assert [case["controller"]["method"] for case in cases] == ["mu_convex", "mu_convex", "lqg", "lqg"]
    assert [case["bandwidth"]["omega_c_rad_s"] for case in cases] == [1e3, 2e3, 1e3, 2e3]


def test_a_deeper_key_refines_a_swept_section(base: str) -> None:
    """Whatever the order in the file, a key below another is set after it, through the name of a part too."""
    sweep = (
        "sweep:\n  performance.corner_rad_s: [100, 300]\n  performance: [thesis_precision, thesis_slow]\n"
        "  mass_kg.1: [4, 5]\n  simulate.0.masses_kg.0: [3.1, 3.2]\n"
    )
    study = read_study_text(base + sweep, "text")
    cases = list(study.cases())
    assert [case["performance"]["den"][1] for case in cases[::8]] == [100.0, 300.0]
    assert [case["performance"]["num"][0] for case in cases[::4]] == [1000.0, 1800.0, 3000.0, 5400.0]
    assert [case["mass_kg"][1] for case in cases[:3]] == [4.0, 4.0, 5.0]
    assert [case["simulate"][0]["masses_kg"][0] for case in cases[:2]] == [3.1, 3.2]


def test_no_limit_can_be_swept_beside_limits(base: str) -> None:
    """Null is a value of a section that may be left out."""
    study = read_study_text(f"{base}sweep: {{bandwidth: [null, {{omega_c_rad_s: 3000}}]}}\n", "text")
    assert [case["bandwidth"] for case in study.cases()] == [None, {"omega_c_rad_s": 3000.0}]


def test_a_contradiction_of_one_combination_is_found_when_reading(
    base: str, refused: Callable[..., tuple[Problem, ...]]
) -> None:
    """A gap and a position, each legal with its neighbour, are refused together."""
    sweep = "sweep:\n  bearing.air_gap_m: [400e-6, 200e-6]\n  operating_point.position_m: [100e-6, 300e-6]\n"
    (problem,) = refused(base + sweep)
    assert problem.code == "E114"
    assert problem.line == base.count("\n") + 3


def grid(base: str, masses: int, limits: int, last_limit: str = "") -> str:
    """The base with a grid of cases."""
    first = ", ".join(f"[3.0, {3.5 + i * 1e-4:.4f}]" for i in range(masses))
    second = ", ".join([*(str(1000 + i) for i in range(limits - bool(last_limit))), *([last_limit] * bool(last_limit))])
    return f"{base}sweep:\n  mass_kg: [{first}]\n  bandwidth.omega_c_rad_s: [{second}]\n"


def test_a_large_grid_is_counted_and_its_ends_are_found(base: str) -> None:
    """Exactly as many cases as allowed are read; the last is the product's last."""
    study = read_study_text(grid(base, 100, LARGEST_COUNT // 100), "text")
    assert study.case_count == LARGEST_COUNT
    last = study.case(LARGEST_COUNT - 1)
    assert last["mass_kg"] == [3.0, 3.5099]
    assert last["bandwidth"] == {"omega_c_rad_s": 1999.0}


def test_one_case_too_many_is_refused(base: str, refused: Callable[..., tuple[Problem, ...]]) -> None:
    """The limit is the limit."""
    (problem,) = refused(grid(base, 11, 9091))
    assert problem.code == "E116"
    assert "100001" in problem.sentence


def test_a_wrong_value_of_a_large_grid_is_still_found_at_once(
    base: str, refused: Callable[..., tuple[Problem, ...]]
) -> None:
    """Each value of each key is looked at, however many products there are."""
    (problem,) = refused(grid(base, 60, 1000, last_limit="fast"))
    assert (problem.code, problem.line) == ("E104", base.count("\n") + 3)


def test_a_contradiction_far_in_a_large_grid_is_a_refusal_when_it_is_reached(base: str) -> None:
    """Beyond the cases that reading looks at, the case itself refuses."""
    gaps = ", ".join(f"{400 - i}e-6" for i in range(100))
    positions = ", ".join(f"{200 + i}e-6" for i in range(150))
    sweep = f"sweep:\n  bearing.air_gap_m: [{gaps}]\n  operating_point.position_m: [{positions}]\n"
    study = read_study_text(base + sweep, "text")
    assert study.case_count > EAGER_COUNT
    with pytest.raises(StudyError, match="beyond the air gap"):
        study.case(study.case_count - 1)
    with pytest.raises(StudyError, match="beyond the air gap"):
        list(study.cases())


def test_report_and_run_have_defaults_and_are_not_part_of_a_case(base: str) -> None:
    """Changing them leaves every case as it is."""
    text = base.replace("report: {figures: [mu, step]}\nrun: {timeout_s: 300, memory_gib: 4}\n", "")
    plain, full = read_study_text(text, "text"), read_study_text(base.replace("300", "20"), "text")
    assert plain.run == RunLimits(300.0, 4.0)
    assert full.run == RunLimits(20.0, 4.0)
    assert plain.report == {"figures": ["mu", "sensitivity", "nyquist", "poles", "controller_gain", "step"]}
    assert full.report == {"figures": ["mu", "step"]}
    assert list(plain.cases()) == list(full.cases())


def test_optional_sections_may_be_empty() -> None:
    """A section whose entries are commented out is a section left out."""
    empty = "".join(f"{key}:\n" for key in ("bandwidth", "operating_point", "simulate", "sweep", "report", "run"))
    plain, full = read_study_text(MINIMAL, "text"), read_study_text(MINIMAL + empty + "description:\n", "text")
    assert list(plain.cases()) == list(full.cases())
    assert (plain.report, plain.run, plain.description) == (full.report, full.run, full.description)


def test_reading_a_study_loads_no_numerics() -> None:
    """Checking a study stays quick: numpy, scipy and pictures are not imported."""
    code = "import sys, magbear_cli.spec; print({'numpy', 'scipy', 'h5py', 'click'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.strip() == "set()"

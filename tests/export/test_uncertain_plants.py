"""Whoever reads an export alone, and knows nothing of equivalent masses, computes the worst case that was stored."""

from __future__ import annotations

import json
import re
import sys
import types
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.io import loadmat

from magbear_cli.export.handover import Handover
from magbear_cli.export.writing import write_export
from magbear_cli.library.controller_file import read_controller_file
from magbear_cli.spec import read_study_text
from magbear_cli.study.pipeline import run_case
from magbear_cli.study.plan import case_id
from magbear_cli.study.sampling import SamplingOptions, sample_design

BASE = """\
magbear: 1
name: kz
bearing: {air_gap_m: 3.0e-4, force_constant_n_m2_per_a2: 6.0e-6, bias_current_a: 0.8, current_law: half_switched}
operating_point: {position_m: 5.0e-5, current_a: 0.1}
performance: {num: [1200.0, 1.2e5], den: [1.0, 150.0, 1.0e4]}
bandwidth: {omega_c_rad_s: 12000}
"""
FAMILIES = {
    "negative stiffness": "mass_kg: 1.2\nuncertain: {parameter: negative_stiffness, factor: [0.7, 1.4]}\n",
    "force constant": "mass_kg: 1.2\nuncertain: {parameter: force_constant, factor: [0.8, 1.25]}\n",
    "both": "mass_kg: [1.1, 1.3]\nuncertain: {force_constant: [0.9, 1.1]}\n",
    "all": "mass_kg: [1.1, 1.3]\nuncertain: {negative_stiffness: [0.9, 1.1], current_stiffness: [0.95, 1.05]}\n",
    "mass": "mass_kg: [1.0, 1.4]\n",
    "known": "mass_kg: 1.2\n",
}
OMEGA = np.append(0.0, np.geomspace(1.0, 1e6, 40_001))
Members = Sequence[tuple[float, float, float]]
Floats = NDArray[np.float64]


def _worst_case(k: dict[str, Any], members: Members, weight: tuple[Floats, Floats], omega_c: float) -> float:
    """The largest |W1 S| + |W3 T| over all plants whose (m ω² + k_z)/k_i lies between those of the members."""
    a, b, c, d = (np.atleast_2d(np.asarray(k[name], dtype=float)) for name in ("a", "b", "c", "d"))
    s = 1j * OMEGA
    states = np.linalg.solve(s[:, None, None] * np.eye(a.shape[0]) - a, np.broadcast_to(b + 0j, (s.size, *b.shape)))
    response = (c @ states + d)[:, 0, 0]
    ends = [(mass * OMEGA**2 + k_z) / k_i for mass, k_i, k_z in members]
    w1, w3 = np.abs(np.polyval(weight[0], s) / np.polyval(weight[1], s)), (OMEGA / omega_c) ** 2
    worst = 0.0
    for share in np.linspace(0.0, 1.0, 41):
        plant = -1.0 / (share * ends[0] + (1.0 - share) * ends[-1])
        sensitivity = 1.0 / (1.0 - response * plant)
        level = w1 * np.abs(sensitivity) + w3 * np.abs(response * plant * sensitivity)
        worst = max(worst, float(level.max()))
    return worst


@pytest.fixture(scope="module", params=list(FAMILIES))
def handed(request: pytest.FixtureRequest) -> tuple[str, Handover]:
    """A controller for each kind of family; for the negative stiffness the best one."""
    method = "mu_convex" if request.param == "negative stiffness" else "fixed_order, order: 2"
    text = f"{BASE}{FAMILIES[request.param]}controller: {{method: {method}}}\n"
    inputs = read_study_text(text, "study.yaml").case(0)
    outcome = run_case(inputs, case_id(inputs), 0)
    assert outcome.controller is not None
    return request.param, Handover("k", "kz", outcome, outcome.controller)


def _from_json(path: Path) -> tuple[dict[str, Any], Members]:
    document = json.loads(path.read_text("ascii"))
    names = ("mass_kg", "current_stiffness_n_per_a", "negative_stiffness_n_per_m")
    return document, [tuple(one[name] for name in names) for one in document["plant"]["members"]]


def test_the_worst_case_is_recomputed_from_json_alone(handed: tuple[str, Handover], tmp_path: Path) -> None:
    """Members, weights and matrices of the file give its worst case; the rotor's mass is the rotor's mass."""
    name, handover = handed
    document, members = _from_json(write_export(handover, "json", tmp_path)[0])
    asked = document["specification"]
    weight = tuple(np.array(asked["performance"][side]) for side in ("num", "den"))
    worst = _worst_case(document, members, weight, asked["omega_c_rad_s"])  # type: ignore[arg-type]
    assert worst == pytest.approx(document["case"]["worst_case"], rel=1e-4)
    if name == "negative stiffness":
        assert worst == pytest.approx(0.4534, abs=5e-5)
        k_z = [one[2] for one in members]
        assert k_z[1] / k_z[0] == pytest.approx(2.0)
        assert document["plant"]["negative_stiffness_n_per_m"] == pytest.approx(np.mean(k_z))
        assert document["case"]["worst_mass_kg"] == 1.2
        assert min(k_z) * (1 - 1e-12) <= document["case"]["worst_negative_stiffness_n_per_m"] <= max(k_z) * (1 + 1e-12)
    mass = handover.outcome.mass_kg
    assert document["plant"]["mass_kg"] == (mass if isinstance(mass, list) else [mass, mass])
    assert len(members) == (1 if name == "known" else 2)


def test_the_worst_case_is_recomputed_from_the_mat_file_alone(handed: tuple[str, Handover], tmp_path: Path) -> None:
    """The variables have the same numbers, and the file is one that ``stored`` reads."""
    _, handover = handed
    path = write_export(handover, "mat", tmp_path)[0]
    found = loadmat(path)
    columns = [found[name][0].tolist() for name in ("members_mass_kg", "members_k_i", "members_k_z")]
    controller = {name: found[name.upper()] for name in ("a", "b", "c", "d")}
    weight = found["W1_num"][0], found["W1_den"][0]
    worst = _worst_case(controller, list(zip(*columns, strict=True)), weight, found["omega_c_rad_s"].item())
    assert worst == pytest.approx(found["worst_case"].item(), rel=1e-4)
    assert read_controller_file(path)["a"] == handover.controller.a.tolist()


def test_the_texts_name_the_same_members(
    handed: tuple[str, Handover],
    run_script: Callable[[Path], dict[str, object]],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    """The C header, the script and the element of ROSS state every member to the last digit, and both weights."""
    _, handover = handed
    sampled = Handover(
        "k", "kz", handover.outcome, handover.controller, sample_design(handover.outcome, SamplingOptions(1e-5))
    )
    document, members = _from_json(write_export(handover, "json", tmp_path)[0])
    monkeypatch.setitem(sys.modules, "ross", types.ModuleType("ross"))
    paths = {form: write_export(handover, form, tmp_path / form)[0] for form in ("python", "ross")}
    paths["c"] = write_export(sampled, "c", tmp_path / "c")[0]
    for form, path in paths.items():
        text = path.read_text("ascii")
        found = re.findall(r"member: m = (\S+) kg, k_i = (\S+) N/A, k_z = (\S+) N/m", text)
        assert [tuple(map(float, one)) for one in found] == members
        for side in ("num", "den"):
            (numbers,) = re.findall(rf"^(?: \* )?{side} \[(.*)\]$", text, re.MULTILINE)
            assert [float(one) for one in numbers.split(",")] == document["specification"]["performance"][side]
        assert "wc = 12000.0 rad/s" in text
        if form != "c":
            assert run_script(path)["MEMBERS"] == members

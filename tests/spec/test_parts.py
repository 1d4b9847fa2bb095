"""Tests of the named parts: all of configs/ is legal, and a part of the user's own is read from its path."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from magbear_cli.spec.models import PARTS
from magbear_cli.spec.parts import configs_folder, part_names
from magbear_cli.spec.problems import Problem, StudyError
from magbear_cli.spec.study import read_study, read_study_text

Spoiled = Callable[[str, str], str]

LINES = {
    "bearings": "bearing: {}",
    "weights": "performance: {}",
    "prefilters": "simulate: [{{step_m: 1e-5, prefilter: {}}}]",
    "sensors": "simulate: [{{step_m: 1e-5, sensor: {}}}]",
    "rotors": "simulate: [{{step_m: 1e-5, rotor: {}}}]",
}


@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind in LINES for name in part_names(kind)])
def test_every_part_is_legal_and_says_where_its_numbers_come_from(kind: str, name: str, spoiled: Spoiled) -> None:
    """Each file of configs/ can stand in a study by its name, and begins with a comment."""
    line = LINES[kind].format(name)
    assert read_study_text(spoiled(line.partition(":")[0], line), "text").case_count == 1
    assert (configs_folder() / kind / f"{name}.yaml").read_text(encoding="utf-8").startswith("# ")


def test_every_kind_of_part_has_a_folder() -> None:
    """The places of parts and the folders of configs/ are the same, but for baselines and the thesis's claims."""
    folders = {path.name for path in configs_folder().iterdir() if path.is_dir()}
    assert set(PARTS.values()) == set(LINES) == folders - {"baselines", "thesis"}


@pytest.mark.parametrize("name", ["thesis_flexible_c100", "thesis_flexible_c170"])
def test_the_thesis_rotor_has_the_printed_resonance(spoiled: Spoiled, name: str) -> None:
    """sqrt(stiffness / reduced mass) of the rotor of 2.2 kg is the printed 4000 rad/s within the 2 % it is known to."""
    (case,) = read_study_text(spoiled("simulate", LINES["rotors"].format(name)), "text").cases()
    rotor = case["simulate"][0]["rotor"]
    reduced = rotor["sensor_mass_kg"] * (2.2 - rotor["sensor_mass_kg"]) / 2.2
    assert (rotor["stiffness_n_per_m"] / reduced) ** 0.5 == pytest.approx(4000, rel=0.02)


def test_the_half_switched_bearing_differs_in_its_current_law_only(base: str) -> None:
    """Both are Table 2.1."""
    lines = [f"bearing: {name}" for name in ("thesis_thrust", "thesis_thrust_half_switched")]
    old = next(line for line in base.splitlines() if line.startswith("bearing"))
    full, half = (next(read_study_text(base.replace(old, line), "text").cases())["bearing"] for line in lines)
    assert {key for key in full if full[key] != half[key]} == {"current_law"}


def test_a_part_is_read_from_a_path_beside_the_study(tmp_path: Path, spoiled: Spoiled) -> None:
    """The path is counted from the study's folder, not from the working directory."""
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "mine.yaml").write_text(
        "air_gap_m: 3e-4\nforce_constant_n_m2_per_a2: 1e-6\nbias_current_a: 2\n"
    )
    path = tmp_path / "study.yaml"
    path.write_text(spoiled("bearing", "bearing: parts/mine.yaml"))
    assert next(read_study(path).cases())["bearing"]["air_gap_m"] == 3e-4


def test_a_fault_in_a_part_is_placed_in_its_file(tmp_path: Path, spoiled: Spoiled) -> None:
    """The message names the part's file and line, not the study's."""
    (tmp_path / "mine.yaml").write_text(
        "# mine\nair_gap: 3e-4\nforce_constant_n_m2_per_a2: 1e-6\nbias_current_a: 2 A\n"
    )
    path = tmp_path / "study.yaml"
    path.write_text(spoiled("bearing", "bearing: mine.yaml"))
    with pytest.raises(StudyError) as caught:
        read_study(path)
    found = [(Path(problem.file).name, problem.line, problem.code) for problem in caught.value.problems]
    assert found == [("mine.yaml", 2, "E102"), ("mine.yaml", 4, "E104")]


@pytest.mark.parametrize("content", ["", "- 1\n", "42\n", "[", "a: *b\n", "\0"])
def test_a_part_that_is_no_mapping_is_refused(content: str, tmp_path: Path, spoiled: Spoiled) -> None:
    """Whatever the file holds, it is a sentence."""
    (tmp_path / "mine.yaml").write_text(content)
    with pytest.raises(StudyError):
        read_study_text(spoiled("bearing", "bearing: mine.yaml"), "text", folder=tmp_path)


def test_a_part_that_is_a_pipe_a_folder_or_missing_is_refused(
    tmp_path: Path, spoiled: Spoiled, refused: Callable[..., tuple[Problem, ...]]
) -> None:
    """A part is opened as carefully as a study."""
    os.mkfifo(tmp_path / "pipe.yaml")
    (tmp_path / "folder.yaml").mkdir()
    for name in ("pipe.yaml", "folder.yaml", "missing.yaml", "x" * 400 + ".yaml"):
        (problem,) = refused(spoiled("bearing", f"bearing: {name}"), folder=tmp_path)
        assert problem.code == "E100"


def test_parts_can_be_swept(base: str) -> None:
    """Names stand in a list like any value, and the case holds what they stand for."""
    study = read_study_text(f"{base}sweep: {{performance: [thesis_precision, thesis_regulator]}}\n", "text")
    assert [case["performance"]["num"] for case in study.cases()] == [[2000.0], [360000.0]]
    assert study.swept(1) == {"performance": "thesis_regulator"}

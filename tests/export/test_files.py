"""What is in the exported files, each read by the tool that it is for."""

from __future__ import annotations

import json
import sys
import types
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import control
import numpy as np
import pytest
from scipy.io import loadmat

from magbear_cli.errors import InputError, ResumableError
from magbear_cli.export.handover import Handover, identifier
from magbear_cli.export.writing import FORMATS, write_export
from magbear_cli.lti.frequency import frequency_response

OMEGA = np.array([10.0, 1e3, 1e5])


@pytest.mark.parametrize("form", ["mat", "json", "c", "python"])
def test_the_same_controller_gives_the_same_bytes(sampled: list[Handover], form: str, tmp_path: Path) -> None:
    """Writing twice makes no difference, and leaves no other file behind."""
    first = {path.name: path.read_bytes() for path in write_export(sampled[2], form, tmp_path / "one")}
    second = {path.name: path.read_bytes() for path in write_export(sampled[2], form, tmp_path / "two")}
    assert first == second
    assert {path.name for path in (tmp_path / "one").iterdir()} == set(first)


def test_json_is_a_stored_controller(sampled: list[Handover], tmp_path: Path) -> None:
    """The file can be the path of a study's ``stored`` controller, and holds the sampled one beside it."""
    from magbear_cli.library.stored import StoredControllers

    (path,) = write_export(sampled[0], "json", tmp_path)
    inputs = {"controller": {"method": "stored", "path": path.name, "case": None}}
    stored = StoredControllers(tmp_path).put_into(inputs)["controller"]
    assert stored["a"] == sampled[0].controller.a.tolist()
    document = json.loads(path.read_text("ascii"))
    assert document["plant"]["negative_stiffness_n_per_m"] == 62_500.0
    assert document["sampled"]["sample_time_s"] == 2e-5
    assert len(document["sampled"]["sos"]) == 4


def test_mat_is_a_stored_controller(continuous: list[Handover], sampled: list[Handover], tmp_path: Path) -> None:
    """The file of a continuous controller is one that ``stored`` reads; that of a sampled one is refused."""
    from magbear_cli.library.controller_file import read_controller_file

    own = continuous[0].controller
    found = read_controller_file(write_export(continuous[0], "mat", tmp_path)[0])
    assert found == {name: getattr(own, name).tolist() for name in ("a", "b", "c", "d")}
    with pytest.raises(InputError, match="'Ts' says that the controller is sampled"):
        read_controller_file(write_export(sampled[0], "mat", tmp_path / "sampled")[0])


def test_mat_in_continuous_time(continuous: list[Handover], tmp_path: Path) -> None:
    """Without sampling the MAT-file has the controller's own matrices, Ts = 0 and names with units."""
    path = write_export(continuous[0], "mat", tmp_path)[0]
    found = loadmat(path)
    np.testing.assert_array_equal(found["A"], continuous[0].controller.a)
    assert found["Ts"].item() == 0.0
    assert (found["input_unit"].item(), found["output_unit"].item()) == ("m", "A")
    assert path.read_bytes().startswith(b"MATLAB 5.0 MAT-file, written by magbear")


def test_the_script_in_continuous_time(
    continuous: list[Handover], run_script: Callable[[Path], dict[str, object]], tmp_path: Path
) -> None:
    """Its object of python-control has the response of the controller."""
    (path,) = write_export(continuous[0], "python", tmp_path)
    system = run_script(path)["controller"]
    expected = frequency_response(continuous[0].controller, OMEGA)[:, 0, 0]
    np.testing.assert_allclose(control.frequency_response(system, OMEGA).complex, expected, rtol=1e-8)


def test_the_bearing_for_ross(
    continuous: list[Handover],
    run_script: Callable[[Path], dict[str, object]],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    """By ROSS's formulas the element has this bearing's stiffnesses, and its controller is −K."""
    asked: dict[str, object] = {}
    stand_in = types.ModuleType("ross")
    stand_in.MagneticBearingElement = lambda **options: asked.update(options)  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "ross", stand_in)
    for law in ("full", "half_switched"):
        inputs = continuous[0].outcome.inputs
        outcome = replace(
            continuous[0].outcome, inputs={**inputs, "bearing": {**inputs["bearing"], "current_law": law}}
        )
        handover = replace(continuous[0], outcome=outcome)
        (path,) = write_export(handover, "ross", tmp_path)
        run_script(path)["element"](0)  # type: ignore[operator]
        gap, bias, area, windings = (float(asked[key]) for key in ("g0", "i0", "ag", "nw"))  # type: ignore[arg-type]
        constant = 4e-7 * np.pi * windings**2 * area / 4.0
        amplifier = float(asked["k_amp"])  # type: ignore[arg-type]
        assert 4.0 * constant * bias**2 / gap**3 == pytest.approx(handover.problem.nominal.negative_stiffness_n_per_m)
        assert 4.0 * constant * bias / gap**2 * amplifier == pytest.approx(
            handover.problem.nominal.current_stiffness_n_per_a
        )
        assert [gap, bias] == pytest.approx([400e-6, 0.5])
    response = control.frequency_response(asked["controller_transfer_function"], OMEGA).complex
    np.testing.assert_allclose(response, -frequency_response(continuous[0].controller, OMEGA)[:, 0, 0], rtol=1e-6)


def test_ross_itself_takes_it(
    continuous: list[Handover], run_script: Callable[[Path], dict[str, object]], tmp_path: Path
) -> None:
    """ROSS, where it is installed, makes the element, with the static stiffness −k_i K(0) − k_z."""
    pytest.importorskip("ross", reason="ROSS is not installed: pip install 'magbear[ross]'")
    (path,) = write_export(continuous[0], "ross", tmp_path)
    element = run_script(path)["element"](0, frequency=[1e-3, 1e-2, 0.1, 1.0])  # type: ignore[operator]
    assert (element.ks, element.ki) == (pytest.approx(-62_500.0), pytest.approx(50.0))
    static = -50.0 * frequency_response(continuous[0].controller, [0.0])[0, 0, 0].real - 62_500.0
    assert element.kxx[0] == pytest.approx(static, rel=1e-4)


def test_formats_that_do_not_fit_say_so(continuous: list[Handover], sampled: list[Handover], tmp_path: Path) -> None:
    """C needs a sample time, ROSS must not have one, and a folder that cannot be is told."""
    assert set(FORMATS) == {"mat", "json", "c", "python", "ross"}
    with pytest.raises(InputError, match="--sample-time"):
        write_export(continuous[0], "c", tmp_path)
    with pytest.raises(InputError, match="leave --sample-time out"):
        write_export(sampled[0], "ross", tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(ResumableError, match="could not be written"):
        write_export(continuous[0], "json", tmp_path / "file")


@pytest.mark.parametrize(
    ("text", "name"), [("My study 3", "my_study_3"), ("3.0-4.5", "k_3_0_4_5"), ("quickstart_20f", "quickstart_20f")]
)
def test_names_are_identifiers(text: str, name: str) -> None:
    """Whatever a study is called, its controller has a name that C, MATLAB and Python take."""
    assert identifier(text) == name
    with pytest.raises(InputError):
        identifier("µ")

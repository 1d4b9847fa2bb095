"""Whole runs through the command, whose cases do not all end well or whose surroundings are not kind."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import pytest
import xarray as xr

from magbear_cli.errors import Status
from magbear_cli.store.results import read_results

Process = Callable[..., Any]

MIXED = """\
magbear: 1
name: mixed
bearing: thesis_thrust
mass_kg: 3.6
performance: {dc_gain: 10, corner_rad_s: 200}
simulate: [{step_m: 390.0e-6, masses_kg: [3.6], samples: 11}]
report: {figures: [controller_gain]}
controller: {method: lqg}
sweep:
  controller: [{method: lqg}, {method: hinf}, {method: stored, path: gain.json}]
"""


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, subprocess.CompletedProcess[str]]:
    """A run without a bandwidth limit, which hinf cannot do, and with a controller of the wrong sign; how it ended."""
    folder = tmp_path_factory.mktemp("mixed")
    (folder / "mixed.yaml").write_text(MIXED, "utf-8")
    (folder / "gain.json").write_text('{"a": [], "b": [], "c": [[]], "d": [[1e6]]}', "utf-8")
    line = [sys.executable, "-m", "magbear_cli", "run", "mixed.yaml", "-o", "out", "--json"]
    done = subprocess.run(line, cwd=folder, capture_output=True, encoding="utf-8", timeout=300, check=False)
    return folder / "out", done


def test_a_failed_case_stops_no_other_and_shows_in_the_code(
    mixed: tuple[Path, subprocess.CompletedProcess[str]],
) -> None:
    """The exit code is 3, the other cases have their answers, and the failed one says why and how to repeat it."""
    _, done = mixed
    assert done.returncode == 3, done.stderr
    lqg, hinf, stored = json.loads(done.stdout)["cases"]
    assert (lqg["status"], hinf["status"], stored["status"]) == ("not_achieved", "failed", "unstable")
    assert "D12" in hinf["sentence"]
    assert hinf["id"] in hinf["repro"]
    assert [hinf[key] for key in ("worst_case", "peak_mu", "order", "steps")] == [None, None, None, []]
    assert (stored["worst_case"], stored["peak_mu"], stored["order"]) == (None, None, 0)
    assert "Traceback" not in done.stderr


def test_a_touch_down_is_told_and_not_a_number(mixed: tuple[Path, subprocess.CompletedProcess[str]]) -> None:
    """A step of 390 µm ends on the stator: no settling time, no overshoot, but the word."""
    _, done = mixed
    (step,) = json.loads(done.stdout)["cases"][0]["steps"]
    assert step["touched_down"] is True
    assert (step["settling_time_s"], step["overshoot"]) == (None, None)


def test_the_report_is_complete_before_the_code(mixed: tuple[Path, subprocess.CompletedProcess[str]]) -> None:
    """Every case, the failed one too, is in the results file and on the page."""
    folder, _ = mixed
    outcomes = read_results(folder / "results.h5").outcomes
    assert [outcome.status for outcome in outcomes] == [Status.NOT_ACHIEVED, Status.FAILED, Status.UNSTABLE]
    page = (folder / "report" / "index.html").read_text("utf-8")
    assert "D12" in page
    assert all(outcome.case_id[:7] in page for outcome in outcomes)


def test_an_answer_that_is_no_success_is_reused_and_a_failure_is_tried_again(
    mixed: tuple[Path, subprocess.CompletedProcess[str]], process: Process, tmp_path: Path
) -> None:
    """Running again computes the failed case only; asked for an answered case alone, the command ends well."""
    folder, _ = mixed
    shutil.copytree(folder, tmp_path / "out")
    for name in ("mixed.yaml", "gain.json"):
        shutil.copy(folder.parent / name, tmp_path)
    again = process("run", "mixed.yaml", "-o", "out")
    assert again.code == 3
    assert "2 of 3 cases reused, 1 to compute" in again.err
    assert "ended as failed before, will be tried again" in again.err
    first = read_results(folder / "results.h5").outcomes[0].case_id
    assert process("run", "mixed.yaml", "-o", "out", "--case", first[:6]).code == 0


def test_real_results_open_in_xarray_with_units_on_every_axis(
    mixed: tuple[Path, subprocess.CompletedProcess[str]], finished: Path
) -> None:
    """What a run wrote, failed and unstable cases included, opens without our code, and every axis has its unit."""
    for folder in (mixed[0], finished):
        path = folder / "results.h5"
        groups = ["/"]
        with h5py.File(path) as file:
            file.visititems(lambda name, item: groups.append(name) if isinstance(item, h5py.Group) else None)  # noqa: B023 - called at once
        for group in groups:
            with xr.open_dataset(path, engine="h5netcdf", group=group) as dataset:
                for axis in dataset.dims:
                    assert dataset.coords[axis].attrs["units"]


def test_a_font_cache_that_cannot_be_written_costs_no_report(process: Process, finished: Path, tmp_path: Path) -> None:
    """MPLCONFIGDIR where nothing can be written: the report is drawn all the same, without a traceback."""
    ended = process("report", finished, "-o", "page", changed={"MPLCONFIGDIR": "/proc/nowhere"})
    assert ended.code == 0, ended.err
    assert "Traceback" not in ended.err
    assert (tmp_path / "page" / "index.html").is_file()


def test_a_read_only_file_system_is_told(tiny: Path, tmp_path: Path) -> None:
    """On a file system mounted for reading a run ends in a sentence and exit code 4, and makes nothing."""
    (tmp_path / "mounted").mkdir()
    mount = 'mount -t tmpfs -o ro none mounted && exec "$@"'
    line = ["unshare", "--mount", "sh", "-c", mount, "sh", sys.executable, "-m", "magbear_cli"]
    if (
        not shutil.which("unshare")
        or subprocess.run(
            ["unshare", "--mount", "sh", "-c", "mount -t tmpfs -o ro none mounted"],
            cwd=tmp_path,
            capture_output=True,
            check=False,
        ).returncode
    ):
        pytest.skip("a read-only file system cannot be mounted here")
    done = subprocess.run(
        [*line, "run", str(tiny), "-o", "mounted/out"], cwd=tmp_path, capture_output=True, encoding="utf-8", check=False
    )
    assert (done.returncode, done.stdout) == (4, "")
    assert "the file system is read-only" in done.stderr
    assert "Traceback" not in done.stderr

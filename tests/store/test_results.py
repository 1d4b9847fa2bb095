"""A results file is the same bytes for the same study, opens everywhere and shows its damage."""

from __future__ import annotations

import dataclasses
import random
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.errors import InputError, MagbearError, ResumableError
from magbear_cli.store.layout import LAYOUT_VERSION
from magbear_cli.store.results import read_results, write_results
from magbear_cli.study.outcome import CaseOutcome, StudyResults

Same = Callable[[object, object], bool]
FullCase = Callable[[int], CaseOutcome]


@pytest.fixture
def study(full_case: FullCase) -> StudyResults:
    """A study of three full cases, with letters beyond ASCII in its texts."""
    outcomes = tuple(full_case(index) for index in range(3))
    return StudyResults("lager", "magbear: 1\n# für 3 µm\n", outcomes, {"figures": ["mu"]}, {"numpy": "2.4", "a": "b"})


@settings(deadline=None, max_examples=25)
@given(data=st.data())
def test_a_study_reads_back_exactly(
    data: st.DataObject, any_study: st.SearchStrategy[StudyResults], are_same: Same
) -> None:
    """What was written is what is read: every number, text and missing figure."""
    results = data.draw(any_study)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "results.h5"
        write_results(path, results)
        assert are_same(read_results(path), results)


def test_equal_studies_have_equal_bytes(tmp_path: Path, study: StudyResults) -> None:
    """Neither rewriting, nor the order in which cases ended or dictionaries were filled, changes a byte."""
    shuffled = [
        dataclasses.replace(
            outcome,
            inputs=dict(reversed(list(outcome.inputs.items()))),
            statistics=dict(reversed(list(outcome.statistics.items()))),
            frequency=outcome.frequency
            and dataclasses.replace(outcome.frequency, sensitivity=np.asfortranarray(outcome.frequency.sensitivity)),
        )
        for outcome in reversed(study.outcomes)
    ]
    other = dataclasses.replace(
        study, outcomes=tuple(shuffled), provenance=dict(reversed(list(study.provenance.items())))
    )
    for name, results in (("first", study), ("second", study), ("third", other)):
        write_results(tmp_path / name, results)
    first = (tmp_path / "first").read_bytes()
    assert first == (tmp_path / "second").read_bytes()
    assert first == (tmp_path / "third").read_bytes()


def test_another_process_writes_the_same_bytes(tmp_path: Path, study: StudyResults) -> None:
    """Reading and writing again in a process with other hash seeds gives the file back."""
    write_results(tmp_path / "a.h5", study)
    script = (
        "import sys, pathlib; from magbear_cli.store.results import *;"
        "write_results(pathlib.Path(sys.argv[2]), read_results(pathlib.Path(sys.argv[1])))"
    )
    subprocess.run([sys.executable, "-c", script, tmp_path / "a.h5", tmp_path / "b.h5"], check=True)
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()


def _groups(path: Path) -> list[str]:
    found = ["/"]
    with h5py.File(path) as file:
        file.visititems(lambda name, item: found.append(name) if isinstance(item, h5py.Group) else None)
    return found


def test_xarray_opens_every_group_with_units_on_every_axis(tmp_path: Path, study: StudyResults) -> None:
    """Every dimension has a coordinate with a unit and a meaning, every number a unit."""
    path = tmp_path / "results.h5"
    write_results(path, study)
    groups = _groups(path)
    assert len(groups) > 20
    for group in groups:
        with xr.open_dataset(path, engine="h5netcdf", group=group) as dataset:
            for axis in dataset.dims:
                assert dataset.coords[axis].attrs["units"]
                assert dataset.coords[axis].attrs["long_name"]
            for variable in dataset.data_vars.values():
                assert variable.dtype.kind == "S" or variable.attrs["units"]
    with xr.open_dataset(path, engine="h5netcdf", group="case_0002/frequency") as dataset:
        frequency = study.outcomes[1].frequency
        assert frequency is not None
        chosen = dataset["sensitivity"].sel(masses_kg=3.5, omega_rad_s=1e3, method="nearest")
        place = int(np.abs(frequency.omega_rad_s - 1e3).argmin())
        assert complex(*chosen.values) == frequency.sensitivity[1, place]


def test_the_table_has_one_row_a_case(tmp_path: Path, study: StudyResults) -> None:
    """Plain h5py reads the table, the default plot and the layout's version without our code."""
    path = tmp_path / "results.h5"
    write_results(path, study)
    with h5py.File(path) as file:
        assert file.attrs["layout_version"] == LAYOUT_VERSION
        table = file["cases"]
        assert list(table["case"][()]) == [1, 2, 3]
        assert list(table["mass_high_kg"][()]) == [4.0, 5.0, 6.0]
        assert table["mass_high_kg"].attrs["units"] == b"kg"
        assert list(table["peak_mu"][()]) == [0.512] * 3
        assert np.isnan(table["disk_margin"][()]).all()
        assert list(table["verified"][()]) == [1, 1, 1]
        assert table["verified"].attrs["flag_meanings"] == b"false true"
        assert table["group"][2] == b"case_0003"
        shown = file[file.attrs["default"].decode()]
        plot = shown[shown.attrs["default"].decode()]
        assert plot.attrs["NX_class"] == b"NXdata"
        assert plot[plot.attrs["signal"].decode()].dims[0][0].name.endswith(plot.attrs["axes"].decode())
        assert all(child.name.split("/")[-1].isidentifier() for child in file.values())


def test_no_flipped_bit_passes_for_a_number(tmp_path: Path, study: StudyResults, are_same: Same) -> None:
    """A file with one wrong bit is refused with a sentence, or the bit lay where it means nothing."""
    path = tmp_path / "results.h5"
    write_results(path, dataclasses.replace(study, outcomes=study.outcomes[:1]))
    content, draw = path.read_bytes(), random.Random(7)  # noqa: S311 - which bits does not matter
    script = tmp_path / "read.py"
    script.write_text(FLIP_READER)
    flips = [draw.randrange(8 * len(content)) for _ in range(60)]
    answer = subprocess.run(
        [sys.executable, script, path, *map(str, flips)], check=True, capture_output=True, text=True
    )
    assert answer.stdout.split() == ["fine"] * 60, answer.stdout
    assert are_same(read_results(path).outcomes[0], study.outcomes[0])


FLIP_READER = """
import sys, os, pathlib
from magbear_cli.errors import MagbearError
from magbear_cli.store.results import read_results
from magbear_cli.store.forms import grow_case, grow_provenance
from magbear_cli.store.tree import content_digest
def digest(path):
    study = read_results(path)
    return [content_digest(branch) for branch in (grow_provenance(study), *map(grow_case, study.outcomes))]
path = pathlib.Path(sys.argv[1])
content = bytearray(path.read_bytes())
wanted = digest(path)
broken = path.with_name("broken.h5")
for place in map(int, sys.argv[2:]):
    content[place // 8] ^= 1 << place % 8
    broken.write_bytes(content)
    content[place // 8] ^= 1 << place % 8
    child = os.fork()  # HDF5 itself may not survive
    if not child:
        code = 2
        try:
            code = 0 if digest(broken) == wanted else 1
        except MagbearError:
            code = 0
        finally:
            os._exit(code)
    status = os.waitpid(child, 0)[1]
    print("silent" if os.WIFEXITED(status) and os.WEXITSTATUS(status) else "fine")
"""


def test_what_is_not_a_results_file_is_named(tmp_path: Path, study: StudyResults) -> None:
    """A missing file, another HDF5 file, another layout and half a file each get their own sentence."""
    path = tmp_path / "results.h5"
    with pytest.raises(InputError, match="no such results file"):
        read_results(path)
    with h5py.File(path, "w") as file:
        file["x"] = 1
    with pytest.raises(InputError, match="not one of magbear"):
        read_results(path)
    write_results(path, study)
    with h5py.File(path, "a") as file:
        file.attrs["layout_version"] = 99
    with pytest.raises(InputError, match="layout 99"):
        read_results(path)
    write_results(path, study)
    path.write_bytes(path.read_bytes()[:5000])
    with pytest.raises(ResumableError, match="cannot be read"):
        read_results(path)


def test_a_changed_number_is_noticed(tmp_path: Path, study: StudyResults) -> None:
    """A number changed by another program no longer matches the digest of its case, which is named."""
    path = tmp_path / "results.h5"
    write_results(path, study)
    with h5py.File(path, "a") as file:
        file["case_0002/summary/worst_case"][...] = 0.1
    with pytest.raises(MagbearError, match="case_0002"):
        read_results(path)

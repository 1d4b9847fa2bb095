"""magbear from Python: the names of the interface, and what each does."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import magbear_cli as magbear
from magbear_cli.lti.frequency import frequency_response

LEAD = {
    "bearing": "thesis_thrust",
    "mass_kg": [3.0, 4.5],
    "performance": {"dc_gain": 10, "corner_rad_s": 200},
    "bandwidth": {"omega_c_rad_s": 20000},
    "controller": {"method": "fixed_order", "order": 1},
}
TINY = {**LEAD, "controller": {"method": "lqg"}, "sweep": {"controller.r": [3e-9, 6e-9]}}


@pytest.fixture(scope="module")
def lead() -> magbear.CaseOutcome:
    """The lead of the quickstart."""
    return magbear.design(LEAD)


def test_importing_costs_nothing() -> None:
    """The package alone loads no numerics; every name that it promises is there and documented."""
    script = "import sys, magbear_cli\nassert 'numpy' not in sys.modules\nassert 'run' in dir(magbear_cli)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for name in set(magbear.__all__) - {"__version__"}:
        assert getattr(magbear, name).__doc__, name
    with pytest.raises(AttributeError, match="no attribute 'dseign'"):
        magbear.dseign  # type: ignore[attr-defined]  # noqa: B018


def test_the_stub_has_the_same_names() -> None:
    """What a type checker sees is what there is."""
    stub = (Path(magbear.__file__).with_suffix(".pyi")).read_text("utf-8")
    named = {line.rpartition(" as ")[2] for line in stub.splitlines() if " as " in line}
    assert named | {"__version__"} == set(magbear.__all__)


def test_one_controller_is_designed(lead: magbear.CaseOutcome) -> None:
    """The lead of the quickstart comes out verified, and of another case of a study likewise."""
    assert lead.status is magbear.Status.OK
    assert lead.summary.verified
    assert lead.summary.worst_case == pytest.approx(0.419, abs=1e-3)
    second = magbear.design(TINY, case=1)
    assert second.inputs["controller"]["r"] == 6e-9


def test_a_study_is_run_like_the_commands(tmp_path: Path) -> None:
    """Both cases are computed, told of and stored; a second run reuses them; a run without a place leaves nothing."""
    told: list[object] = []
    results = magbear.run(TINY, tmp_path / "out", jobs=1, told=told.append)
    assert [outcome.method for outcome in results.outcomes] == ["lqg", "lqg"]
    assert sum(type(event).__name__ == "CaseEnded" for event in told) == 2
    told.clear()
    again = magbear.run(magbear.load_study(TINY), str(tmp_path / "out"), jobs=1, told=told.append)
    assert not told
    read = magbear.read_results(tmp_path / "out")
    assert [outcome.case_id for outcome in read.outcomes] == [outcome.case_id for outcome in again.outcomes]


@pytest.mark.parametrize("most_whole", [1, 2])  # under and at the number of cases
def test_a_run_keeps_every_controller(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, most_whole: int) -> None:
    """However many cases the answer holds with their samples, the results file holds all of each case."""
    monkeypatch.setattr("magbear_cli.store.run_directory.MOST_WHOLE", most_whole)
    results = magbear.run(TINY, tmp_path / "out", jobs=1)
    for outcome in (*results.outcomes, *magbear.read_results(tmp_path / "out").outcomes):
        assert outcome.controller is not None
        assert outcome.frequency is not None
        assert outcome.poles is not None
        assert outcome.statistics


def test_results_open_as_labelled_arrays(tmp_path: Path) -> None:
    """Peak mu read through xarray is what the table says, on axes with units."""
    results = magbear.run(TINY, tmp_path / "out", jobs=1)
    tree = magbear.open_results(tmp_path / "out")
    mu = tree["case_0001/frequency/mu_upper"]
    assert mu.dims == ("omega_rad_s",)
    assert mu.omega_rad_s.attrs["units"] == "rad/s"
    assert float(mu.max()) == pytest.approx(results.outcomes[0].summary.peak_mu, rel=0.05)
    tree.close()


def test_without_xarray_there_is_a_remedy(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Where it is not installed the sentence says how to install it."""
    monkeypatch.setitem(sys.modules, "h5netcdf", None)
    with pytest.raises(magbear.InputError, match="pip install xarray h5netcdf"):
        magbear.open_results(tmp_path)


def test_one_limit_is_bracketed() -> None:
    """For one mass of 3.0 kg the two proofs enclose 4 330 to 4 367 rad/s."""
    base = {**LEAD, "controller": {"method": "limit"}}  # whose bandwidth and controller do not matter
    found = magbear.limit(3.0, base, tolerance=0.03, overrides=["controller.max_order=5"]).summary
    assert found.omega_c_infeasible_rad_s is not None
    assert found.omega_c_feasible_rad_s is not None
    assert found.omega_c_infeasible_rad_s < 4367.1
    assert found.omega_c_feasible_rad_s > 4327.7
    assert found.omega_c_feasible_rad_s < 1.04 * found.omega_c_infeasible_rad_s
    with pytest.raises(magbear.InputError, match="a pair"):
        magbear.limit((1.0, 2.0, 3.0))


def test_a_controller_goes_on_to_python_control(lead: magbear.CaseOutcome) -> None:
    """As an object it responds as the controller does, in continuous time and sampled."""
    import control

    assert lead.controller is not None
    omega = np.array([10.0, 1e3, 1e5])
    expected = frequency_response(lead.controller, omega)[:, 0, 0]
    response = control.frequency_response(magbear.to_control(lead), omega).complex
    np.testing.assert_allclose(response, expected, rtol=1e-9)
    sampled = magbear.sample(lead, 2e-5, delay_s=1e-5, prewarp_rad_s=1e4)
    assert sampled.is_accepted
    system = magbear.to_control(sampled)
    assert system.dt == 2e-5
    exact = control.frequency_response(system, np.array([1e4])).complex
    np.testing.assert_allclose(exact, frequency_response(lead.controller, [1e4])[:, 0, 0], rtol=1e-9)


def test_mistakes_are_those_of_the_command() -> None:
    """A mapping with a wrong key is refused with the key that was meant."""
    with pytest.raises(magbear.StudyError, match="did you mean 'mass_kg'"):
        magbear.load_study({**LEAD, "mass_kgs": 3.0})
    assert magbear.load_study(LEAD, ["bandwidth.omega_c_rad_s=15000"]).case(0)["bandwidth"]["omega_c_rad_s"] == 15000

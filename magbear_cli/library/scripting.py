"""The functions behind ``import magbear_cli``: run a study, read results, design a controller, find a limit."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from magbear_cli.errors import InputError, NumericsError
from magbear_cli.library.ending import end_run
from magbear_cli.library.planning import planned_cases
from magbear_cli.library.stored import results_file
from magbear_cli.spec import Study, compile_limits, read_study, read_study_text
from magbear_cli.store.results import read_results as read_results_file
from magbear_cli.store.run_directory import RunDirectory
from magbear_cli.study.events import CaseEnded, Event
from magbear_cli.study.outcome import CaseOutcome, StudyResults
from magbear_cli.study.pipeline import run_case
from magbear_cli.study.runner import RunnerOptions, available_cores, run_cases
from magbear_cli.study.sampling import SampledDesign, SamplingOptions, sample_design

StudyLike = Study | Mapping[str, Any] | Path | str


def load_study(source: StudyLike, overrides: Sequence[str] = ()) -> Study:
    """The study of a file, or of a mapping with the keys of one.

    Parameters
    ----------
    source : the path of a study file, or a mapping; ``magbear`` and ``name`` of a mapping may be left out
    overrides : ``KEY=VALUE`` each, as for ``--set``

    Raises
    ------
    magbear_cli.StudyError
        with everything that is wrong with it.
    """
    return _read(source, overrides, for_limits=False)


def _read(source: StudyLike, overrides: Sequence[str], *, for_limits: bool) -> Study:
    """The study, or with ``for_limits`` what a limit looks at of it."""
    if isinstance(source, Study):
        return source if not overrides else read_study_text(source.text, source.source, overrides, source.folder)
    if isinstance(source, Mapping):
        text = json.dumps({"magbear": 1, "name": "study", **source}, indent=1, default=_plain)
        return read_study_text(text, "the mapping", overrides, Path.cwd(), for_limits=for_limits)
    return read_study(source, overrides, for_limits=for_limits)


def run(
    study: StudyLike,
    output: Path | str | None = None,
    *,
    jobs: int | None = None,
    told: Callable[[Event], None] | None = None,
    must_lock: bool = True,
) -> StudyResults:
    """Compute all cases of a study that are not stored yet, and answer its results, whole as the results file has them.

    Parameters
    ----------
    study : a study, a path or a mapping
    output : directory of the run, kept like that of ``magbear run``; None for a temporary one that is removed
    jobs : worker processes; None for one a usable core
    told : called with each event of the run
    must_lock : False to run also where the file system cannot lock; the caller then keeps other runs out

    Raises
    ------
    magbear_cli.MagbearError
        when the study or the directory does not allow it; what was finished is stored.
    """
    if output is None:
        scratch = tempfile.mkdtemp(prefix="magbear-")
        try:
            return run(study, scratch, jobs=jobs, told=told, must_lock=must_lock)
        finally:
            shutil.rmtree(scratch, ignore_errors=True)
    asked = load_study(study)
    cases = planned_cases(asked)
    options = RunnerOptions(
        jobs=available_cores() if jobs is None else jobs,
        timeout_s=asked.run.timeout_s,
        memory_bytes=int(asked.run.memory_gib * (1 << 30)),
    )
    with RunDirectory(Path(output), asked.text, must_lock=must_lock) as directory:
        missing = directory.missing(cases)
        directory.reserve(len(missing))
        for event in run_cases(missing, options):
            if isinstance(event, CaseEnded):
                directory.keep(event.outcome)
            if told is not None:
                told(event)
        end_run(asked, cases, directory)
        return read_results_file(directory.results_path)


def read_results(path: Path | str) -> StudyResults:
    """The results of a run: of a ``results.h5``, or of the directory that holds it.

    Raises
    ------
    magbear_cli.MagbearError
        when there are none, or they are damaged.
    """
    return read_results_file(results_file(Path(path)))


def open_results(path: Path | str) -> Any:  # noqa: ANN401 - an xarray.DataTree; xarray is optional
    """The results file as a tree of labelled arrays, e.g. ``tree["case_0001/frequency/mu_upper"]``; needs xarray.

    Raises
    ------
    magbear_cli.InputError
        when xarray or h5netcdf is not installed.
    """
    try:
        import h5netcdf  # noqa: F401 - the engine, looked for here so that its absence gets a sentence
        import xarray
    except ImportError as error:
        raise InputError(f"{error.name} is not installed: pip install xarray h5netcdf") from error
    return xarray.open_datatree(results_file(Path(path)), engine="h5netcdf")


def design(study: StudyLike, case: int = 0) -> CaseOutcome:
    """One case computed in this process: its controller, judged and verified, with all its figures.

    Parameters
    ----------
    study : a study, a path or a mapping
    case : its place in the study, from 0
    """
    chosen = planned_cases(load_study(study))[case]
    return run_case(chosen.inputs, chosen.id, chosen.index)


def limit(
    mass_kg: float | Sequence[float],
    study: StudyLike | None = None,
    *,
    tolerance: float = 0.01,
    overrides: Sequence[str] = (),
) -> CaseOutcome:
    """The smallest bandwidth limit that linear control can meet for a mass or a range of masses.

    Parameters
    ----------
    mass_kg : a mass, or (low, high)
    study : gives bearing and weights, the rest of it does not matter; None for the thesis's thrust bearing
    tolerance : relative width of the bracket
    overrides : ``KEY=VALUE`` each, as for ``--set``

    Returns
    -------
    outcome : ``summary.omega_c_infeasible_rad_s`` is proven impossible, ``summary.omega_c_feasible_rad_s`` is proven to
        be met by ``controller``
    """
    if isinstance(mass_kg, int | float):
        asked: float | tuple[float, float] = float(mass_kg)
    elif len(mass_kg) == 2:
        asked = (float(mass_kg[0]), float(mass_kg[1]))
    else:
        raise InputError(f"mass_kg is a number or a pair (low, high), not {mass_kg}")
    base = None if study is None else _read(study, (), for_limits=True)
    text = compile_limits(
        [asked], [], tolerance, None if base is None else base.text, None if base is None else base.folder
    )
    return design(read_study_text(text, "the limit", overrides))


def sample(
    outcome: CaseOutcome, sample_time_s: float, *, delay_s: float | None = None, prewarp_rad_s: float = 0.0
) -> SampledDesign:
    """The controller of a case, sampled by Tustin's rule, its loop judged anew: see ``is_accepted`` and ``sentence``.

    Parameters
    ----------
    delay_s : from taking a sample to applying the current; None for one sample time
    prewarp_rad_s : where the sampled response is exact; 0 for nowhere
    """
    return sample_design(outcome, SamplingOptions(sample_time_s, delay_s, prewarp_rad_s))


def to_control(controller: CaseOutcome | SampledDesign) -> Any:  # noqa: ANN401 - a control.StateSpace; python-control has no types
    """The controller as an object of python-control: u = K y, position in m, current in A.

    Raises
    ------
    magbear_cli.NumericsError
        when the case has no linear controller.
    """
    from magbear_cli.kernels.python_control import control_system

    if isinstance(controller, SampledDesign):
        own = controller.controller.shifted
        return control_system((own.a, own.b, own.c, own.d), controller.sampling.sample_time_s)
    if controller.controller is None:
        raise NumericsError(f"case {controller.case_id} has no linear controller")
    own = controller.controller
    return control_system((own.a, own.b, own.c, own.d))


def _plain(value: object) -> object:
    """A value of numpy or a path as JSON knows it."""
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{value!r} has no place in a study")

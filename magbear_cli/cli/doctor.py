"""``magbear doctor``: whether this machine is fit."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import click

from magbear_cli.cli.options import as_json
from magbear_cli.errors import ExitCode

LEAST_FREE_MB = 500
REINSTALL = "install magbear anew into an empty virtual environment"


class Finding(NamedTuple):
    """One thing that was looked at; ``remedy`` is empty when it is fine."""

    name: str
    is_fine: bool
    says: str
    remedy: str


class Look(NamedTuple):
    """How to look at one thing: it is said in words whether it is fine, and what to do when it is not."""

    see: Callable[[], tuple[bool, str]]
    remedy: str


@click.command()
@as_json
def doctor(*, as_json: bool) -> int:
    """Look whether this machine is fit; exit 1 if not.

    Libraries, a problem solved with each kernel, BLAS threads, cores, disk, locks and the place for fonts: each with
    what to do about it.

    \b
    Example:  magbear doctor
    """
    from magbear_cli.cli.output import put, put_json

    findings = [_finding(name, look) for name, look in LOOKS.items()]
    is_fit = all(finding.is_fine for finding in findings)
    if as_json:
        put_json({"fit": is_fit, "findings": [finding._asdict() for finding in findings]})
    else:
        for finding in findings:
            put(f"{'ok ' if finding.is_fine else 'BAD'}  {finding.name:<11} {finding.says}")
            if finding.remedy:
                put(f"{'':16} {finding.remedy}")
    return ExitCode.DONE if is_fit else ExitCode.DIFFERENCE


def _finding(name: str, look: Look) -> Finding:
    try:
        is_fine, says = look.see()
    except Exception as error:  # noqa: BLE001 - a broken library is a finding, not a crash
        is_fine, says = False, " ".join(f"{type(error).__name__}: {error}".split())
    return Finding(name, is_fine, says, "" if is_fine else look.remedy)


def _python() -> tuple[bool, str]:
    import platform

    return True, f"{platform.python_version()} on {platform.platform()}"


def _libraries() -> tuple[bool, str]:
    from importlib.metadata import version

    names = ("magbear", "numpy", "scipy", "slycot", "clarabel", "h5py", "matplotlib", "click", "pydantic", "rich")
    return True, ", ".join(f"{name} {version(name)}" for name in names)


def _slicot() -> tuple[bool, str]:
    import numpy as np

    from magbear_cli.kernels.hinf import hinf_controller

    a = np.diag([1.0, -1.0, -2.0])
    b = np.array([[1.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0]])
    c = np.array([[1.0, 1.0, 1.0], [0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    d = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    answer = hinf_controller(a, b, c, d, measurements=1, controls=1, gamma=100.0)
    return answer.is_solved, "solves an H-infinity problem" if answer.is_solved else answer.sentence


def _clarabel() -> tuple[bool, str]:
    import numpy as np

    from magbear_cli.kernels.conic import Cone, solve_cone_program

    answer = solve_cone_program(np.array([1.0]), np.array([[-1.0]]), np.array([-2.0]), [(Cone.NONNEGATIVE, 1)])
    is_right = answer.is_solved and abs(answer.objective - 2.0) < 1e-6
    return is_right, "solves a cone program" if is_right else f"finds {answer.objective} where 2 is right"


def _blas() -> tuple[bool, str]:
    from pathlib import PurePath

    import numpy as np
    import scipy.linalg
    from threadpoolctl import threadpool_info

    scipy.linalg.inv(np.eye(2))
    pools = [
        f"{PurePath(pool['filepath']).parent.name.removesuffix('.libs')}: {pool['internal_api']} {pool['version']} "
        f"{pool.get('architecture', '')}, threads here {pool['num_threads']}"
        for pool in threadpool_info()
    ]
    return True, "; ".join(pools) + "; one thread in each worker"


def _cores() -> tuple[bool, str]:
    from magbear_cli.study.runner import available_cores

    return True, f"{available_cores()} usable; --jobs begins with that"


def _disk() -> tuple[bool, str]:
    import shutil

    free = shutil.disk_usage(".").free / 1e6
    return free >= LEAST_FREE_MB, f"{free:.0f} MB free here"


def _locks() -> tuple[bool, str]:
    import fcntl
    import tempfile

    with tempfile.TemporaryFile(dir=".") as file:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    return True, "files can be made and locked here"


def _fonts() -> tuple[bool, str]:
    import os

    from magbear_cli.report.matplotlib_home import settle_matplotlib_home

    own = os.environ.get("MPLCONFIGDIR")
    settle_matplotlib_home()
    place = os.environ.get("MPLCONFIGDIR")
    if place is None:
        return True, "its font cache can be kept"
    if own is None:
        return True, "no place for its font cache: each report is slower; set MPLCONFIGDIR to a writable directory"
    return os.access(place, os.W_OK) or not os.path.exists(place), f"its font cache is kept in {place}"  # noqa: PTH110


LOOKS = {
    "Python": Look(_python, ""),
    "libraries": Look(_libraries, REINSTALL),
    "SLICOT": Look(_slicot, f"hinf will not work: {REINSTALL}"),
    "Clarabel": Look(_clarabel, f"mu_convex will not work: {REINSTALL}"),
    "BLAS": Look(_blas, REINSTALL),
    "cores": Look(_cores, ""),
    "disk": Look(_disk, "make room, or run with -o on another disk"),
    "locks": Look(_locks, "run in a directory that may be written, or with -o on a file system that can lock"),
    "matplotlib": Look(_fonts, "set MPLCONFIGDIR to a directory that may be written, or unset it"),
}

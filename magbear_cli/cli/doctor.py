"""``magbear doctor``: whether this machine is fit."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import click

from magbear_cli.cli.options import as_json
from magbear_cli.errors import ExitCode

LEAST_FREE_MB = 500


class Finding(NamedTuple):
    """One thing that was looked at."""

    name: str
    is_fine: bool
    says: str


@click.command()
@as_json
def doctor(*, as_json: bool) -> int:
    """Look at this machine: libraries, a solve with each kernel, BLAS threads, cores, disk, locks; exit 1 if unfit.

    \b
    Example:  magbear doctor
    """
    findings = [_looked_at(name, look) for name, look in LOOKS.items()]
    if as_json:
        import json

        click.echo(
            json.dumps({"fit": all(f.is_fine for f in findings), "findings": [f._asdict() for f in findings]}, indent=2)
        )
    else:
        for finding in findings:
            click.echo(f"{'ok ' if finding.is_fine else 'BAD'}  {finding.name:<14} {finding.says}")
    return ExitCode.DONE if all(finding.is_fine for finding in findings) else ExitCode.DIFFERENCE


def _looked_at(name: str, look: Callable[[], tuple[bool, str]]) -> Finding:
    try:
        return Finding(name, *look())
    except Exception as error:  # noqa: BLE001 - a broken library is a finding, not a crash
        return Finding(name, is_fine=False, says=f"{type(error).__name__}: {error}")


def _versions() -> tuple[bool, str]:
    from importlib.metadata import version

    names = ("magbear", "numpy", "scipy", "slycot", "clarabel", "h5py", "matplotlib")
    return True, ", ".join(f"{name} {version(name)}" for name in names)


def _slicot() -> tuple[bool, str]:
    import numpy as np

    from magbear_cli.kernels.hinf import hinf_controller

    a = np.diag([1.0, -1.0, -2.0])
    b, c = (
        np.array([[1.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0]]),
        np.array([[1.0, 1.0, 1.0], [0, 0, 0], [1, 1, 1]]),
    )
    d = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    answer = hinf_controller(a, b, c, d, measurements=1, controls=1, gamma=100.0)
    return answer.is_solved, "an H-infinity problem was solved" if answer.is_solved else answer.sentence


def _clarabel() -> tuple[bool, str]:
    import numpy as np

    from magbear_cli.kernels.conic import Cone, solve_cone_program

    answer = solve_cone_program(np.array([1.0]), np.array([[-1.0]]), np.array([-2.0]), [(Cone.NONNEGATIVE, 1)])
    right = answer.is_solved and abs(answer.objective - 2.0) < 1e-6
    return right, "a cone program was solved" if right else f"a cone program gave {answer.objective} in place of 2"


def _blas() -> tuple[bool, str]:
    import numpy as np
    import scipy.linalg
    from threadpoolctl import threadpool_info

    scipy.linalg.inv(np.eye(2))
    pools = [f"{pool['internal_api']} {pool.get('architecture') or ''}".strip() for pool in threadpool_info()]
    return True, ", ".join(pools) + "; workers run each with one thread"


def _cores() -> tuple[bool, str]:
    from magbear_cli.study.runner import available_cores

    return True, f"{available_cores()} usable"


def _disk() -> tuple[bool, str]:
    import shutil

    free = shutil.disk_usage(".").free / 1e6
    return free >= LEAST_FREE_MB, f"{free:.0f} MB free here" + ("" if free >= LEAST_FREE_MB else ": make room")


def _locks() -> tuple[bool, str]:
    import fcntl
    import tempfile

    with tempfile.TemporaryFile(dir=".") as file:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    return True, "files can be made and locked here"


def _fonts() -> tuple[bool, str]:
    from magbear_cli.report.matplotlib_home import settle_matplotlib_home

    settle_matplotlib_home()
    return True, "a place for its font cache was found"


LOOKS: dict[str, Callable[[], tuple[bool, str]]] = {
    "libraries": _versions,
    "SLICOT": _slicot,
    "Clarabel": _clarabel,
    "BLAS": _blas,
    "cores": _cores,
    "disk": _disk,
    "locks": _locks,
    "matplotlib": _fonts,
}

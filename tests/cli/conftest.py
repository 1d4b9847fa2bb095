"""Shared by the tests of the command: the command in this process, the command as a process, and a small run."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import pytest

from magbear_cli.cli.main import main

TINY = """\
magbear: 1
name: tiny
bearing: thesis_thrust
mass_kg: 3.6
performance: {dc_gain: 10, corner_rad_s: 200}
bandwidth: {omega_c_rad_s: 20000}
controller: {method: lqg}
simulate: [{step_m: 10.0e-6, masses_kg: [3.6], samples: 11}]
report: {figures: [controller_gain]}
sweep: {controller.r: [3.0e-9, 6.0e-9]}
"""


@dataclass(frozen=True)
class Ended:
    """What a command left behind."""

    code: int
    out: str
    err: str


Command = Callable[..., Ended]


@pytest.fixture
def command(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Command]:
    """The command line in this process, in an empty directory."""
    monkeypatch.chdir(tmp_path)
    before = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGHUP)}

    def run(*arguments: object) -> Ended:
        capfd.readouterr()
        with pytest.raises(SystemExit) as end:
            main([str(argument) for argument in arguments])
        out, err = capfd.readouterr()
        assert isinstance(end.value.code, int)
        return Ended(end.value.code, out, err)

    yield run
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def quick_report(monkeypatch: pytest.MonkeyPatch) -> None:
    """An empty page in place of the drawn one, where a test asks something else."""

    def write_report(_results: object, directory: Path, **_: object) -> Path:
        directory.mkdir(parents=True, exist_ok=True)
        (directory / "index.html").touch()
        return directory / "index.html"

    monkeypatch.setattr("magbear_cli.report.writing.write_report", write_report)


@pytest.fixture
def process(tmp_path: Path) -> Callable[..., Ended]:
    """The command line as a process of its own, in an empty directory, with variables changed or (None) removed."""

    def run(*arguments: object, changed: Mapping[str, str | None] | None = None, through: str = "") -> Ended:
        environment = {**os.environ, **{key: value for key, value in (changed or {}).items() if value is not None}}
        for key, value in (changed or {}).items():
            if value is None:
                environment.pop(key, None)
        line = [sys.executable, "-m", "magbear_cli", *(str(argument) for argument in arguments)]
        if through:
            line = ["bash", "-c", f'set -o pipefail; "$@" {through}', "bash", *line]
        done = subprocess.run(
            line, cwd=tmp_path, env=environment, capture_output=True, encoding="utf-8", timeout=120, check=False
        )
        return Ended(done.returncode, done.stdout, done.stderr)

    return run


@pytest.fixture
def tiny(tmp_path: Path) -> Path:
    """A study file of two cases that take no time."""
    path = tmp_path / "tiny.yaml"
    path.write_text(TINY, "utf-8")
    return path


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of a run of that study."""
    folder = tmp_path_factory.mktemp("finished")
    (folder / "tiny.yaml").write_text(TINY, "utf-8")
    line = [sys.executable, "-m", "magbear_cli", "run", "tiny.yaml", "-o", "done", "--json"]
    done = subprocess.run(line, cwd=folder, capture_output=True, encoding="utf-8", timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    (folder / "done.json").write_text(done.stdout, "utf-8")
    return folder / "done"

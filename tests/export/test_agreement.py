"""Python, Octave and compiled C answer the same, and the sampled loop behind them is proven."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from magbear_cli.export.handover import Handover
from magbear_cli.export.writing import write_export

DOUBLE, SINGLE = 1e-12, 1e-4  # of the largest current
STRICT = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-Wconversion", "-Wshadow", "-O2"]


def _tool(name: str) -> str:
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"{name} is not installed")
    return found


def _output(line: list[str], folder: Path) -> str:
    done = subprocess.run(line, cwd=folder, capture_output=True, encoding="utf-8", timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_sampled_loops_of_the_three_best_are_proven(sampled: list[Handover]) -> None:
    """Each holds the specification for every mass, within 28 % of its worst case in continuous time."""
    for handover in sampled:
        design = handover.sampled
        assert design is not None
        assert design.is_accepted
        assert design.proof is not None
        had = handover.outcome.summary.worst_case
        assert had is not None
        assert had < design.proof.level < 1.28 * had


def test_compiled_c_answers_as_python_does(sampled: list[Handover], tmp_path: Path) -> None:
    """Without a warning; in doubles within 1e-12 of the largest current, in single precision within 1e-4."""
    compiler = _tool("gcc")
    for handover in sampled:
        write_export(handover, "c", tmp_path)
        _output([compiler, *STRICT, f"{handover.name}_test.c", "-o", "check"], tmp_path)
        told = dict(line.split() for line in _output(["./check"], tmp_path).splitlines())
        assert float(told["double"]) <= DOUBLE
        assert float(told["float"]) <= SINGLE


def test_the_test_program_notices_a_wrong_coefficient(sampled: list[Handover], tmp_path: Path) -> None:
    """A header with its direct gains changed in the sixth digit does not pass its own test."""
    compiler, handover = _tool("gcc"), sampled[1]
    header, program = write_export(handover, "c", tmp_path)
    assert handover.sampled is not None
    direct = repr(float(handover.sampled.controller.sections[0].d[0, 0]))
    text = header.read_text("ascii")
    assert f"    {direct}\n" in text
    header.write_text(text.replace(f"    {direct}\n", f"    {float(direct) * 1.00001!r}\n"), "ascii")
    _output([compiler, *STRICT, program.name, "-o", "check"], tmp_path)
    assert subprocess.run(["./check"], cwd=tmp_path, capture_output=True, check=False).returncode == 1


SATURATION = """\
#include <stdio.h>
static double seen;
#define {upper}_ANTI_WINDUP(y, u, limited) (seen = {hook})
#include "{name}.h"
int main(void)
{{
  {name} k, free_running;
  {name}_reset(&k, 5.0);
  {name}_reset(&free_running, 0.0);
  for (int i = 0; i < 400; ++i) {{
    const double y = i < 200 ? 2e-5 : -1e-6;
    seen = y;
    const double limited = {name}_step(&k, y);
    printf("%.17g %.17g\\n", limited, {name}_step(&free_running, seen));
  }}
  return 0;
}}
"""
HOOKS = {
    "conditioned": "(y) + ((limited) - (u)) / {upper}_DIRECT_GAIN",  # what the header itself says
    "none": "((void)(u), (void)(limited), (y))",
}


@pytest.mark.parametrize("kind", list(HOOKS))
def test_the_limit_acts_and_the_hook_drives_the_states(sampled: list[Handover], tmp_path: Path, kind: str) -> None:
    """With conditioning the limited current is that of a free controller on what the hook gave: no state winds up.

    With a hook that gives the position back, the limited current is that of a free controller, cut off.
    """
    compiler, handover = _tool("gcc"), sampled[0]
    header, _ = write_export(handover, "c", tmp_path)
    name = {"name": handover.name, "upper": handover.name.upper()}
    assert f"ANTI_WINDUP(y, u, limited) ({HOOKS['conditioned'].format(**name)})" in header.read_text("ascii")
    (tmp_path / "run.c").write_text(SATURATION.format(**name, hook=HOOKS[kind].format(**name)), "ascii")
    _output([compiler, *STRICT, "run.c", "-o", "run"], tmp_path)
    rows = np.array([line.split() for line in _output(["./run"], tmp_path).splitlines()], dtype=float)
    limited, free = rows.T
    assert np.abs(limited).max() == 5.0
    assert (np.abs(limited) == 5.0).sum() > 20
    expected = free if kind == "conditioned" else np.clip(free, -5.0, 5.0)
    np.testing.assert_allclose(limited, expected, atol=1e-9)


OCTAVE = """\
for i = 0:2
  name = sprintf('quickstart_%d.mat', i);
  s = load(name);
  u = magbear_simulate(name, s.test_positions_m);
  K = magbear_controller(name);
  f = s.test_positions_m;
  for j = 1:rows(s.sos)
    f = filter(s.sos(j, 1:3), s.sos(j, 4:6), f);
  end
  scale = max(abs(s.test_currents_a));
  printf('%.17g %.17g %.17g\\n', max(abs(u - s.test_currents_a))/scale, max(abs(f - s.test_currents_a))/scale, K.Ts);
end
"""


def test_octave_answers_as_python_does(sampled: list[Handover], tmp_path: Path) -> None:
    """The loaders give what Python gives to 1e-12, and Octave's own filter on the sections does so too."""
    octave = _tool("octave-cli")
    for handover in sampled:
        write_export(handover, "mat", tmp_path)
    (tmp_path / "agreement.m").write_text(OCTAVE, "ascii")
    for line in _output([octave, "--no-gui", "--quiet", "agreement.m"], tmp_path).splitlines():
        recursion, sections, time = (float(value) for value in line.split())
        assert recursion <= DOUBLE
        assert sections <= DOUBLE
        assert time == 2e-5


def test_python_control_answers_as_the_recursion_does(
    sampled: list[Handover], run_script: Callable[[Path], dict[str, object]], tmp_path: Path
) -> None:
    """The script's object of python-control, forced by the test's positions, gives the test's currents to 1e-11."""
    import control

    for handover in sampled:
        (path,) = write_export(handover, "python", tmp_path)
        system = run_script(path)["controller"]
        times = np.arange(handover.test_positions_m.size) * 2e-5
        answer = control.forced_response(system, times, handover.test_positions_m).outputs
        error = np.abs(answer - handover.test_currents_a).max()
        assert error <= 1e-11 * np.abs(handover.test_currents_a).max()

"""One study, computed in every way there is: the results and every file of the report must be the same bytes.

The real command on the real pipeline: one, two and three workers; in parts, merged; on a Dask cluster of which a
machine is killed; killed at a random instant and gone on with; stopped by Ctrl-C and gone on with; with another hash
seed, locale and time zone. Needs the extra dask.

    python tests/campaigns/identical.py
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path

STUDY = """\
magbear: 1
name: identical
bearing: thesis_thrust
mass_kg: [3.0, 4.5]
performance: {dc_gain: 10, corner_rad_s: 200}
bandwidth: {omega_c_rad_s: 20000}
controller: {method: lqg}
simulate: [{step_m: 10.0e-6, masses_kg: [3.6]}]
sweep:
  controller:
    - {method: lqg}
    - {method: mu_convex, max_order: 4}
    - {method: fixed_order}
    - {method: hinf}
  bandwidth.omega_c_rad_s: [10000, 20000, 4000]
report: {figures: [limitation, step]}
"""
VOLATILE = {"log.jsonl", ".lock"}


class Ways:
    """Directories of runs of the study, compared with the first."""

    def __init__(self, folder: Path) -> None:
        """Nothing is run yet."""
        self.folder = folder
        (folder / "study.yaml").write_text(STUDY, "utf-8")
        self.first: dict[str, str] = {}
        self.bad = 0

    def magbear(self, *arguments: str, changed: Mapping[str, str] | None = None) -> subprocess.Popen[str]:
        """Start the command."""
        line = [sys.executable, "-m", "magbear_cli", *arguments]
        environment = {**os.environ, **(changed or {})}
        return subprocess.Popen(
            line, cwd=self.folder, text=True, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )

    def whole(self, name: str, *arguments: str, changed: Mapping[str, str] | None = None) -> None:
        """Run to the end, and compare."""
        run = self.magbear("run", "study.yaml", "-o", name, *arguments, changed=changed)
        said, _ = run.communicate()
        self.compare(name, run.returncode, said)

    def compare(self, name: str, code: int, said: str) -> None:
        """Say whether a directory has the bytes of the first."""
        there = self.folder / name
        found = {
            str(path.relative_to(there)): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in sorted(there.rglob("*"))
            if path.is_file() and path.name not in VOLATILE
        }
        self.first = self.first or found
        same = found == self.first and code == 0
        self.bad += not same
        print(f"{name:28s} {len(found)} files, {'the same' if same else f'DIFFERENT, exit code {code}: {said[-600:]}'}")
        if found != self.first:
            changed = sorted(set(found.items()) ^ set(self.first.items()))
            print(f"    {sorted({file for file, _ in changed})[:8]}")
        sys.stdout.flush()

    def broken_off(self, name: str, number: signal.Signals, after: int) -> None:
        """Send a signal to the whole group when so many cases have ended, then go on."""
        line = [sys.executable, "-m", "magbear_cli", "run", "study.yaml", "-o", name, "-j", "2"]
        run = subprocess.Popen(line, cwd=self.folder, stderr=subprocess.DEVNULL, start_new_session=True)
        self._wait_for(name, after)
        os.killpg(run.pid, number)
        run.wait()
        self.whole(name, "-j", "2")

    def in_parts(self, name: str, parts: int) -> None:
        """Compute parts and merge them."""
        for part in range(parts):
            self.magbear("run", "study.yaml", "--shard", f"{part}/{parts}", "-o", f"part{part}").communicate()
        merge = self.magbear("merge", *(f"part{part}" for part in range(parts)), "-o", name)
        said, _ = merge.communicate()
        self.compare(name, merge.returncode, said)

    def on_a_cluster(self, name: str) -> None:
        """Use a scheduler with two workers here, and kill one of them when three cases have ended."""
        file = self.folder / "scheduler.json"

        def begin(program: str, *more: str) -> subprocess.Popen[bytes]:
            line = [sys.executable, "-m", f"distributed.cli.{program}", "--scheduler-file", str(file)]
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            return subprocess.Popen([*line, "--no-dashboard", *more], cwd=self.folder, **quiet)  # type: ignore[call-overload, no-any-return]

        scheduler = begin("dask_scheduler", "--host", "127.0.0.1", "--port", "0")
        while not file.exists() or not file.read_text("utf-8"):
            time.sleep(0.1)
        machines = [begin("dask_worker", "--nthreads", "1", "--no-nanny") for _ in range(2)]
        address = json.loads(file.read_text("utf-8"))["address"]
        run = self.magbear("run", "study.yaml", "-o", name, "--executor", "dask", "--scheduler", address)
        self._wait_for(name, 3)
        machines[0].kill()
        said, _ = run.communicate()
        self.compare(name, run.returncode, said)
        for process in (*machines, scheduler):
            process.kill()
            process.wait()

    def _wait_for(self, name: str, ended: int) -> None:
        log = self.folder / name / "log.jsonl"
        until = time.monotonic() + 300
        while time.monotonic() < until:
            if log.exists() and log.read_text("utf-8").count('"case ended"') >= ended:
                return
            time.sleep(0.02)
        raise SystemExit(f"{name}: {ended} cases did not end in time")


def main() -> int:
    """Compute the study in every way and compare; 1 if a byte differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    draw = random.Random(asked.seed)  # noqa: S311 - when does not matter
    ways = Ways(Path(tempfile.mkdtemp(prefix="magbear-identical-")))
    for jobs in (1, 2, 3):
        ways.whole(f"jobs-{jobs}", "-j", str(jobs))
    ways.in_parts("parts-merged", 3)
    ways.on_a_cluster("dask-with-a-killed-worker")
    ways.broken_off("killed-and-resumed", signal.SIGKILL, draw.randint(1, 8))
    ways.broken_off("interrupted-and-resumed", signal.SIGINT, draw.randint(1, 8))
    odd = {"PYTHONHASHSEED": "7", "LC_ALL": "C", "TZ": "Asia/Kolkata", "OPENBLAS_NUM_THREADS": "4"}
    ways.whole("other-surroundings", "-j", "2", changed=odd)
    print(f"ways that gave other bytes: {ways.bad}")
    shutil.rmtree(ways.folder)
    return int(bool(ways.bad))


if __name__ == "__main__":
    sys.exit(main())

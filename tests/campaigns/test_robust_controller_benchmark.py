"""The benchmark against a peer, in short: its own side runs, and what it says of a controller is true."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

BENCHMARK = Path(__file__).parent.parent / "benchmarks" / "robust_controller.py"


def test_the_quickest_route_is_sampled_and_judged(tmp_path: Path) -> None:
    """A lead of one state is found and verified at a peak of mu of at most 0.53, and the raw sample is stored."""
    file = tmp_path / "samples.json"
    command = [sys.executable, str(BENCHMARK), "--repeats", "1", "--routes", "fixed_order 1", "-o", str(file)]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "| fixed_order 1 | 1 | 0.5" in done.stdout
    (sample,) = json.loads(file.read_text("utf-8"))["samples"]
    assert sample["verified"]
    assert sample["order"] == 1
    assert sample["peak_mu"] <= 0.53
    assert abs(sample["claimed"] - sample["peak_mu"]) < 1e-3

"""The campaign on both proofs, in short: one problem with an uncertain mass, one with an uncertain stiffness."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

CAMPAIGN = Path(__file__).with_name("two_sides.py")


def test_the_two_proofs_do_not_contradict_each_other() -> None:
    """Both sides are proven, close to each other, and a direct search does not get below what is impossible."""
    command = [sys.executable, str(CAMPAIGN), "--problems", "2", "--seed", "3"]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "contradictions: 0" in done.stdout
    assert "both sides proven: 2 of 2" in done.stdout

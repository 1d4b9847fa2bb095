"""The campaign on the brackets of limits, in short: one problem of each kind of W1."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

CAMPAIGN = Path(__file__).with_name("limits.py")


def test_brackets_are_narrow_and_sound() -> None:
    """Every bracket is within 1 %, no proof contradicts another, and the met sides lie near the best design."""
    command = [sys.executable, str(CAMPAIGN), "--problems", "5", "--seed", "2"]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "brackets within 1%: 5 of 5; met sides within 0.5%: 5" in done.stdout
    assert "unsound proofs: 0" in done.stdout

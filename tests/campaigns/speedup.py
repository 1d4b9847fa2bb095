"""How much faster two workers are than one, on the study of section 3.5 widened to forty cases, measured in one run.

python tests/campaigns/speedup.py
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

STUDY = Path(__file__).parents[2] / "studies" / "wc_sweep.yaml"
WIDER = (
    "sweep={mass_kg: [[3.0, 3.5], [3.0, 4.0], [3.0, 4.5], [3.0, 5.0]], bandwidth.omega_c_rad_s: "
    "[7000, 8000, 9000, 10000, 12500, 15000, 17500, 20000, 25000, 30000]}"
)


def timed(folder: Path, jobs: int) -> tuple[float, float]:
    """Seconds of the whole command, and of it those in which cases were computed."""
    line = [sys.executable, "-m", "magbear_cli", "run", str(STUDY), "--set", WIDER, "-o", str(jobs), "-j", str(jobs)]
    began = time.monotonic()
    subprocess.run(line, cwd=folder, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    whole_s = time.monotonic() - began
    events = [json.loads(text) for text in (folder / str(jobs) / "log.jsonl").read_text("utf-8").splitlines()]
    return whole_s, events[-1]["time"] - events[0]["time"]


def main() -> int:
    """Measure once each way and tell the quotients."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    folder = Path(tempfile.mkdtemp(prefix="magbear-speedup-"))
    one, two = timed(folder, 1), timed(folder, 2)
    same = (folder / "1" / "results.h5").read_bytes() == (folder / "2" / "results.h5").read_bytes()
    print(f"one worker:  {one[0]:.1f} s, {one[1]:.1f} s of it computing")
    print(f"two workers: {two[0]:.1f} s, {two[1]:.1f} s of it computing")
    print(f"computing {one[1] / two[1]:.2f} times as fast, the whole command {one[0] / two[0]:.2f} times")
    print(f"results: {'the same bytes' if same else 'DIFFERENT'}")
    shutil.rmtree(folder)
    return int(not same)


if __name__ == "__main__":
    sys.exit(main())

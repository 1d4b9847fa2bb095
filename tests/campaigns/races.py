"""Start two runs on one directory at the same moment: one must win, the other must say who holds it, and end.

python tests/campaigns/races.py --times 200
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

from quick_run import compute_here, ended, fingerprint, preload, start, study_text, use_quick_cases

LATE_S = 1.0  # within which the loser must have ended after it began


def use_no_workers() -> None:
    """Compute in the run's own process; who wins does not depend on workers."""
    from magbear_cli.study import runner

    runner.run_cases = compute_here  # type: ignore[assignment]


class Races:
    """Races over one study, and what came of them."""

    def __init__(self, folder: Path, cases: int) -> None:
        """Run the study alone once."""
        self.folder, self.study = folder, folder / "study.yaml"
        self.study.write_text(study_text(cases), "utf-8")
        if ended(self.begin("calm", "said")) != 0:
            raise SystemExit((folder / "said").read_text("utf-8"))
        self.calm = fingerprint(folder / "calm")
        self.bad: list[str] = []
        self.slowest_s = 0.0

    def begin(self, name: str, said: str) -> int:
        """Start the command on a directory."""
        return start(["run", str(self.study), "-o", str(self.folder / name)], self.folder / said, use_no_workers)

    def race(self) -> None:
        """Let two of them loose."""
        began = time.monotonic()
        pids = {name: self.begin("out", name) for name in ("one", "two")}
        codes: dict[str, int | None] = {}
        while len(codes) < len(pids) and time.monotonic() < began + 60.0:
            for name in pids.keys() - codes.keys():
                code = ended(pids[name], 0.004)
                if code is not None:
                    codes[name] = code
                    self.slowest_s = max(self.slowest_s, time.monotonic() - began if code else 0.0)
        fault = self.fault_of(codes, pids)
        if fault:
            self.bad.append(fault)
        shutil.rmtree(self.folder / "out")
        for name in pids:
            (self.folder / name).unlink()

    def fault_of(self, codes: dict[str, int | None], pids: dict[str, int]) -> str:
        """What was wrong with a race; nothing, as a rule."""
        if sorted(code if code is not None else -1 for code in codes.values()) != [0, 4]:
            return f"exit codes {codes}"
        winner, loser = sorted(codes, key=lambda name: codes[name] or 0)
        told = (self.folder / loser).read_text("utf-8")
        if "is in use by another run (" not in told:
            return f"the loser says {told}"
        if f"process {pids[winner]} on " not in told and "not yet said" not in told:
            return f"the loser names another holder: {told}"
        return "" if fingerprint(self.folder / "out") == self.calm else "other bytes"


def main() -> int:
    """Run the campaign and tell what came of it; 1 if a race was not as it should be."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=200)
    parser.add_argument("--cases", type=int, default=20)
    asked = parser.parse_args()
    os.environ["QUICK_SECONDS"] = "0.03"
    os.environ["QUICK_FIGURES"] = "0"
    use_quick_cases()
    preload()
    folder = Path(tempfile.mkdtemp(prefix="magbear-races-"))
    races = Races(folder, asked.cases)
    for _ in range(asked.times):
        races.race()
    shutil.rmtree(folder)
    print(f"races: {asked.times}; the losers ended {races.slowest_s:.2f} s after the start at the latest")
    print(f"not as it should be: {len(races.bad)}")
    for sentence in races.bad[:10]:
        print(f"  {sentence}")
    return int(bool(races.bad) or races.slowest_s > LATE_S)


if __name__ == "__main__":
    sys.exit(main())

"""A study of very many cases: what each costs beside its computing, early and late, and what memory the run takes.

A case computes nothing here, so all time is the runner's: handing out, storing, logging, and at the end the results
file, the report and the tables.

    python tests/campaigns/soak.py --cases 20000
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

import psutil
from quick_run import ended, preload, start, study_text, use_quick_cases

WINDOWS = 10


def main() -> int:
    """Run the study, watch it from outside, tell what it took; 1 if the run itself did not end well."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=20_000)
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    os.environ["QUICK_SECONDS"] = "0"
    use_quick_cases()
    preload()
    folder = Path(tempfile.mkdtemp(prefix="magbear-soak-"))
    study, log = folder / "study.yaml", folder / "out" / "log.jsonl"
    study.write_text(study_text(asked.cases), "utf-8")
    began = time.time()
    pid = start(["run", str(study), "-o", str(folder / "out"), "-j", str(asked.jobs)], folder / "said")
    memory: list[tuple[float, int, int, float]] = []  # time, bytes, open files, seconds of processor
    parent = psutil.Process(pid)
    code = None
    while code is None:
        with contextlib.suppress(psutil.Error):
            used = parent.cpu_times()
            memory.append((time.time(), parent.memory_info().rss, parent.num_fds(), used.user + used.system))
        code = ended(pid, 0.2)
    over = time.time()
    events = [json.loads(line) for line in log.read_text("utf-8").splitlines()]
    times = [event["time"] for event in events if event["event"] == "case ended"]
    computed = events[-1]["time"]
    if code != 0 or len(times) != asked.cases:
        print((folder / "said").read_text("utf-8")[-2000:])
        return 1
    size = max(1, len(times) // WINDOWS)
    print(f"cases: {asked.cases}, {asked.jobs} workers; planning {events[0]['time'] - began:.1f} s")
    for first in range(0, len(times) - 1, size):
        last = min(first + size, len(times)) - 1
        seen = [row for row in memory if times[first] <= row[0] <= times[last]] or memory[:1]
        wall_ms = (times[last] - times[first]) / max(1, last - first) * 1e3
        print(
            f"  to case {last + 1:6d}: {wall_ms:6.2f} ms a case, {max(row[1] for row in seen) / 1e6:7.1f} MB, "
            f"{max(row[2] for row in seen)} files open"
        )
    before = [row for row in memory if row[0] <= computed][-1]
    print(
        f"end: {(over - computed) / asked.cases * 1e3:.2f} ms a case for results, report and tables; "
        f"at most {max(row[1] for row in memory) / 1e6:.1f} MB"
    )
    print(f"together: {(over - began) / asked.cases * 1e3:.2f} ms a case; of the processor, in this process, "
          f"{before[3] / asked.cases * 1e3:.2f} ms while computing and "
          f"{(memory[-1][3] - before[3]) / asked.cases * 1e3:.2f} ms at the end")  # fmt: skip
    left = [path.name for path in (folder / "out").rglob(".tmp-*")]
    print(f"temporary files left: {len(left)}")
    shutil.rmtree(folder)
    return int(bool(left))


if __name__ == "__main__":
    sys.exit(main())

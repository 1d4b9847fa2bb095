"""Kill the parent, a worker or the whole group of a run at random instants, and go on, again and again.

Lost are finished cases that are not there any more; the end must be the very bytes of a run that nobody disturbed.

    python tests/campaigns/kills.py --kills 200 --cases 60
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path

import psutil
from quick_run import ended, fingerprint, gone_within, preload, start, study_text, use_quick_cases, workers_of

VICTIMS = ("parent", "worker", "group")
WORKING_S = 1.0  # workers of an undisturbed run are about for so long
PER_STUDY = 4  # kills of one directory before it is left to come to its end


class Campaign:
    """Kills, and what came of them."""

    def __init__(self, folder: Path, cases: int, seed: int) -> None:
        """Run the study once undisturbed."""
        self.folder, self.draw = folder, random.Random(seed)  # noqa: S311 - when does not matter
        self.study = folder / "study.yaml"
        self.study.write_text(study_text(cases), "utf-8")
        self.kills: collections.Counter[str] = collections.Counter()
        self.lost = self.orphans = self.different = self.ends = 0
        began = time.monotonic()
        code = ended(self.begin("calm"))
        if code != 0:
            raise SystemExit((folder / "said").read_text("utf-8"))
        self.calm_s = time.monotonic() - began
        self.calm = fingerprint(folder / "calm")

    def begin(self, name: str) -> int:
        """Start the command on a directory."""
        line = ["run", str(self.study), "-o", str(self.folder / name), "-j", "2", "--no-progress"]
        return start(line, self.folder / "said")

    def disturb(self, name: str, most: int) -> None:
        """Kill so often at most in this directory, then let it come to its end."""
        while most > 0:
            pid = self.begin(name)
            victim = self.draw.choice(VICTIMS)
            longest_s = self.draw.choice([WORKING_S, 1.1 * self.calm_s])  # half of them while cases are computed
            if not self._wait(pid, self.draw.uniform(0.0, longest_s) if victim != "worker" else 0.0):
                continue  # it had ended before
            most -= self._kill(pid, victim)
            with contextlib.suppress(ChildProcessError):  # it had ended, and was waited for
                if ended(pid) is None:
                    raise SystemExit(f"the run {pid} does not end")
            self.orphans += not gone_within(pid, 2.0)
            self._look_for_losses(name)
        while (code := ended(self.begin(name))) == 3:  # a case whose worker was killed twice is tried again
            pass
        self.ends += 1
        self.different += code != 0 or fingerprint(self.folder / name) != self.calm

    def _wait(self, pid: int, seconds: float) -> bool:
        """Wait; whether the run is still there."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            if os.waitpid(pid, os.WNOHANG)[0]:
                return False
            time.sleep(0.001)
        return True

    def _kill(self, pid: int, victim: str) -> int:
        if victim == "parent":
            os.kill(pid, signal.SIGKILL)
        elif victim == "group":
            os.killpg(pid, signal.SIGKILL)
        else:
            while not (workers := workers_of(pid)):
                if not self._wait(pid, 0.005):
                    return 0  # it had nothing to compute
            time.sleep(self.draw.uniform(0.0, WORKING_S))
            try:
                self.draw.choice(workers).kill()
            except psutil.NoSuchProcess:
                return 0
        self.kills[victim] += 1
        return 1

    def _look_for_losses(self, name: str) -> None:
        """Every case that the log calls ended with an answer must have a shard."""
        log = self.folder / name / "log.jsonl"
        finished = set()
        for line in log.read_text("utf-8").splitlines() if log.exists() else []:
            try:
                event = json.loads(line)
            except ValueError:
                continue  # a line cut off by a kill
            if event["event"] == "case ended" and event["status"] == "not_achieved":
                finished.add(event["case"])
        stored = {path.name[:16] for path in (self.folder / name).glob("cases/*/*.case")}
        self.lost += len(finished - stored)


def main() -> int:
    """Run the campaign and tell what came of it; 1 if anything was lost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--cases", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    use_quick_cases()
    preload()
    folder = Path(tempfile.mkdtemp(prefix="magbear-kills-"))
    campaign = Campaign(folder, asked.cases, asked.seed)
    while (done := campaign.kills.total()) < asked.kills:
        name = f"run{campaign.ends}"
        campaign.disturb(name, min(PER_STUDY, asked.kills - done))
        shutil.rmtree(folder / name)
    told = ", ".join(f"{campaign.kills[victim]} of a {victim}" for victim in VICTIMS)
    print(f"kills: {campaign.kills.total()} ({told}) over {campaign.ends} runs of {asked.cases} cases")
    print(f"finished cases lost: {campaign.lost}")
    print(f"runs with processes left after 2 s: {campaign.orphans}")
    print(f"runs that ended in other bytes: {campaign.different}")
    shutil.rmtree(folder)
    return int(bool(campaign.lost or campaign.orphans or campaign.different))


if __name__ == "__main__":
    sys.exit(main())

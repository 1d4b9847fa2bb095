"""Flip one bit of a shard, or cut it off, and ask which cases must be computed again: that one, and no other.

python tests/campaigns/bits.py --times 2000
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import sys
import tempfile
from pathlib import Path

from quick_run import ended, fingerprint, preload, start, study_text, use_quick_cases

from magbear_cli.library.planning import planned_cases
from magbear_cli.spec import read_study
from magbear_cli.store.run_directory import RunDirectory

EVERY = 100  # damages after which the command itself repairs them all
TRUNCATED = 0.1  # of the damages


def damage(path: Path, draw: random.Random) -> str:
    """Flip a bit of a file, or cut it off; what was done."""
    content = bytearray(path.read_bytes())
    place = draw.randrange(8 * len(content))
    if draw.random() < TRUNCATED:
        del content[place // 8 :]
        path.write_bytes(content)
        return "cut off"
    content[place // 8] ^= 1 << place % 8
    path.write_bytes(content)
    return "flipped"


def main() -> int:
    """Run the campaign and tell what came of it; 1 if a damage passed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=2000)
    parser.add_argument("--cases", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    os.environ["QUICK_SECONDS"] = "0"
    use_quick_cases()
    preload()
    folder = Path(tempfile.mkdtemp(prefix="magbear-bits-"))
    study, out = folder / "study.yaml", folder / "out"
    study.write_text(study_text(asked.cases), "utf-8")
    line = ["run", str(study), "-o", str(out), "-j", "1", "--no-progress"]
    if ended(start(line, folder / "said")) != 0:
        raise SystemExit((folder / "said").read_text("utf-8"))
    calm, cases, text = fingerprint(out), planned_cases(read_study(study)), read_study(study).text
    draw = random.Random(asked.seed)  # noqa: S311 - which bits does not matter
    done = {"flipped": 0, "cut off": 0}
    passed = repaired = different = 0
    while sum(done.values()) < asked.times:
        shards = draw.sample(sorted(out.glob("cases/*/*.case")), min(20, asked.cases // 2))
        kept = {path: path.read_bytes() for path in shards}
        for path in shards:
            done[damage(path, draw)] += 1
            with RunDirectory(out, text) as directory:
                missing = {case.id for case in directory.missing(cases)}
            passed += missing != {path.name[:16]}
            if sum(done.values()) % EVERY:
                path.write_bytes(kept[path])
                continue
            for other in shards:  # all at once, and the command repairs them
                if other.read_bytes() == kept[other]:
                    damage(other, draw)
            code = ended(start(line, folder / "said"))
            repaired += 1
            different += code != 0 or fingerprint(out) != calm
            break
    shutil.rmtree(folder)
    print(f"damages: {sum(done.values())} ({done['flipped']} flipped bits, {done['cut off']} cut off)")
    print(f"not detected, or taken for another case's: {passed}")
    print(f"repairs by the command: {repaired}, of them to other bytes: {different}")
    return int(bool(passed or different))


if __name__ == "__main__":
    sys.exit(main())

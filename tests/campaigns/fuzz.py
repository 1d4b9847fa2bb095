"""Study files and overrides that are broken in every way: each is read, or refused with its place and a remedy.

python tests/campaigns/fuzz.py --texts 100000 --commands 300
"""

from __future__ import annotations

import argparse
import collections
import os
import random
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from magbear_cli.spec.files import decode
from magbear_cli.spec.problems import CODES, Faults, Problem, StudyError
from magbear_cli.spec.study import read_study_text

ROOT = Path(__file__).parents[2]
FRAGMENTS = [
    *("[", "]", "{", "}", ":", ": ", ", ", "- ", "? ", "#", "&a ", "*a", "!!int ", "!!float x", "!!python/object:x "),
    *("|", ">", "'", '"', "%", "@", "`", "\n", "\n  ", "\n      ", "\t", "\r", "\u2028", "\u00a0", "\ufeff", "\\"),
    *("\x00", "---\n", "...\n", "<<: ", "null", "true", "on", "no", "~", "1e3", "010", ".nan", ".inf", "1e400", "-"),
    *("1_0", "0x1F", "1,5", "1.5 kg", "−1", "1:30", "2026-11-22", "2026-13-45", "9" * 40, "sweep", "magbear"),
    *("controller.order", "mass_kg", "[3.0, 4.5]", "{method: lqg}", "simulate", "step_m: ", "bearing: ", "[[[["),
    *("é", "µ", "🧲", "٣"),
]  # fmt: skip
KEYS = [
    "mass_kg",
    "mass_kg.1",
    "controller",
    "controller.order",
    "sweep",
    "sweep.mass_kg",
    "name",
    "magbear",
    "run.timeout_s",
]
PLACE = re.compile(r"^[^\n]*?:\d+:\d+: error\[E\d{3}\]: ", re.MULTILINE)
WITHOUT_PLACE = {"E100", "E110", "E111", "E118"}  # about a file as a whole, or about the command line


class Monkey:
    """Broken texts, one after the other, from a seed."""

    def __init__(self, seed: int) -> None:
        """Begin with the studies of the project."""
        self.draw = random.Random(seed)  # noqa: S311 - a reproducible walk, not a secret
        self.studies = [path.read_text("utf-8") for path in sorted((ROOT / "studies").glob("*.yaml"))]

    def text(self) -> str:
        """A legal study with one to five wounds, fragments at random, or random characters."""
        kind = self.draw.random()
        if kind < 0.1:
            return "".join(self.draw.choices(FRAGMENTS, k=self.draw.randint(0, 30)))
        if kind < 0.15:
            return "".join(
                chr(self.draw.choice([self.draw.randint(0, 127), self.draw.randint(0, 0x2FFF)])) for _ in range(40)
            )
        text = self.draw.choice(self.studies)
        for _ in range(self.draw.randint(1, 5)):
            start = self.draw.randrange(len(text) + 1)
            stop = min(len(text), start + self.draw.choice([0, 1, 1, 2, 5, 20, 60]))
            piece = self.draw.choice([*FRAGMENTS, text[start:stop] * 2, "", ""])
            text = text[:start] + piece + text[stop:]
        return text

    def overrides(self) -> tuple[str, ...]:
        """None, as a rule; else one or two of them."""
        if self.draw.random() < 0.8:
            return ()
        values = ["".join(self.draw.choices(FRAGMENTS, k=self.draw.randint(0, 4))) for _ in range(2)]
        return tuple(f"{self.draw.choice(KEYS)}={value}" for value in values[: self.draw.randint(1, 2)])


def fault_of(problems: tuple[Problem, ...], *, is_overridden: bool) -> str:
    """What is wrong with how problems are told; nothing, as a rule."""
    for problem in problems:
        if problem.code not in CODES or not problem.sentence or "Error" in problem.sentence:
            return f"an odd sentence: {problem}"
        placed = problem.line is not None and problem.column is not None and problem.line >= 1 and problem.column >= 1
        if not placed and problem.code not in WITHOUT_PLACE and not (is_overridden or problem.file != "fuzz.yaml"):
            return f"no place: {problem}"
    return ""


def in_process(monkey: Monkey, times: int) -> tuple[collections.Counter[str], list[str]]:
    """Read so many texts here; how they ended, and what was wrong."""
    counts: collections.Counter[str] = collections.Counter()
    bad: list[str] = []
    for _ in range(times):
        text, overrides = monkey.text(), monkey.overrides()
        try:
            study = read_study_text(text, "fuzz.yaml", overrides)
            counts["legal"] += study.case_count >= 1
        except StudyError as error:
            counts["refused"] += 1
            str(error).encode("utf-8")
            fault = fault_of(error.problems, is_overridden=bool(overrides))
            bad += [f"{fault} for {text!r} {overrides}"] if fault else []
        except Exception as error:  # noqa: BLE001 - it is what is looked for
            bad.append(f"{type(error).__name__}: {error} for {text!r} {overrides}")
    return counts, bad


def by_command(monkey: Monkey, times: int) -> tuple[collections.Counter[str], list[str]]:
    """The same through the command, as files of bytes that need not be text."""
    counts: collections.Counter[str] = collections.Counter()
    bad: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "fuzz.yaml"
        for _ in range(times):
            content = monkey.text().encode("utf-8", "surrogatepass")
            if monkey.draw.random() < 0.1:
                content += bytes(monkey.draw.choices(range(256), k=5))
            file.write_bytes(content)
            line = [sys.executable, "-m", "magbear_cli", "check", str(file)]
            for override in monkey.overrides():
                if "\x00" not in override:
                    line += ["--set", override.encode("utf-8", "replace").decode("utf-8")]
            done = subprocess.run(line, capture_output=True, check=False, cwd=folder)
            said = done.stderr.decode("utf-8", "replace")
            counts[f"exit {done.returncode}"] += 1
            faults = Faults()
            whole = decode(content, "fuzz.yaml", faults) is not None
            placed = bool(PLACE.search(said)) or any(f"[{code}]" in said for code in WITHOUT_PLACE) or "--set" in said
            if done.returncode not in {0, 2} or "Traceback" in said or (done.returncode == 2 and whole and not placed):
                bad.append(f"exit {done.returncode}: {said[-400:]} for {content!r} {line[5:]}")
    return counts, bad


def main() -> int:
    """Run the campaign and tell what came of it; 1 if anything else came out."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--texts", type=int, default=100_000)
    parser.add_argument("--commands", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    os.environ["COLUMNS"] = "200"
    counts, bad = in_process(Monkey(asked.seed), asked.texts)
    print(f"texts in process: {asked.texts} ({counts['legal']} legal, {counts['refused']} refused)", flush=True)
    told, worse = by_command(Monkey(asked.seed + 1), asked.commands)
    print(f"files through the command: {asked.commands} ({', '.join(f'{n} {k}' for k, n in sorted(told.items()))})")
    print(f"not as it should be: {len(bad) + len(worse)}")
    for sentence in [*bad[:10], *worse[:10]]:
        print(f"  {sentence}")
    return int(bool(bad or worse))


if __name__ == "__main__":
    sys.exit(main())

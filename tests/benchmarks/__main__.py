"""Ours against the peers, row by row: ``python -m tests.benchmarks`` from the top of a clone (``-h`` tells more).

Each row runs in a process of its own with one thread a library; in it the sides take turns. Raw samples go to one JSON
file a row; the table and the figures are drawn from those files, so that rows may be measured at different times.
"""

# ruff: noqa: T201 - a benchmark is a command, and its table is its answer

from __future__ import annotations

import argparse
import importlib
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.benchmarks.measuring import Row, measure, missing

HERE = Path(__file__).parent
ROWS = (
    "robust_controller", "exact_optimum", "scalings", "response", "step", "adaptive", "limits", "sweep", "start",
    "growth",
)  # fmt: skip
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure the rows asked for, then print the table of all that is stored."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__.splitlines()[0])
    parser.add_argument(
        "--rows", nargs="*", choices=ROWS, default=list(ROWS), help="which to measure; none for the table"
    )
    parser.add_argument("--repeats", type=int, default=5, help="alternating runs of each side")
    parser.add_argument(
        "-o", "--output", type=Path, default=HERE / "results", help="folder of samples, table and figures"
    )
    parser.add_argument(
        "--tiny", action="store_true", help="tiny problems: for a look at the answers, not at the times"
    )
    parser.add_argument("--in-process", choices=ROWS, help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.in_process:
        return _measure_here(options.in_process, options.output, options.repeats, tiny=options.tiny)
    options.output.mkdir(parents=True, exist_ok=True)
    failed = [name for name in options.rows if not _measure_in_a_process(name, options)]
    from tests.benchmarks.reporting import write_report

    print(write_report(options.output))
    return 1 if failed else 0


def _measure_in_a_process(name: str, options: argparse.Namespace) -> bool:
    """Measure a row; False when it came to nothing."""
    command = [sys.executable, "-m", "tests.benchmarks", "--in-process", name, "-o", str(options.output)]
    command += ["--repeats", str(options.repeats), *(["--tiny"] if options.tiny else [])]
    done = subprocess.run(command, env={**os.environ, **ONE_THREAD}, check=False, cwd=HERE.parents[1])
    return done.returncode == 0


def _measure_here(name: str, output: Path, repeats: int, *, tiny: bool) -> int:
    """Measure a row in this process and store its document."""
    module = importlib.import_module(f"tests.benchmarks.rows.{name}")
    row: Row = module.ROW
    absent = [] if tiny else missing(row)  # a tiny problem has the sides alone that every machine has
    if absent:
        print(
            f'{name}: left out, as {", ".join(absent)} is not installed: pip install -e ".[benchmark]"', file=sys.stderr
        )
        return 1
    document = measure(row, repeats, lambda text: print(text, file=sys.stderr), tiny=tiny)
    (output / f"{name}.json").write_text(json.dumps(document, indent=1) + "\n", "utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

"""How long the command line takes to answer, beside Python's own start with click in it."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tests.benchmarks.measuring import Goal, Prepared, Row, Side

ROOT = Path(__file__).parents[3]
CLICK, HELP, CHECK = "import click", "magbear --help", "magbear check"


def _prepare(_tiny: bool) -> Prepared:  # noqa: FBT001 - the row's switch
    magbear = str(Path(sys.executable).with_name("magbear"))
    study = str(ROOT / "studies" / "quickstart.yaml")
    commands = {
        CLICK: [sys.executable, "-c", "import click"],
        HELP: [magbear, "--help"],
        CHECK: [magbear, "check", study],
    }

    def run(name: str) -> str:
        return subprocess.run(commands[name], capture_output=True, text=True, check=True, cwd=ROOT).stdout

    def errors(answers: Mapping[str, Any]) -> Mapping[str, Mapping[str, float]]:
        told = {HELP: "Start with" in answers[HELP], CHECK: "legal, 4 cases" in answers[CHECK]}
        return {name: {"answers wrongly": float(not right)} for name, right in told.items()}

    def floor(seconds: Mapping[str, float]) -> str:
        return (
            f"Python with click takes {1e3 * seconds[CLICK]:.0f} ms; the rest of the {1e3 * seconds[HELP]:.0f} and "
            f"{1e3 * seconds[CHECK]:.0f} ms are our modules, for a check PyYAML and pydantic with its models"
        )

    return Prepared([Side(name, lambda name=name: run(name)) for name in commands], errors, floor)  # type: ignore[misc]


ROW = Row(
    "start",
    "`magbear --help`, `magbear check` on studies/quickstart.yaml",
    [Goal(HELP, CLICK, 2.5, at_most=True), Goal(CHECK, CLICK, 6.0, at_most=True)],
    _prepare,
    missed_because={CLICK: "pydantic's import and the models of a study are the rest"},
)

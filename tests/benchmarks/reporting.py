"""The table of the stored rows: medians, ratios against the goals, errors and floors."""

from __future__ import annotations

import importlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from tests.benchmarks.measuring import Goal, Row, medians

HEAD = "| work | peer | ours, s | peer, s | ratio | goal | |"


def write_report(folder: Path) -> str:
    """The table of the documents in a folder, written there as table.md too; figures beside it."""
    documents = {path.stem: json.loads(path.read_text("utf-8")) for path in sorted(folder.glob("*.json"))}
    lines = [HEAD, "| --- " * 7 + "|"]
    notes: list[str] = []
    for name, document in documents.items():
        if name == "growth":
            continue
        row: Row = importlib.import_module(f"tests.benchmarks.rows.{name}").ROW
        lines += _goal_lines(row, document)
        notes += _notes(row, document)
    if "growth" in documents:
        from tests.benchmarks.growth import draw_growth, growth_table

        draw_growth(documents["growth"], folder / "growth.svg")
        notes += ["", *growth_table(documents["growth"])]
    text = "\n".join([*lines, "", *notes])
    (folder / "table.md").write_text(text + "\n", "utf-8")
    return text


def _goal_lines(row: Row, document: Mapping[str, Any]) -> Iterator[str]:
    seconds = medians(document["samples"])
    for goal in row.goals:
        if not {goal.ours, goal.peer} <= seconds.keys():
            yield f"| {row.work} | {goal.peer} | | | not measured | {_wanted(goal)} | missed |"
            continue
        ours, peer = seconds[goal.ours], seconds[goal.peer]
        ratio = f"{goal.ratio(seconds):.3g}"
        verdict = "met" if goal.is_met(seconds) else "missed"
        told = [f"{row.work}: {goal.ours}", goal.peer, f"{ours:.3g}", f"{peer:.3g}", ratio, _wanted(goal), verdict]
        yield f"| {' | '.join(told)} |"


def _wanted(goal: Goal) -> str:
    return f"{'≤' if goal.at_most else '≥'} {goal.factor:g}"


def _notes(row: Row, document: Mapping[str, Any]) -> Iterator[str]:
    """Errors, floor, spread of the samples, and why a goal is missed."""
    seconds = medians(document["samples"])
    yield f"- `{row.name}`: {document['floor']}."
    for name, found in document["errors"].items():
        yield f"  - {name}: {', '.join(f'{what} {value:.3g}' for what, value in found.items())}."
    for name, value in seconds.items():
        mine = [one["seconds"] for one in document["samples"] if one["side"] == name]
        yield f"  - {name}: median {value:.4g} s of {len(mine)}, {min(mine):.4g} to {max(mine):.4g}."
    for goal in row.goals:
        if {goal.ours, goal.peer} <= seconds.keys() and not goal.is_met(seconds):
            yield f"  - missed against {goal.peer}: {row.missed_because.get(goal.peer, 'no reason is known yet')}."

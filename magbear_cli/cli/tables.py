"""The tables of a study on the terminal: its cases, and its step responses."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from magbear_cli.study.naming import controller_name
from magbear_cli.study.outcome import CaseOutcome, StepOutcome, StudyResults

MOST_STEPS = 60
PLAIN_WIDTH = 110  # of a table that goes into a file or a pipe
DASH = "–"


def print_study(results: StudyResults) -> None:
    """Print every case, the sentences of those that are not ok, and the step responses."""
    console = Console() if sys.stdout.isatty() else Console(width=PLAIN_WIDTH)
    console.print(_case_table(results.outcomes))
    for outcome in results.outcomes:
        if outcome.sentence:
            console.print(Text(f"{outcome.case_id[:8]} {outcome.status.value}: {outcome.sentence}"))
    steps = [(outcome, step) for outcome in results.outcomes for step in outcome.steps]
    if steps:
        console.print(_step_table(steps[:MOST_STEPS]))
    if len(steps) > MOST_STEPS:
        console.print(Text(f"{len(steps) - MOST_STEPS} more step responses are in the report"))


def _case_table(outcomes: Sequence[CaseOutcome]) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in ("case", "status", "controller"):
        table.add_column(name)
    for name in ("mass\nkg", "ω_c\nrad/s", "worst\ncase", "peak\nmu", "order", "|KS|\nA/µm"):
        table.add_column(name, justify="right")
    table.add_column("verified")
    for outcome in outcomes:
        summary = outcome.summary
        table.add_row(
            outcome.case_id[:8],
            outcome.status.value,
            controller_name(outcome.inputs["controller"]),
            _mass(outcome.mass_kg),
            _figure(outcome.omega_c_rad_s, ".6g"),
            _figure(summary.worst_case, ".4f"),
            _figure(summary.peak_mu, ".4f"),
            DASH if summary.order is None else str(summary.order),
            _figure(None if summary.peak_ks_a_per_m is None else summary.peak_ks_a_per_m * 1e-6, ".3g"),
            "yes" if summary.verified else "no",
        )
    return table


def _step_table(steps: Sequence[tuple[CaseOutcome, StepOutcome]]) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold", title_justify="left", title="\nStep responses")
    table.add_column("case")
    table.add_column("controller")
    for name in ("mass\nkg", "step\nµm", "prefilter\nrad/s", "settling\nms", "overshoot\n%", "peak current\nA"):
        table.add_column(name, justify="right")
    table.add_column("end")
    for outcome, step in steps:
        prefilter = step.scenario.get("prefilter")
        table.add_row(
            outcome.case_id[:8],
            controller_name(outcome.inputs["controller"]),
            f"{step.mass_kg:.3g}",
            f"{step.step_m * 1e6:.4g}",
            DASH if prefilter is None else f"{prefilter['omega_rad_s']:.6g}",
            _figure(None if step.settling_time_s is None else step.settling_time_s * 1e3, ".3g"),
            _figure(None if step.overshoot is None else step.overshoot * 1e2, ".3g"),
            _figure(step.peak_current_a, ".3g"),
            f"touched down at {step.time_s[-1] * 1e3:.3g} ms" if step.touched_down else step.end.replace("_", " "),
        )
    return table


def _mass(mass_kg: float | list[float]) -> str:
    return "-".join(f"{bound:.4g}" for bound in mass_kg) if isinstance(mass_kg, list) else f"{mass_kg:.4g}"


def _figure(value: float | None, form: str) -> str:
    return DASH if value is None or value != value else format(value, form)  # noqa: PLR0124 - NaN alone differs from itself

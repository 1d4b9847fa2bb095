"""The tables of a study on the terminal: its cases, and its step responses."""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Sequence
from itertools import islice

from rich.console import Console
from rich.table import Table
from rich.text import Text

from magbear_cli.claims.ledger import JudgedClaim, tally
from magbear_cli.study.naming import controller_name
from magbear_cli.study.outcome import CaseOutcome, StepOutcome, StudyResults

ID_SHOWN = 7  # digits; --case takes any beginning of an identity
MOST_STEPS = 60
MOST_CASES = 200
PLAIN_WIDTH = 110  # of a table that goes into a file or a pipe
DASH = "–"


def study_tables(results: StudyResults) -> str:
    """The cases, the sentences of those that have one, and the step responses; no wider than the terminal.

    Of many cases the first ones are in the table, and all of them in a count by status.
    """
    console = Console() if sys.stdout.isatty() else Console(width=PLAIN_WIDTH)
    outcomes = results.outcomes[:MOST_CASES]
    with console.capture() as capture:
        console.print(_case_table(outcomes))
        for outcome in outcomes:
            if outcome.sentence:
                console.print(Text(f"{outcome.case_id[:ID_SHOWN]} {outcome.status.value}: {outcome.sentence}"))
        _print_steps(console, outcomes)
        if len(outcomes) < len(results.outcomes):
            counts = Counter(outcome.status.value for outcome in results.outcomes)
            told = ", ".join(f"{count} {status}" for status, count in sorted(counts.items()))
            console.print(Text(f"the first {MOST_CASES} of {len(results.outcomes)} cases; all of them: {told}"))
    return "\n".join(line.rstrip() for line in capture.get().splitlines())


def ledger_table(claims: Sequence[JudgedClaim]) -> str:
    """The ledger of the thesis's claims: one block a claim, and the tally."""
    console = Console() if sys.stdout.isatty() else Console(width=PLAIN_WIDTH)
    table = Table(box=None, pad_edge=False, padding=(0, 2, 1, 0), show_header=True, header_style="bold")
    for name in ("id", "place"):
        table.add_column(name, no_wrap=name == "id", max_width=18)
    table.add_column("claim, printed, recomputed, verdict")
    for claim in claims:
        lines = (
            claim.claim,
            f"printed: {claim.printed}",
            f"ours: {claim.finding.ours}",
            f"{claim.finding.verdict.value}: {claim.finding.why}",
        )
        table.add_row(claim.id, claim.place, Text("\n".join(lines)))
    with console.capture() as capture:
        console.print(table)
        console.print(Text(f"{len(claims)} claims: {tally(claims)}"))
    return "\n".join(line.rstrip() for line in capture.get().splitlines())


def _print_steps(console: Console, outcomes: Sequence[CaseOutcome]) -> None:
    steps = sum(len(outcome.steps) for outcome in outcomes)
    if steps:
        console.print(Text("\nStep responses"))
        console.print(_step_table(outcomes))
    if steps > MOST_STEPS:
        console.print(Text(f"{steps - MOST_STEPS} more step responses are in the report"))


def _table(left: Sequence[str], right: Sequence[str], last: str) -> Table:
    """An empty table with columns of words, of numbers, and one of words."""
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    for name in left:
        table.add_column(name, no_wrap=name != "design", overflow="fold")
    for name in right:
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column(last)
    return table


def _case_table(outcomes: Sequence[CaseOutcome]) -> Table:
    numbers = ("mass\nkg", "ω_c\nrad/s", "worst\ncase", "peak\nmu", "order", "|KS|\nA/µm")
    magnets = any(outcome.inputs.get("uncertain") for outcome in outcomes)
    table = _table(("case", "status", "design", *(["uncertain"] if magnets else [])), numbers, "veri-\nfied")
    for outcome in outcomes:
        summary = outcome.summary
        table.add_row(
            outcome.case_id[:ID_SHOWN],
            outcome.status.value,
            Text(controller_name(outcome.inputs["controller"])),
            *([_uncertain(outcome)] if magnets else []),
            _mass(outcome.mass_kg),
            _limit(outcome),
            _figure(summary.worst_case, ".4f"),
            _figure(summary.peak_mu, ".4f"),
            DASH if summary.order is None else str(summary.order),
            _figure(summary.peak_ks_a_per_m, ".3g", 1e-6),
            "yes" if summary.verified else "no",
        )
    return table


def _step_table(outcomes: Sequence[CaseOutcome]) -> Table:
    numbers = ("mass\nkg", "step\nµm", "filter\nrad/s", "settles\nms", "over-\nshoot\n%", "peak\nA")
    table = _table(("case", "design"), numbers, "end")
    pairs = ((outcome, step) for outcome in outcomes for step in outcome.steps)
    shown = None
    for outcome, step in islice(pairs, MOST_STEPS):
        is_first, shown = outcome is not shown, outcome
        prefilter = step.scenario.get("prefilter")
        table.add_row(
            outcome.case_id[:ID_SHOWN] if is_first else "",
            Text(controller_name(outcome.inputs["controller"]) if is_first else ""),
            f"{step.mass_kg:.3g}",
            f"{step.step_m * 1e6:.4g}",
            DASH if prefilter is None else f"{prefilter['omega_rad_s']:.6g}",
            _figure(step.settling_time_s, ".3g", 1e3),
            _figure(step.overshoot, ".3g", 1e2),
            _figure(step.peak_current_a, ".3g"),
            _end(step),
        )
    return table


def _end(step: StepOutcome) -> str:
    if step.touched_down:
        return f"touched down at {step.time_s[-1] * 1e3:.3g} ms"
    return step.end.replace("_", " ")


def _limit(outcome: CaseOutcome) -> str:
    """The bandwidth limit that was given, or the bracket of the one that was sought."""
    low, high = outcome.summary.omega_c_infeasible_rad_s, outcome.summary.omega_c_feasible_rad_s
    if low is None and high is None:
        return _figure(outcome.omega_c_rad_s, ".6g")
    return f"{_figure(low, '.5g')}-{_figure(high, '.5g')}"


def _uncertain(outcome: CaseOutcome) -> str:
    """What is uncertain beside the mass, in the symbols of the model."""
    uncertain = outcome.inputs.get("uncertain")
    if not uncertain:
        return DASH
    symbols = {"force_constant": "k_0", "negative_stiffness": "k_z", "current_stiffness": "k_i"}
    told = (f"{symbols[name]} × {'-'.join(f'{value:.4g}' for value in span)}" for name, span in uncertain.items())
    return "\n".join(told)


def _mass(mass_kg: float | list[float]) -> str:
    return "-".join(f"{bound:.4g}" for bound in mass_kg) if isinstance(mass_kg, list) else f"{mass_kg:.4g}"


def _figure(value: float | None, form: str, factor: float = 1.0) -> str:
    return DASH if value is None or math.isnan(value) else format(value * factor, form)

"""What each further state buys: how far above the proven bound the best controller of each order stays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter

from magbear_cli.report.canvas import COLOURS, DASHES, MARKERS, new_figure, panel_title, panels, plain
from magbear_cli.report.drawing import Drawing, stacked
from magbear_cli.report.limit_curves import LIMIT
from magbear_cli.report.numbers import count_text, mass_text, omega_text, shortest
from magbear_cli.report.series import Labels, problem_key
from magbear_cli.report.sweep import worst_case
from magbear_cli.study.outcome import CaseOutcome

_LEAST_PROBLEMS, _LEAST_ORDERS = 2, 3
_PERCENT = 100.0
_ROW_IN = 0.165


@dataclass(frozen=True)
class _Line:
    """One problem: its proven bound, and the best case of each order, by ascending order."""

    bound: float
    cases: tuple[CaseOutcome, ...]

    @property
    def excess_percent(self) -> list[float]:
        return [_PERCENT * ((worst_case(case) or self.bound) / self.bound - 1.0) for case in self.cases]

    @property
    def name(self) -> str:
        first = self.cases[0]
        return f"{mass_text(first.mass_kg)}, ω_c = {omega_text(first.omega_c_rad_s)}"


def orders_drawing(outcomes: tuple[CaseOutcome, ...], labels: Labels) -> Drawing | None:
    """The loss of few states over the problems of a study; None where it does not compare orders."""
    lines = _lines(outcomes)
    if len(lines) < _LEAST_PROBLEMS:
        return None
    rows = (len(lines) + 2) // 3
    figure = new_figure(3.2 + _ROW_IN * rows)
    axes = panels(figure, 1, below=0.12 + _ROW_IN * rows, right=0.3, left=0.9)[0][0]
    masses = list(dict.fromkeys(mass_text(line.cases[0].mass_kg) for line in lines))
    limits = list(dict.fromkeys(line.cases[0].omega_c_rad_s for line in lines))
    handles = []
    for line in lines:
        hue, shape = masses.index(mass_text(line.cases[0].mass_kg)), limits.index(line.cases[0].omega_c_rad_s)
        style = {
            "color": COLOURS[hue % len(COLOURS)],
            "linestyle": DASHES[hue % len(DASHES)],
            "marker": MARKERS[shape % len(MARKERS)],
        }
        axes.plot([case.summary.order or 0 for case in line.cases], line.excess_percent, markersize=4.8, **style)
        handles.append(Line2D([], [], markersize=4.8, **style))
    orders = sorted({case.summary.order or 0 for line in lines for case in line.cases})
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(FixedLocator([0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0]))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{shortest(value)} %"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_major_locator(FixedLocator(orders))
    axes.set_xlabel("states of the controller")
    axes.set_ylabel("worst case above what is\nproven impossible")
    panel_title(axes, "What each further state buys")
    names = [plain(line.name, 60) for line in lines]
    figure.legend(handles, names, loc="lower center", bbox_to_anchor=(0.5, 0.0), ncols=3, columnspacing=1.6)
    return Drawing(
        name="orders",
        title="How simple the controller may be",
        caption="For each problem the exact worst case of the best controller of each order, over the level that a "
        "checked certificate proves to be out of reach of every linear controller. The last point is the best of any "
        "order; what is left of it is what the certificate does not decide.",
        alt=f"Worst case above the proven bound by number of states: {_spoken(lines)}.",
        figure=figure,
        columns=stacked(
            [
                {
                    "problem": [line.name] * len(line.cases),
                    "case_id": [case.case_id for case in line.cases],
                    "controller": [labels.controller(case) for case in line.cases],
                    "order": [case.summary.order for case in line.cases],
                    "worst_case": [worst_case(case) for case in line.cases],
                    "lower_bound": [line.bound] * len(line.cases),
                    "excess_percent": line.excess_percent,
                }
                for line in lines
            ]
        ),
    )


def _lines(outcomes: Sequence[CaseOutcome]) -> list[_Line]:
    groups: dict[str, list[CaseOutcome]] = {}
    for outcome in outcomes:
        known = outcome.summary.order is not None and worst_case(outcome) is not None
        if (
            outcome.method != LIMIT
            and known
            and outcome.inputs["controller"].get("minimise", "worst_case") == "worst_case"
        ):
            groups.setdefault(problem_key(outcome), []).append(outcome)
    found = []
    for group in groups.values():
        bounds = [case.summary.lower_bound for case in group if case.summary.lower_bound is not None]
        best: dict[int, CaseOutcome] = {}
        for case in sorted(group, key=lambda case: worst_case(case) or 0.0):
            best.setdefault(case.summary.order or 0, case)
        if bounds and len(best) >= _LEAST_ORDERS:
            found.append(_Line(max(bounds), tuple(best[order] for order in sorted(best))))
    return found


def _spoken(lines: Sequence[_Line]) -> str:
    return "; ".join(
        f"{line.name}: "
        + ", ".join(
            f"{excess:.2g} % with {count_text(case.summary.order or 0, 'state')}"
            for excess, case in zip(line.excess_percent, line.cases, strict=True)
        )
        for line in lines
    )

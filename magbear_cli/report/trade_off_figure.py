"""Order against worst case, where several controllers are tried on the same problem."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator

from magbear_cli.errors import Status
from magbear_cli.report.canvas import BLUE, LEVEL, RUST, legend_below, new_figure, panel_title, panels, plain
from magbear_cli.report.drawing import Drawing
from magbear_cli.report.limit_curves import LIMIT
from magbear_cli.report.numbers import count_text, mass_text, omega_text, significant
from magbear_cli.report.series import Labels, file_stem, problem_key
from magbear_cli.report.sweep import peak_mu, worst_case
from magbear_cli.study.outcome import CaseOutcome

_NAME_WIDTH = 46
_ROW_IN = 0.26
_FROM_RECORD = 3.0  # beyond this many times the smallest level the axis is logarithmic


def trade_off_drawings(outcomes: tuple[CaseOutcome, ...], labels: Labels) -> list[Drawing]:
    """A figure for each problem that several controllers answered."""
    groups: dict[str, list[CaseOutcome]] = {}
    for outcome in outcomes:
        if outcome.method != LIMIT and outcome.summary.order is not None and worst_case(outcome) is not None:
            groups.setdefault(problem_key(outcome), []).append(outcome)
    return [_drawing(group, outcomes, labels) for group in groups.values() if len(group) > 1]


def _drawing(group: Sequence[CaseOutcome], outcomes: tuple[CaseOutcome, ...], labels: Labels) -> Drawing:
    rows = sorted(group, key=lambda case: (case.summary.order or 0, labels.controller(case)))
    names = [f"{labels.controller(case)} · {count_text(case.summary.order or 0, 'state')}" for case in rows]
    widest = max(min(len(name), _NAME_WIDTH) for name in names)
    figure = new_figure(1.3 + _ROW_IN * len(rows))
    axes = panels(figure, 1, left=0.3 + 0.066 * widest, below=0.24)[0][0]
    worst, mu = [worst_case(case) for case in rows], [peak_mu(case) for case in rows]
    for row, (low, high) in enumerate(zip(worst, mu, strict=True)):
        if low is not None and high is not None:
            axes.plot([low, high], [row, row], color="#afb8c1", linewidth=1.0, zorder=2)
    for levels, marker, colour, label, size in (
        (worst, "o", RUST, "worst real mass", 7.5),
        (mu, "s", BLUE, "peak µ, complex blocks", 4.2),
    ):
        for row, level in enumerate(levels):
            if level is not None:
                met = rows[row].status == Status.OK
                axes.plot(
                    level,
                    row,
                    marker,
                    color=colour,
                    markerfacecolor=colour if met else "white",
                    markersize=size,
                    zorder=3,
                    label=label if row == 0 else None,
                )
    _finish(axes, names, [level for level in (*worst, *mu) if level is not None])
    legend_below(figure, *axes.get_legend_handles_labels())
    first = rows[0]
    limit = "" if first.omega_c_rad_s is None else f", ω_c = {omega_text(first.omega_c_rad_s)}"
    what = f"{mass_text(first.mass_kg)}{limit}"
    panel_title(axes, f"Controllers for {plain(what, 80)}, by number of states")
    spoken = "; ".join(f"{name}: {significant(level)}" for name, level in zip(names, worst, strict=True))
    return Drawing(
        name=f"trade_off-{file_stem(first, outcomes)}",
        title=f"Order against worst case, {what}",
        caption="The level each controller reaches, from the simplest at the top. The circle is the exact worst case "
        "over the real masses, the square the peak of µ with complex blocks; filled where the case is verified.",
        alt=f"Worst case by controller for {what}: {spoken}.",
        figure=figure,
        columns={
            "case_id": [case.case_id for case in rows],
            "controller": [labels.controller(case) for case in rows],
            "order": [case.summary.order for case in rows],
            "worst_case": worst,
            "peak_mu": mu,
            "status": [case.status.value for case in rows],
        },
    )


def _finish(axes: Axes, names: Sequence[str], levels: Sequence[float]) -> None:
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.yaxis.set_major_locator(FixedLocator(list(range(len(names)))))
    axes.set_yticklabels([plain(name, _NAME_WIDTH) for name in names])
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
    low, high = min(levels), max(*levels, 1.0)
    if high / low > 10 * _FROM_RECORD:
        axes.set_xscale("log")
        axes.set_xlim(low / 1.5, high * 1.5)
    else:
        axes.set_xlim(0.0, 1.08 * high)
    axes.axvline(1.0, **LEVEL)
    axes.set_xlabel("level (1 meets the specification)")

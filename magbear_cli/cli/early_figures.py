"""The figures of a run's first cases, drawn by workers that have no case to compute, while others still have one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from magbear_cli.report.sheet import Print
    from magbear_cli.spec import Study
    from magbear_cli.store.run_directory import RunDirectory
    from magbear_cli.study.outcome import CaseOutcome, StudyResults
    from magbear_cli.study.plan import Case


class EarlyFigures:
    """Keeps finished cases in the run's directory and has figures drawn of what is stored there.

    A context manager that has the run's workers as long as it lasts, so that they can draw when they have computed.
    """

    def __init__(
        self,
        study: Study,
        planned: tuple[Sequence[Case], Sequence[Case]],
        missing: Sequence[Case],
        directory: RunDirectory,
        jobs: int,
    ) -> None:
        """Begin with what is stored; ``planned`` are all cases and those asked for."""
        from magbear_cli.report.matplotlib_home import settle_matplotlib_home
        from magbear_cli.report.press import Press
        from magbear_cli.study.chores import Chores

        cases, asked = planned
        self.chores = Chores()
        self._directory, self._cases = directory, cases
        self._press = Press(self.chores, cases, study.report, jobs)
        self._is_early = len(asked) == len(cases)  # else some case is likely to be missing, and names would change
        if missing:
            settle_matplotlib_home()  # the workers inherit it
            for index in {case.index for case in cases} - {case.index for case in missing}:
                self._draw(index)

    def __enter__(self) -> Self:
        """Give what keeps."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Send the workers away."""
        self.chores.__exit__(kind, error, trace)

    def keep(self, outcome: CaseOutcome) -> None:
        """Store a finished case for good, and have it drawn if it is one of the first."""
        self._directory.keep(outcome)
        self._draw(outcome.index)

    def log(self, event: str, **facts: object) -> None:
        """Add a line to the log."""
        self._directory.log(event, **facts)

    def sheets(self, results: StudyResults) -> Iterator[Print] | None:
        """All figures of the study in their order; None where there are no workers to draw them."""
        return self._press.prints(results) if self.chores.has_workers else None

    def _draw(self, index: int) -> None:
        """Have the case at this place drawn, from what is stored: the report is about that."""
        if self._is_early and self._press.draws(index):
            for outcome in self._directory.outcomes([self._cases[index]]):
                self._press.draw_ahead(outcome)

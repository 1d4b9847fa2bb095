"""Draw the figures of a report in worker processes, those of single cases as soon as the case is known.

Drawing takes a third of a second a figure, nearly all of it in turning a figure into files. Who draws a figure, and
when, has no influence on its bytes; a figure that no worker could draw is drawn here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, zip_longest
from typing import Any

from magbear_cli.errors import Status
from magbear_cli.report.selection import MOST_CASES, OF_ONE_CASE, drawn, wanted_figures
from magbear_cli.report.series import Labels
from magbear_cli.report.sheet import Print
from magbear_cli.study.chores import Chores
from magbear_cli.study.outcome import CaseOutcome, StudyResults
from magbear_cli.study.plan import Case
from magbear_cli.study.runner import RunnerOptions, Shift

MOST_PARTS = 4  # of the figures about several cases: each is drawn from the whole study
LEAST_FIGURES = 8  # for fewer further processes, which take a second to start, do not pay
OF_A_CASE = "magbear_cli.report.printing:prints_of_case"
OF_THE_STUDY = "magbear_cli.report.printing:prints_of_study"


@dataclass(frozen=True)
class Names:
    """What the figures of one case know of the others: what tells them apart, and their names."""

    labels: Labels
    fellows: tuple[CaseOutcome, ...]

    @classmethod
    def of(cls, cases: Sequence[Case] | Sequence[CaseOutcome]) -> Names:
        """The names in a study of these cases."""
        known = [(case.id if isinstance(case, Case) else case.case_id, case.index, case.inputs) for case in cases]
        labels = Labels(CaseOutcome(*one, Status.FAILED) for one in known)
        return cls(labels, tuple(CaseOutcome(name, index, {}, Status.FAILED) for name, index, _ in known[:MOST_CASES]))

    def are_those_of(self, other: Names) -> bool:
        """Whether a figure would call everything the same."""
        mine, theirs = ([(case.case_id, case.index) for case in names.fellows] for names in (self, other))
        return mine == theirs and self.labels.distinctions == other.labels.distinctions


class Press:
    """The figures of a study whose cases are planned, drawn by the workers that its chores have."""

    def __init__(self, chores: Chores, cases: Sequence[Case], report: Mapping[str, Any], parts: int) -> None:
        """Take the study on; the figures about several cases will be dealt into so many parts."""
        self._chores = chores
        self._kinds = [kind for kind in wanted_figures(report) if kind in OF_ONE_CASE]
        self._names = Names.of(cases)
        self._places = {case.index for case in drawn(cases)}
        self._asked: set[int] = set()
        self._parts = min(parts, MOST_PARTS)

    def draws(self, index: int) -> bool:
        """Whether the case at this place gets figures of its own and has none yet."""
        return bool(self._kinds) and index in self._places and index not in self._asked

    def draw_ahead(self, outcome: CaseOutcome) -> None:
        """Have the figures of one case drawn, in the hope that the others end as planned: each somehow."""
        self._asked.add(outcome.index)
        for place, kind in enumerate(self._kinds):
            key = (outcome.index, place)
            self._chores.ask(key, OF_A_CASE, kind, outcome, self._names.fellows, self._names.labels)

    def prints(self, results: StudyResults) -> Iterator[Print]:
        """All figures of the study in their order, those that are not ahead drawn now."""
        outcomes = drawn(results.outcomes)
        names = Names.of(results.outcomes)
        if not names.are_those_of(self._names):  # some case is missing
            self._chores.forget()
            self._asked.clear()
            self._names = names
        for part in range(self._parts):
            self._chores.ask(("study", part), OF_THE_STUDY, results, part, self._parts)
        for outcome in outcomes:
            if outcome.index not in self._asked:
                self.draw_ahead(outcome)
        yield from self._about_several(results)
        for outcome in outcomes:
            for place, kind in enumerate(self._kinds):
                sheets = self._received((outcome.index, place))
                if sheets is None:
                    from magbear_cli.report.printing import prints_of_case  # noqa: PLC0415 - brings matplotlib along

                    sheets = prints_of_case(kind, outcome, names.fellows, names.labels)
                yield from sheets

    def _about_several(self, results: StudyResults) -> Iterator[Print]:
        parts = [self._received(("study", part)) for part in range(self._parts)]
        if any(part is None for part in parts):
            from magbear_cli.report.printing import prints_of_study  # noqa: PLC0415 - brings matplotlib along

            yield from prints_of_study(results, 0, 1)
            return
        # The figures were dealt in turn.
        dealt = chain.from_iterable(zip_longest(*(part or () for part in parts)))
        yield from (sheet for sheet in dealt if sheet is not None)

    def _received(self, key: object) -> tuple[Print, ...] | None:
        result = self._chores.result(key)
        return result if isinstance(result, tuple) else None


def printed(results: StudyResults, processes: int) -> Iterator[Print]:
    """The figures of a study in their order, drawn by so many processes where there are enough of them."""
    kinds = sum(kind in OF_ONE_CASE for kind in wanted_figures(results.report))
    if processes < 2 or kinds * len(drawn(results.outcomes)) < LEAST_FIGURES:
        from magbear_cli.report.printing import prints  # noqa: PLC0415 - brings matplotlib along

        yield from prints(results)
        return
    options = RunnerOptions(jobs=processes, memory_bytes=None, target=OF_A_CASE, warm_modules=())
    with Chores() as chores:
        chores.lend(Shift((), options, bool))
        yield from Press(chores, (), results.report, processes).prints(results)

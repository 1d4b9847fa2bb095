"""Figures drawn by several processes are those of one, and a lost process is told."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace
from importlib import import_module
from typing import Any

import psutil
import pytest

from magbear_cli.report.press import Names, Press, printed
from magbear_cli.report.printing import prints
from magbear_cli.study.chores import Chores
from magbear_cli.study.outcome import StudyResults
from magbear_cli.study.plan import Case

MakeCase = Callable[..., Any]
MakeStudy = Callable[..., Any]


def test_several_processes_draw_what_one_does(make_case: MakeCase, make_study: MakeStudy) -> None:
    """The same figures in the same order, to the last byte, however many draw them."""
    cases = [make_case(index, omega_c_rad_s=1e4 * (index + 1), steps=False) for index in range(8)]
    study = make_study(*cases, figures=("limitation", "poles"))
    alone = list(prints(study))
    assert len(alone) >= 9
    assert list(printed(study, 2)) == alone
    assert not psutil.Process().children(recursive=True)


def test_what_a_lost_process_drew_is_drawn_all_the_same(make_case: MakeCase, make_study: MakeStudy) -> None:
    """A process that is killed while it draws costs time, and no figure; none is left behind."""
    study = make_study(*(make_case(index, steps=False) for index in range(8)), figures=("poles",))
    sheets = printed(study, 2)
    first = next(sheets)
    for process in psutil.Process().children():
        process.kill()
    assert [first, *sheets] == list(prints(study))
    assert not psutil.Process().children(recursive=True)


class _Here(Chores):
    """Chores that are done at once and here, but for those that nobody does; what was asked for stays."""

    def __init__(self, *, undone: bool = False) -> None:
        super().__init__()
        self.asked: list[object] = []
        self.undone = undone

    def ask(self, key: Hashable, target: str, *arguments: object) -> None:
        super().ask(key, target, *arguments)
        self.asked.append(key)
        chore = self.take()
        assert chore is not None
        module, _, name = target.partition(":")
        self.end(chore.number, None if self.undone else getattr(import_module(module), name)(*arguments))


def _planned(study: StudyResults) -> list[Case]:
    return [Case(outcome.case_id, outcome.index, outcome.inputs) for outcome in study.outcomes]


@pytest.mark.parametrize("undone", [False, True])
def test_what_was_drawn_ahead_is_what_is_drawn_at_the_end(mixed_study: StudyResults, *, undone: bool) -> None:
    """Figures drawn from one case alone, in any order, are those of the whole study to the last byte, drawn once."""
    chores = _Here(undone=undone)
    press = Press(chores, _planned(mixed_study), mixed_study.report, 3)
    for outcome in mixed_study.outcomes[::-1]:
        assert press.draws(outcome.index)
        press.draw_ahead(outcome)
        assert not press.draws(outcome.index)
    assert list(press.prints(mixed_study)) == list(prints(mixed_study))
    assert len(set(chores.asked)) == len(chores.asked)


def test_what_was_drawn_ahead_of_another_study_is_drawn_anew(make_case: MakeCase, make_study: MakeStudy) -> None:
    """Where a planned case is missing at the end, names may have changed, and nothing drawn before is taken."""
    first, second, third = (make_case(index, omega_c_rad_s=1e4 * (index + 1), steps=False) for index in range(3))
    chores = _Here()
    press = Press(chores, _planned(make_study(first, second, third)), {"figures": ["poles"]}, 1)
    press.draw_ahead(first)
    study = make_study(first, third, figures=("poles",))
    assert list(press.prints(study)) == list(prints(study))
    assert chores.asked.count((0, 0)) == 2


def test_names_are_the_same_where_figures_would_be(make_case: MakeCase) -> None:
    """The plan of a study gives the names that its outcomes give; another option or another case gives others."""
    cases = [make_case(index, omega_c_rad_s=1e4 * (index + 1), steps=False) for index in range(3)]
    planned = [Case(case.case_id, case.index, case.inputs) for case in cases]
    assert Names.of(cases).are_those_of(Names.of(planned))
    assert not Names.of(cases[:2]).are_those_of(Names.of(planned))
    told = [
        replace(case, inputs={**case.inputs, "controller": {**case.inputs["controller"], "order": case.index}})
        for case in cases
    ]
    assert not Names.of(told).are_those_of(Names.of(planned))

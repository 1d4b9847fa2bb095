"""Figures drawn by several processes are those of one, and a lost process is told."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import psutil
import pytest

from magbear_cli.errors import ResumableError
from magbear_cli.report.press import printed_by_several
from magbear_cli.report.printing import prints

MakeCase = Callable[..., Any]
MakeStudy = Callable[..., Any]


def test_several_processes_draw_what_one_does(make_case: MakeCase, make_study: MakeStudy) -> None:
    """The same figures in the same order, to the last byte, however many draw them."""
    cases = [make_case(index, omega_c_rad_s=1e4 * (index + 1), steps=False) for index in range(8)]
    study = make_study(*cases, figures=("limitation", "poles"))
    alone = list(prints(study))
    assert len(alone) >= 9
    assert list(printed_by_several(study, 2)) == alone
    assert not psutil.Process().children(recursive=True)


def test_a_lost_process_is_told(make_case: MakeCase, make_study: MakeStudy) -> None:
    """A process that is killed while it draws ends the report in a sentence, and leaves none behind."""
    study = make_study(*(make_case(index, steps=False) for index in range(8)), figures=("poles",))
    sheets = printed_by_several(study, 2)
    next(sheets)
    for process in psutil.Process().children():
        process.kill()
    with pytest.raises(ResumableError, match="magbear report draws the figures again"):
        list(sheets)
    assert not psutil.Process().children(recursive=True)

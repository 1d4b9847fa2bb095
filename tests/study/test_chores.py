"""Chores keep no case waiting, are tried once, and go to the workers of the run, which go when the chores are over."""

from __future__ import annotations

from collections.abc import Callable

import psutil
import pytest

from magbear_cli.study.chores import Chores
from magbear_cli.study.events import CaseEnded, CaseStarted, Event
from magbear_cli.study.plan import Case
from magbear_cli.study.runner import RunnerOptions, Shift, run_cases

MakeCases = Callable[..., tuple[Case, ...]]
Options = Callable[..., RunnerOptions]
CHORE = "misbehaving:chore"


def _ended(events: list[Event]) -> int:
    return sum(isinstance(event, CaseEnded) for event in events)


def test_the_workers_of_a_run_do_its_chores(make_cases: MakeCases, options: Options) -> None:
    """They stay when the last case has ended, do what is asked before and after, and leave with the chores."""
    with Chores() as chores:
        chores.ask("before", CHORE, "answer", "1")
        events = list(run_cases(make_cases(*["answer"] * 3), options(), chores=chores))
        pids = {event.pid for event in events if isinstance(event, CaseStarted)}
        chores.ask("after", CHORE, "answer", "2")
        found = [chores.result(key) for key in ("after", "before")]
        assert [done[:2] for done in found if isinstance(done, tuple)] == [("answer", "2"), ("answer", "1")]
        assert {done[2] for done in found if isinstance(done, tuple)} <= pids
        assert chores.result("before") is None  # it is given once
    assert _ended(events) == 3
    assert not psutil.Process().children(recursive=True)


def test_an_idle_worker_does_chores_while_another_computes(make_cases: MakeCases, options: Options) -> None:
    """A chore asked for when the first case ends is done before the last one ends."""
    with Chores() as chores:
        for event in run_cases(make_cases("answer", "sleep:2"), options(), chores=chores):
            if isinstance(event, CaseEnded) and event.outcome.index == 0:
                chores.ask("early", CHORE, "answer", "")
        assert len(chores) == 0
        assert isinstance(chores.result("early"), tuple)


@pytest.mark.parametrize("act", ["segfault", "exit:3", "raise:other", "lambda", "garbage"])
def test_a_chore_that_fails_gives_nothing_and_stops_no_other(act: str, make_cases: MakeCases, options: Options) -> None:
    """Whatever it does to its worker, its result is None, the next chore is done, and no case is blamed."""
    name, _, argument = act.partition(":")
    with Chores() as chores:
        events = list(run_cases(make_cases("answer"), options(jobs=1), chores=chores))
        chores.ask("bad", CHORE, name, argument)
        chores.ask("good", CHORE, "answer", "")
        assert chores.result("bad") is None
        assert isinstance(chores.result("good"), tuple)
    assert _ended(events) == 1
    assert not psutil.Process().children(recursive=True)


def test_a_chore_that_hangs_is_killed(make_cases: MakeCases, options: Options, monkeypatch: pytest.MonkeyPatch) -> None:
    """At the limit of chores its worker is killed, and cases that come meanwhile end all the same."""
    monkeypatch.setattr("magbear_cli.study.runner.CHORE_LIMIT_S", 0.5)
    with Chores() as chores:
        chores.ask("bad", CHORE, "hang", "")
        events = list(run_cases(make_cases("answer", "sleep:1"), options(), chores=chores))
        assert chores.result("bad") is None
    assert _ended(events) == 2
    assert not psutil.Process().children(recursive=True)


def test_chores_without_workers_come_to_nothing(options: Options) -> None:
    """Where no worker can be started, and where there is no run, every result is None, in place of an error."""
    alone = Chores()
    alone.ask("one", CHORE, "answer", "")
    assert alone.result("one") is None
    with Chores() as chores:
        chores.lend(Shift((), options(target="misbehaving:absent"), bool))
        chores.ask("one", CHORE, "answer", "")
        chores.ask("two", CHORE, "answer", "")
        assert chores.result("two") is None
        assert chores.result("one") is None


def test_many_chores_get_as_many_workers_as_the_run_may_have(make_cases: MakeCases, options: Options) -> None:
    """A run of one case has one worker; when there is a lot to do without haste, the others are started."""
    with Chores() as chores:
        list(run_cases(make_cases("answer"), options(), chores=chores))
        for number in range(40):
            chores.ask(number, CHORE, "sleep", "0.05")
        found = [chores.result(number) for number in range(40)]
        assert len({done[2] for done in found if isinstance(done, tuple)}) == 2


def test_a_run_that_was_stopped_computes_nothing_more(make_cases: MakeCases, options: Options) -> None:
    """Chores after a stop neither wait for cases that were running nor begin others."""
    with Chores() as chores:
        events = list(
            run_cases(make_cases("raise:other", "sleep:60", "answer"), options(fail_fast=True), chores=chores)
        )
        chores.ask("one", CHORE, "answer", "")
        assert isinstance(chores.result("one"), tuple)
    assert _ended(events) == 1


def test_what_is_forgotten_is_not_done(make_cases: MakeCases, options: Options) -> None:
    """Chores that nobody has begun are dropped, and so is what came of the others."""
    with Chores() as chores:
        list(run_cases(make_cases("answer"), options(), chores=chores))
        chores.ask("one", CHORE, "answer", "")
        chores.forget()
        assert len(chores) == 0
        assert chores.result("one") is None


def test_chores_without_a_run_are_left_alone() -> None:
    """Glancing at chores that have no workers is no error."""
    chores = Chores()
    chores.glance()
    assert not chores.has_workers

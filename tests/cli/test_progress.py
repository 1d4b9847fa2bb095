"""What a run tells of itself, and where."""

from __future__ import annotations

import sys
from collections.abc import Callable

import pytest

from magbear_cli.cli.progress import LINE_EVERY_S, Lines, Quiet, _pace, open_activity, open_progress


class _Clock:
    """Time that the test makes."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def told(capsys: pytest.CaptureFixture[str]) -> Callable[[], list[str]]:
    """The lines on standard error since the last look; standard output must stay empty."""

    def look() -> list[str]:
        out, err = capsys.readouterr()
        assert out == ""
        return err.splitlines()

    return look


def test_a_line_comes_every_ten_seconds_even_when_no_case_ends(told: Callable[[], list[str]]) -> None:
    """Silence never lasts longer than the period, and lines never come faster."""
    clock = _Clock()
    lines = Lines(3, clock)
    for _ in range(250):
        clock.now += 0.1
        lines.tick()
    assert told() == ["0 of 3 cases", "0 of 3 cases"]
    lines.ended("ok")
    assert told() == []
    clock.now += LINE_EVERY_S
    lines.tick()
    assert told() == ["1 of 3 cases: 1 ok; 1.71/min, 70 s left"]


@pytest.mark.parametrize(
    ("done", "total", "seconds", "words"),
    [
        (0, 10, 5.0, ""),
        (10, 10, 5.0, ""),
        (10, 30, 4.0, "2.5/s, 8 s left"),
        (10, 100, 200.0, "3/min, 30 min left"),
        (2, 10, 7200.0, "1/h, 8.0 h left"),
    ],
)
def test_the_pace_is_a_number_to_read(done: int, total: int, seconds: float, words: str) -> None:
    """Cases a second, a minute or an hour, and what is left in a fitting unit."""
    assert _pace(done, total, seconds) == words


def test_the_last_case_is_told_at_once(told: Callable[[], list[str]]) -> None:
    """The counts by status are complete at the end."""
    lines = Lines(3)
    for status in ("ok", "timeout", "ok"):
        lines.ended(status)
    assert told() == ["3 of 3 cases: 2 ok, 1 timeout"]


@pytest.mark.parametrize(
    ("is_terminal", "term", "wanted", "kind"),
    [
        (False, "xterm", None, Quiet),
        (False, "xterm", False, Quiet),
        (False, "xterm", True, Lines),
        (True, "dumb", None, Lines),
        (True, "dumb", True, Lines),
        (True, "xterm", False, Quiet),
        (True, "xterm", None, None),
    ],
)
def test_progress_is_shown_where_it_is_wanted(
    monkeypatch: pytest.MonkeyPatch, *, is_terminal: bool, term: str, wanted: bool | None, kind: type | None
) -> None:
    """A bar only on a screen that can show it, lines where they are asked for, nothing elsewhere."""
    monkeypatch.setenv("TERM", term)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: is_terminal)
    with open_progress(2, wanted=wanted) as progress:
        assert kind is None or type(progress) is kind
        assert (kind is None) == (type(progress).__name__ == "Bar")
        progress.tick()
        progress.ended("ok")
        progress.say("a sentence with [brackets]")


def test_a_sentence_is_said_in_any_case(told: Callable[[], list[str]]) -> None:
    """Quiet progress keeps quiet of cases and not of trouble."""
    with open_progress(2, wanted=False) as progress:
        progress.ended("ok")
        progress.tick()
        progress.say("trouble")
    assert told() == ["trouble"]


@pytest.mark.parametrize(("wanted", "lines"), [(None, []), (False, []), (True, ["drawing"])])
def test_an_activity_is_a_line_when_it_is_asked_for(
    told: Callable[[], list[str]], *, wanted: bool | None, lines: list[str]
) -> None:
    """Without a terminal an activity is one line or none."""
    with open_activity("drawing", wanted=wanted) as step:
        assert step is None
    assert told() == lines

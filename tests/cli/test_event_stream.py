"""A run tells programs what happens, a JSON line an event."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from magbear_cli.cli.event_stream import open_events
from magbear_cli.errors import InputError

Command = Callable[..., Any]
FACTS = {
    "run began": {"study", "output", "cases", "missing"},
    "case started": {"case", "index", "attempt"},
    "case ended": {"case", "index", "status", "attempts", "seconds"},
    "run ended": {"exit_code"},
}


@pytest.mark.usefixtures("quick_report")
def test_every_event_is_a_line_with_its_keys(command: Command, tiny: Path, tmp_path: Path) -> None:
    """From the beginning to the exit code, each case once, with the keys that the README names."""
    ended = command("run", tiny, "--events", "events.jsonl")
    assert ended.code == 0, ended.err
    events = [json.loads(line) for line in (tmp_path / "events.jsonl").read_text("utf-8").splitlines()]
    assert [event["event"] for event in (events[0], events[-1])] == ["run began", "run ended"]
    assert [event["event"] for event in events].count("case ended") == 2
    for event in events:
        assert event["schema"] == 1
        assert FACTS[event["event"]] <= set(event)
    again = command("run", tiny, "--events", "-")
    assert [json.loads(line)["event"] for line in again.out.splitlines()] == ["run began", "run ended"]


def test_a_file_that_cannot_be_opened_is_told() -> None:
    """The place of the events is checked before anything is computed."""
    with pytest.raises(InputError, match="--events /proc/nowhere/x"), open_events("/proc/nowhere/x"):
        pass


def test_a_reader_that_goes_does_not_end_the_run(tmp_path: Path) -> None:
    """Events into a pipe whose reader has gone are nobody's loss."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: pipe.open("rb").close())
    reader.start()
    with open_events(str(pipe)) as events:
        reader.join()
        events.tell("run began")
        events.tell("run ended")

"""What a row of the benchmark is, how its sides are timed by turns, and what is kept of it."""

from __future__ import annotations

import gc
import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from importlib.metadata import PackageNotFoundError, version
from statistics import median
from typing import Any

PACKAGES = ("magbear", "numpy", "scipy", "control", "slycot", "clarabel", "dkpy", "cvxpy", "ctrlsys", "joblib", "click")
AT_LEAST_S = 0.05  # a quick work is repeated within a sample until this has passed


@dataclass(frozen=True)
class Side:
    """One way of doing the work of a row.

    ``run`` does it once and gives its answer. ``amount`` is how much of the row's work that is (64 for a batch of 64
    cases, 0.02 for 20 of 1 000 frequencies). ``warm_up`` is done once before, untimed: imports and caches.
    """

    name: str
    run: Callable[[], Any]
    amount: float = 1.0
    warm_up: Callable[[], object] | None = None


@dataclass(frozen=True)
class Goal:
    """``peer`` takes at least ``factor`` times as long as ``ours`` for the same amount.

    With ``at_most`` the ratio of ours to the peer must not exceed the factor.
    """

    ours: str
    peer: str
    factor: float
    at_most: bool = False

    def ratio(self, seconds: Mapping[str, float]) -> float:
        """How many times as long the peer takes; for ``at_most`` how many times as long ours takes."""
        peer, ours = seconds[self.peer], seconds[self.ours]
        return ours / peer if self.at_most else peer / ours

    def is_met(self, seconds: Mapping[str, float]) -> bool:
        """Whether the goal is reached."""
        return self.ratio(seconds) <= self.factor if self.at_most else self.ratio(seconds) >= self.factor


@dataclass(frozen=True)
class Prepared:
    """The sides of a row on one and the same problem, and what is true of their answers.

    ``errors`` takes the answers by side and gives, by side, each error against a reference of higher precision (or
    what else is true of an answer) by name. ``floor`` takes the seconds by side and says what bounds the time of ours.
    """

    sides: Sequence[Side]
    errors: Callable[[Mapping[str, Any]], Mapping[str, Mapping[str, float]]]
    floor: Callable[[Mapping[str, float]], str]


@dataclass(frozen=True)
class Row:
    """A row of the table: its work in words, its goals, how it is prepared, and why a goal is missed where it is.

    ``prepare`` takes whether the problem is to be tiny: for a test of the answers, not of the times.
    """

    name: str
    work: str
    goals: Sequence[Goal]
    prepare: Callable[[bool], Prepared]
    needs: Sequence[str] = ()
    missed_because: Mapping[str, str] = field(default_factory=dict)  # by peer


def measure(row: Row, repeats: int, say: Callable[[str], None], *, tiny: bool = False) -> dict[str, Any]:
    """The document of a row: every sample, errors and floor.

    The sides take turns, so that a busy machine is busy for all.
    """
    prepared = row.prepare(tiny)
    answers = {}
    for side in prepared.sides:
        answers[side.name] = (side.warm_up or side.run)()
    samples = []
    for repeat in range(repeats):
        for side in prepared.sides:
            seconds, runs, answers[side.name] = sample(side, 0.0 if tiny else AT_LEAST_S)
            samples.append({"side": side.name, "repeat": repeat, "seconds": seconds / side.amount, "runs": runs})
            say(f"{row.name} {repeat + 1}/{repeats} {side.name}: {seconds / side.amount:.6g} s")
    errors = {name: dict(found) for name, found in prepared.errors(answers).items()}
    return {
        "row": row.name,
        "work": row.work,
        "goals": [asdict(goal) for goal in row.goals],
        "machine": machine(),
        "errors": errors,
        "floor": prepared.floor(medians(samples)),
        "samples": samples,
    }


def sample(side: Side, at_least_s: float) -> tuple[float, int, Any]:
    """Seconds of one run, on the mean of as many as fill a while; how many; the last answer."""
    runs, answer = 0, None
    gc.collect()
    start = time.perf_counter()
    while runs == 0 or time.perf_counter() - start < at_least_s:
        answer = side.run()
        runs += 1
    return (time.perf_counter() - start) / runs, runs, answer


def medians(samples: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """The median of the seconds of each side."""
    names = dict.fromkeys(one["side"] for one in samples)
    return {name: median(one["seconds"] for one in samples if one["side"] == name) for name in names}


def missing(row: Row) -> list[str]:
    """The packages that a row needs and that are not installed."""
    return [name for name in row.needs if _version(name) is None]


def machine() -> dict[str, Any]:
    """What the samples were taken on and with."""
    load = os.getloadavg() if hasattr(os, "getloadavg") else None
    about = {"platform": platform.platform(), "python": platform.python_version(), "cores": os.cpu_count()}
    return {**about, "load": load, "versions": {name: _version(name) for name in PACKAGES}}


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None

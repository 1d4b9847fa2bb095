"""The cases that a claim rests on, found by their inputs; every number that is read from them is noted by its place.

What is asked of a case is what ``results.h5`` holds of it, so that each note names a dataset of that file.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import MagbearError, Status
from magbear_cli.study.outcome import CaseOutcome, StepOutcome, StudyResults

Floats = NDArray[np.float64]
Where = Mapping[str, Any]

NEAR = 1e-9  # relative: numbers of a selection and of a case that count as the same
CALM = 1e-3  # of the largest excursion: what swings less has come to rest
ANY = "any"  # of a selected key: whatever is there, but not nothing


class MissingEvidenceError(MagbearError):
    """A case, or a number of it, that a claim needs is not there."""


@dataclass
class Evidence:
    """What a claim may look at: the studies at hand, its printed figures and tolerances, and what was read."""

    studies: Mapping[str, StudyResults]
    cases: Mapping[str, Where]  # what the claim calls its cases, and how they are found
    printed: Mapping[str, float] = field(default_factory=dict)  # the thesis's figures, by name
    tolerance: Mapping[str, float] = field(default_factory=dict)  # how near is near enough, by name
    read: dict[str, None] = field(default_factory=dict)  # paths of datasets, in the order in which they were read

    def one(self, name: str) -> Case:
        """The first of the cases that the claim knows under this name.

        Raises
        ------
        MissingEvidenceError
            when there is none.
        """
        return self.all(name)[0]

    def all(self, name: str) -> list[Case]:
        """All of them, in the order of their study.

        Raises
        ------
        MissingEvidenceError
            when there is none.
        """
        found = list(self._found(self.cases[name]))
        if not found:
            raise MissingEvidenceError(f"no case is there for '{name}': {dict(self.cases[name])}")
        return found

    def is_near(self, value: float, name: str) -> bool:
        """Whether a value is the printed figure of this name, to the relative tolerance of the same name."""
        return abs(value - self.printed[name]) <= self.tolerance[name] * abs(self.printed[name])

    def _found(self, where: Where) -> Iterator[Case]:
        study = str(where["study"])
        wanted = {key: value for key, value in where.items() if key != "study"}
        for outcome in self.studies[study].outcomes if study in self.studies else ():
            if is_like(outcome.inputs, wanted):
                yield Case(outcome, f"{study}/results.h5:/case_{outcome.index + 1:04d}", self)


@dataclass(frozen=True)
class Case:
    """A case as a claim sees it."""

    outcome: CaseOutcome
    place: str
    evidence: Evidence

    @property
    def status(self) -> Status:
        """How it ended; a case without an answer is no evidence.

        Raises
        ------
        MissingEvidenceError
            when it has none.
        """
        self._note("status")
        if not self.outcome.status.is_answer:
            raise MissingEvidenceError(f"{self.place} is {self.outcome.status.value}: {self.outcome.sentence}")
        return self.outcome.status

    def figure(self, name: str) -> float:
        """A number of the summary; infinite for a level that has no value because the loop is unstable."""
        value = getattr(self.outcome.summary, name)
        if value is None and self.status is Status.UNSTABLE:
            return np.inf
        return self._number(f"summary/{name}", value)

    def statistic(self, name: str) -> float:
        """A statistic of the method or of the judgement."""
        return self._number(f"statistics/value[{name}]", self.outcome.statistics.get(name))

    def table(self, name: str, column: str) -> Floats:
        """A column of one of its tables."""
        table = self.outcome.tables.get(name)
        if table is None or column not in {entry.name for entry in table.columns}:
            raise MissingEvidenceError(f"{self.place} ({self.outcome.status.value}) has no {name}/{column}")
        self._note(f"tables/{name}/{column}")
        return table[column]

    def curve(self, name: str) -> Floats:
        """An array of the study over frequency, such as ``mu_upper``; magnitudes of what is complex."""
        if self.outcome.frequency is None:
            raise MissingEvidenceError(f"{self.place} ({self.outcome.status.value}) has no frequency study")
        self._note(f"frequency/{name}")
        return np.asarray(np.abs(getattr(self.outcome.frequency, name)), dtype=float)

    def poles_rad_s(self) -> NDArray[np.complex128]:
        """The closed-loop poles along the masses, (k, n)."""
        if self.outcome.poles is None:
            raise MissingEvidenceError(f"{self.place} ({self.outcome.status.value}) has no poles")
        self._note("poles/poles_rad_s")
        return self.outcome.poles.poles_rad_s

    def step(self, **where: Any) -> Run:  # noqa: ANN401 - the values of a scenario
        """The first simulated run whose scenario is like this.

        Raises
        ------
        MissingEvidenceError
            when there is none.
        """
        return self.steps(**where)[0]

    def steps(self, **where: Any) -> list[Run]:  # noqa: ANN401 - the values of a scenario
        """All runs whose scenario is like this, in their order.

        Raises
        ------
        MissingEvidenceError
            when there is none.
        """
        found = [
            Run(step, f"{self.place}/steps/step_{number:02d}", self.evidence)
            for number, step in enumerate(self.outcome.steps, 1)
            if is_like(step.scenario, where)
        ]
        if not found:
            raise MissingEvidenceError(f"{self.place} ({self.outcome.status.value}) has no run like {where}")
        return found

    def _number(self, name: str, value: float | None) -> float:
        if value is None:
            raise MissingEvidenceError(f"{self.place} ({self.outcome.status.value}) has no {name}")
        self._note(name)
        return float(value)

    def _note(self, name: str) -> None:
        self.evidence.read[f"{self.place}/{name}"] = None


@dataclass(frozen=True)
class Run:
    """A simulated run as a claim sees it."""

    step: StepOutcome
    place: str
    evidence: Evidence

    @property
    def ended_well(self) -> bool:
        """Whether it went to its end within the gap."""
        self._note("end")
        return self.step.end == "finished"

    @property
    def is_stable(self) -> bool:
        """Whether it went to its end without swinging wider in each of its last three fifths.

        A slow return to rest may cover more ground in the last fifth than in the one before; it does not do so twice.
        """
        if not self.ended_well:
            return False
        time, position = self.curve("time_s"), self.curve("position_m")
        fifths = [(time >= begin * time[-1]) & (time <= (begin + 0.2) * time[-1]) for begin in (0.4, 0.6, 0.8)]
        first, before, last = (float(np.ptp(position[fifth])) for fifth in fifths)
        return not first < before < last or last <= CALM * float(np.abs(position).max())

    def settled_s(self, band: float) -> float:
        """When it stays within a band of its step, a part of the step, for good; infinite when it does not."""
        if not self.ended_well:
            return np.inf
        time, distance = self.curve("time_s"), np.abs(self.curve("position_m") / self.step.step_m - 1.0)
        outside = np.flatnonzero(distance > band)
        if not outside.size:
            return 0.0
        return float(time[outside[-1] + 1]) if outside[-1] + 1 < time.size else np.inf

    def figure(self, name: str) -> float:
        """A figure of the run; infinite where it has none because the run ended early or did not settle."""
        value = getattr(self.step, name)
        self._note(name)
        return np.inf if value is None else float(value)

    def curve(self, name: str) -> Floats:
        """An array over time, such as ``position_m``."""
        self._note(name)
        return np.asarray(getattr(self.step, name), dtype=float)

    def largest_error_m(self, begin: float = 0.0) -> float:
        """The largest distance from the reference from this fraction of the run on; infinite after an early end."""
        if not self.ended_well:
            return np.inf
        time = self.curve("time_s")
        late = time >= begin * time[-1]
        return float(np.abs(self.curve("position_m") - self.curve("reference_m"))[late].max())

    def _note(self, name: str) -> None:
        self.evidence.read[f"{self.place}/{name}"] = None


def is_like(inputs: Mapping[str, Any], where: Where) -> bool:
    """Whether inputs have, at each dotted key, the value asked for."""
    return all(_same(_at(inputs, key), value) for key, value in where.items())


def crossing(levels: Floats, places: Floats, level: float = 1.0) -> float:
    """Where a quantity first crosses a level, by interpolation on logarithmic places; NaN where it does not."""
    order = np.argsort(places)
    pairs = list(zip(places[order], levels[order], strict=True))
    for (x1, y1), (x2, y2) in pairwise(pairs):
        if (y1 - level) * (y2 - level) <= 0.0 and y1 != y2:
            share = (level - y1) / (y2 - y1)
            return float(np.exp(np.log(x1) + share * (np.log(x2) - np.log(x1))))
    return float("nan")


def _at(inputs: Any, key: str) -> Any:  # noqa: ANN401 - plain values
    for part in key.split("."):
        if isinstance(inputs, list) and part.isdecimal():
            inputs = inputs[int(part)] if int(part) < len(inputs) else None
        else:
            inputs = inputs.get(part) if isinstance(inputs, Mapping) else None
    return inputs


def _same(value: Any, wanted: Any) -> bool:  # noqa: ANN401 - plain values
    if wanted == ANY:
        return value is not None
    if isinstance(wanted, list) and isinstance(value, list | tuple):
        return len(value) == len(wanted) and all(_same(*pair) for pair in zip(value, wanted, strict=True))
    if isinstance(wanted, Mapping) and isinstance(value, Mapping):
        return is_like(value, wanted)
    numbers = (int, float)
    if isinstance(value, numbers) and isinstance(wanted, numbers) and not isinstance(value, bool):
        return abs(value - wanted) <= NEAR * max(abs(value), abs(wanted))
    return bool(value == wanted)

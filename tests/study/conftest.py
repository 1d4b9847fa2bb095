"""Shared by the tests of the study room: cases, a runner with short limits, and targets that misbehave."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest

from magbear_cli.spec import read_study_text
from magbear_cli.study.events import CaseEnded, Event
from magbear_cli.study.plan import Case, plan_cases
from magbear_cli.study.runner import RunnerOptions, run_cases

TARGETS = Path(__file__).parent / "targets"

STUDY = """\
magbear: 1
name: small
bearing: thesis_thrust
mass_kg: [3.0, 4.5]
performance: {dc_gain: 10, corner_rad_s: 200}
bandwidth: {omega_c_rad_s: 20000}
controller: {method: lqg}
simulate: [{step_m: 10.0e-6, masses_kg: [3.6], samples: 21}]
"""


def inputs_of(act: str, number: int = 0) -> dict[str, Any]:
    """Inputs that ask the misbehaving target for one of its acts."""
    return {"act": act, "number": number, "controller": {"method": "none"}, "mass_kg": 3.0}


@pytest.fixture(scope="session")
def resolved() -> Callable[..., dict[str, Any]]:
    """A function from overrides (``key=value``) to the resolved inputs of a small case of the thesis's bearing.

    What comes by name replaces a part of the resolved inputs as it is, so that a test can ask for what no study may.
    """

    def resolve(*overrides: str, **parts: object) -> dict[str, Any]:
        (inputs,) = read_study_text(STUDY, "the test", overrides).cases()
        return {**inputs, **parts}

    return resolve


@pytest.fixture
def make_cases() -> Callable[..., tuple[Case, ...]]:
    """A function from acts to cases, numbered so that they differ."""
    return lambda *acts: plan_cases(inputs_of(act, number) for number, act in enumerate(acts))


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[Event]]:
    """A function that runs cases on the misbehaving target and gives every event."""
    monkeypatch.setenv("PYTHONPATH", str(TARGETS))

    def run_with(cases: tuple[Case, ...], **limits: object) -> list[Event]:
        return list(run_cases(cases, misbehaving(**limits)))

    return run_with


def misbehaving(**limits: object) -> RunnerOptions:
    """Options for the misbehaving target: a cold start, limits of a test."""
    settings: dict[str, Any] = {"target": "misbehaving:act", "warm_modules": (), "timeout_s": 60.0, "jobs": 2, **limits}
    return RunnerOptions(**settings)


@pytest.fixture
def options(monkeypatch: pytest.MonkeyPatch) -> Callable[..., RunnerOptions]:
    """A function from limits to options for the misbehaving target, which is made importable for workers."""
    monkeypatch.setenv("PYTHONPATH", str(TARGETS))
    return misbehaving


@pytest.fixture
def outcomes() -> Callable[[list[Event]], list[Any]]:
    """A function from events to outcomes, in the order of the study."""
    return lambda events: sorted(
        (event.outcome for event in events if isinstance(event, CaseEnded)), key=lambda outcome: outcome.index
    )


@pytest.fixture(autouse=True)
def _no_orphans() -> Iterator[None]:
    """Every test must leave this process without children it did not have."""
    before = {child.pid for child in psutil.Process().children(recursive=True)}
    yield
    left = [child for child in psutil.Process().children(recursive=True) if child.pid not in before]
    assert not left, f"processes left behind: {left}"

"""The three best controllers of the quickstart, ready to be handed over."""

from __future__ import annotations

import runpy
from collections.abc import Callable
from pathlib import Path

import pytest

from magbear_cli.export.handover import Handover
from magbear_cli.spec import read_study
from magbear_cli.study.pipeline import run_case
from magbear_cli.study.plan import case_id
from magbear_cli.study.sampling import SamplingOptions, sample_design

QUICKSTART = Path(__file__).parents[2] / "studies" / "quickstart.yaml"
SAMPLE_TIME_S = 2.0e-5


@pytest.fixture(scope="session")
def continuous() -> list[Handover]:
    """Near the optimum, a lead, and order two: as designed."""
    study = read_study(QUICKSTART)
    handovers = []
    for index in range(3):
        inputs = {**study.case(index), "simulate": []}
        outcome = run_case(inputs, case_id(inputs), index)
        assert outcome.controller is not None
        handovers.append(Handover(f"quickstart_{index}", study.name, outcome, outcome.controller))
    return handovers


@pytest.fixture(scope="session")
def sampled(continuous: list[Handover]) -> list[Handover]:
    """The same at 50 kHz with a delay of one sample."""
    return [
        Handover(
            one.name, one.study, one.outcome, one.controller, sample_design(one.outcome, SamplingOptions(SAMPLE_TIME_S))
        )
        for one in continuous
    ]


@pytest.fixture
def run_script() -> Callable[[Path], dict[str, object]]:
    """What a script defines when it is run."""

    def run(path: Path) -> dict[str, object]:
        return runpy.run_path(str(path))

    return run

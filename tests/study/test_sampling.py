"""Controllers of cases, sampled: what is accepted, what is refused, and how slow sampling may be."""

from __future__ import annotations

from dataclasses import replace

import pytest

from magbear_cli.errors import NumericsError
from magbear_cli.spec import read_study_text
from magbear_cli.study.outcome import CaseOutcome
from magbear_cli.study.pipeline import run_case
from magbear_cli.study.sampling import SamplingOptions, problem_of, sample_design, slowest_sample_time

STUDY = """\
magbear: 1
name: one
bearing: thesis_thrust
mass_kg: [3.0, 4.5]
performance: {dc_gain: 10, corner_rad_s: 200}
bandwidth: {omega_c_rad_s: 20000}
controller: {method: fixed_order, order: 1}
"""


@pytest.fixture(scope="module")
def outcome() -> CaseOutcome:
    """The lead of the quickstart."""
    (inputs,) = read_study_text(STUDY, "study.yaml").cases()
    return run_case(inputs, "lead", 0)


def test_a_fast_sampling_is_accepted_with_its_losses(outcome: CaseOutcome) -> None:
    """At 50 kHz the loop is proven to hold 1, a quarter worse than before; every figure of the document is a number."""
    design = sample_design(outcome, SamplingOptions(2e-5))
    assert design.is_accepted
    assert outcome.summary.worst_case is not None
    document = design.document()
    assert outcome.summary.worst_case < document["worst_case"] < 0.6
    assert document["worst_case"] <= document["worst_case_proven"] <= 1.0
    assert document["delay_s"] == document["sample_time_s"] == 2e-5
    assert document["max_pole_modulus"] < 1.0
    assert all(value is not None for value in document.values())


def test_the_slowest_that_would_do_does_and_a_little_slower_does_not(outcome: CaseOutcome) -> None:
    """What is offered in place of a sampling that is too slow is accepted; 3 % slower is not."""
    too_slow = SamplingOptions(5e-4)
    assert not sample_design(outcome, too_slow).is_accepted
    slowest = slowest_sample_time(outcome, too_slow)
    assert slowest is not None
    assert sample_design(outcome, SamplingOptions(slowest)).is_accepted
    assert not sample_design(outcome, SamplingOptions(1.03 * slowest)).is_accepted


def test_less_delay_allows_slower_sampling(outcome: CaseOutcome) -> None:
    """Without a computation delay the slowest sampling is slower than with one of a sample."""
    late, prompt = (slowest_sample_time(outcome, SamplingOptions(5e-4, delay)) for delay in (None, 0.0))
    assert late is not None
    assert prompt is not None
    assert prompt > 1.5 * late


def test_the_limit_is_the_specification_or_what_there_was(outcome: CaseOutcome) -> None:
    """A loop with room may use it; one without may lose a tenth; a limit given counts."""
    assert sample_design(outcome, SamplingOptions(2e-5)).limit == 1.0
    tight = replace(outcome, summary=replace(outcome.summary, worst_case=0.99))
    assert sample_design(tight, SamplingOptions(2e-5)).limit == pytest.approx(1.089)
    refused = sample_design(outcome, SamplingOptions(2e-5, limit=0.45))
    assert not refused.is_accepted
    assert "above 0.45" in refused.sentence


def test_nothing_fast_enough_is_none(outcome: CaseOutcome) -> None:
    """A limit below what the continuous loop has is met by no sampling."""
    assert slowest_sample_time(outcome, SamplingOptions(2e-5, limit=0.3)) is None


def test_without_a_controller_there_is_nothing_to_sample(outcome: CaseOutcome) -> None:
    """A case that found no controller says so; a limit's controller belongs to the limit that it meets."""
    with pytest.raises(NumericsError, match="no linear controller"):
        sample_design(replace(outcome, controller=None), SamplingOptions(2e-5))
    met = replace(outcome, summary=replace(outcome.summary, omega_c_feasible_rad_s=5091.0))
    assert problem_of(met).omega_c_rad_s == 5091.0

"""Fuzzing: whatever a file holds, reading it ends in a study or in a StudyError with places."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.spec.files import decode
from magbear_cli.spec.problems import CODES, Faults, Problem, StudyError
from magbear_cli.spec.study import read_study_text

FRAGMENTS = [
    *("[", "]", "{", "}", ":", ": ", ", ", "- ", "? ", "#", "&a ", "*a", "!!int ", "|", ">", "'", '"', "%", "@", "`"),
    *("\n", "\n  ", "\t", "\r", "\u2028", "\u00a0", "\ufeff", "\\", "---\n", "...\n", "<<: ", "null", "true", "on"),
    *("1e3", "010", ".nan", "-", "1_0", "0x", "1,5", "1.5 kg", "−1", "sweep", "magbear", "controller.order", "mass_kg"),
]


def problems_of(text: str, *overrides: str) -> tuple[Problem, ...]:
    """What is wrong with a text; nothing else than a StudyError may come out."""
    try:
        study = read_study_text(text, "fuzz.yaml", overrides)
    except StudyError as error:
        str(error).encode("utf-8")
        return error.problems
    assert study.case_count >= 1
    return ()


def check(problems: tuple[Problem, ...]) -> None:
    """Every problem has a code that is explained, a sentence, and a place that starts at 1."""
    for problem in problems:
        assert problem.code in CODES
        assert problem.sentence
        assert problem.line is None or problem.line >= 1
        assert problem.column is None or problem.column >= 1
        assert "Error" not in problem.sentence


@settings(deadline=None, max_examples=200)
@given(st.text(max_size=60))
def test_random_text_is_refused_with_a_sentence(text: str) -> None:
    """No text raises anything else."""
    problems = problems_of(text)
    assert problems
    check(problems)


@settings(deadline=None, max_examples=200)
@given(st.binary(max_size=60))
def test_random_bytes_are_refused_with_a_sentence(data: bytes) -> None:
    """Bytes are text or a fault."""
    faults = Faults()
    text = decode(data, "fuzz.yaml", faults)
    if text is None:
        assert len(faults) == 1
    else:
        check(problems_of(text))


@settings(deadline=None, max_examples=200)
@given(st.lists(st.sampled_from(FRAGMENTS), max_size=25))
def test_fragments_of_yaml_are_refused_with_a_sentence(fragments: list[str]) -> None:
    """Every way to break the syntax."""
    check(problems_of("".join(fragments)))


@pytest.mark.parametrize("seed", range(8))
def test_a_mutated_study_is_read_or_refused(seed: int, studies: Path, base: str) -> None:
    """Cutting, doubling, exchanging and inserting in legal studies never ends in anything else."""
    chance = random.Random(seed)  # noqa: S311 - a reproducible walk, not a secret
    texts = [base, *(path.read_text(encoding="utf-8") for path in sorted(studies.glob("*.yaml")))]
    for _ in range(40):
        text = chance.choice(texts)
        for _ in range(chance.randint(1, 3)):
            start = chance.randrange(len(text))
            stop = min(len(text), start + chance.choice([1, 1, 2, 5, 20]))
            piece = chance.choice([*FRAGMENTS, text[start:stop] * 2, ""])
            text = text[:start] + piece + text[stop:]
        check(problems_of(text))


@settings(deadline=None, max_examples=120)
@given(
    key=st.one_of(
        st.sampled_from(["mass_kg", "mass_kg.1", "controller", "controller.order", "sweep", "sweep.mass_kg", "name"]),
        st.text(max_size=10),
    ),
    value=st.one_of(st.text(max_size=12), st.lists(st.sampled_from(FRAGMENTS), max_size=5).map("".join)),
)
def test_a_random_override_is_taken_or_refused(key: str, value: str, base: str) -> None:
    """The command line is no safer than the file."""
    check(problems_of(base, f"{key}={value}"))

"""Tests of the YAML layer: what is not plain data, written once, is refused with its place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
import yaml

from magbear_cli.spec.nodes import plain
from magbear_cli.spec.problems import Faults, Problem
from magbear_cli.spec.reading import DEEPEST, read_nodes

Refused = Callable[..., tuple[Problem, ...]]


def value_of(text: str) -> Any:  # noqa: ANN401 - YAML holds anything
    """The plain data in a text that is legal YAML."""
    faults = Faults()
    node = read_nodes(text, "text", faults)
    faults.stop()
    assert node is not None
    return plain(node)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e3", 1000.0),
        ("1e-3", 0.001),
        ("1.0e3", 1000.0),
        ("1e+3", 1000.0),
        (".5", 0.5),
        ("5.", 5.0),
        ("12e03", 12000.0),
        ("-0", 0),
        ("0x1F", 31),
        ("0o17", 15),
        ("0b1", "0b1"),
        ("1_000", "1_000"),
        ("1:30", "1:30"),
        ("on", "on"),
        ("off", "off"),
        ("yes", "yes"),
        ("no", "no"),
        ("y", "y"),
        ("~", None),
        ("null", None),
        ("true", True),
        ("False", False),
        ("2026-11-22", "2026-11-22"),
        ("2026-13-45", "2026-13-45"),
        ("'1e3'", "1e3"),
        ('"010"', "010"),
        ("nan", "nan"),
        ("=", "="),
    ],
)
def test_a_scalar_is_read_by_the_core_schema_of_yaml_1_2(text: str, value: object) -> None:
    """Numbers are numbers, words are words, and nothing is a date."""
    found = value_of(f"k: {text}\n")["k"]
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("010", "E109"),
        ("-007", "E109"),
        ("00.5", "E109"),
        (".nan", "E109"),
        (".inf", "E109"),
        ("-.inf", "E109"),
        ("1e400", "E109"),
        ("-1e400", "E109"),
        ("1e-400", "E109"),
        ("1" * 5000, "E109"),
        ("1" * 350, "E109"),
        ("0x" + "f" * 300, "E109"),
        ('!!int ""', "E108"),
        ("!!float x", "E108"),
        ('!!timestamp "x"', "E108"),
        ("!!bool x", "E108"),
        ("!!python/object/apply:os.system [ls]", "E108"),
        ("!mine 3", "E108"),
        ("! 3", "E108"),
        ("&x 3", "E108"),
        ("*x", "E108"),
        ("&x [*x]", "E108"),
        ("{<<: {a: 1}}", "E108"),
        ("{5: 1}", "E108"),
        ("{true: 1}", "E108"),
        ("{~: 1}", "E108"),
        ("{[1, 2]: 1}", "E108"),
        ("{{a: 1}: 1}", "E108"),
        ("{a: 1, a: 2}", "E107"),
        ("[1, 2", "E101"),
        ("{a: 1", "E101"),
        ('"never closed', "E101"),
        ('"\\x"', "E101"),
        ('"\\UFFFFFFFF"', "E101"),
        ('"\\0"', "E111"),
        ('"\\ud800"', "E111"),
        ("@home", "E101"),
        ("a: b: c", "E101"),
        ("\t3", "E101"),
        ("[" * 2000, "E110"),
        ("[" * 100_000, "E110"),
        ("{a: " * 60, "E110"),
        ("3\0", "E111"),
        ("3\x07", "E111"),
        ("3\ufffe", "E111"),
        ("\ud800", "E111"),
    ],
)
def test_what_is_not_plain_data_is_refused_at_its_place(line: str, code: str, refused: Refused) -> None:
    """Each has its code, and the place is in the line that holds it."""
    problems = refused(f"magbear: 1\nk: {line}\n")
    found = [problem for problem in problems if problem.code == code]
    assert found
    assert found[0].line == 2
    assert found[0].column is not None
    assert found[0].column >= 1


@pytest.mark.parametrize("text", ["", "\n\n", "# only a comment\n", "---\n", "--- ~\n", "...\n"])
def test_an_empty_study_is_refused(text: str, refused: Refused) -> None:
    """A file without a value is not a study."""
    assert [problem.code for problem in refused(text)] == ["E101"]


@pytest.mark.parametrize("text", ["42\n", "just words\n", "- a\n- b\n", "[1]\n", "'quoted'\n"])
def test_a_study_is_a_mapping(text: str, refused: Refused) -> None:
    """A scalar or a list at the top is refused, and the sentence says what a study is."""
    (problem,) = refused(text)
    assert problem.code == "E104"
    assert "mapping" in problem.sentence


def test_a_second_document_is_refused_where_it_begins(base: str, refused: Refused) -> None:
    """Two documents are not one study."""
    (problem,) = refused(f"{base}---\na: 1\n")
    assert (problem.code, problem.line) == ("E108", base.count("\n") + 1)


def test_an_alias_bomb_is_refused_at_once(refused: Refused) -> None:
    """Nothing is ever expanded; every alias is told."""
    lines = ["a0: &a0 [x, x, x]"] + [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 10)]
    codes = {problem.code for problem in refused("\n".join(lines))}
    assert "E108" in codes


def test_a_duplicate_key_names_the_first(base: str, refused: Refused) -> None:
    """The user learns where both stand, at the top and nested."""
    problems = refused(f"{base}mass_kg: 3.6\n")
    assert [(problem.code, problem.line) for problem in problems] == [("E107", base.count("\n") + 1)]
    assert "line 5" in problems[0].sentence
    nested = refused(base.replace("dc_gain: 10,", "dc_gain: 10, dc_gain: 12,"))
    assert [(problem.code, problem.line, problem.column) for problem in nested] == [("E107", 6, 28)]


def test_a_tab_that_indents_is_named(refused: Refused) -> None:
    """A tab is invisible, so the sentence must say it."""
    (problem,) = refused("magbear: 1\nbearing:\n\tair_gap_m: 1\n")
    assert problem.code == "E101"
    assert "tab" in problem.sentence
    assert problem.line == 3


def test_a_bracket_that_is_never_closed_is_pointed_at(refused: Refused) -> None:
    """The place is that of the bracket, not the end of the file."""
    (problem,) = refused("magbear: 1\nmass_kg: [3.0, 4.5\n")
    assert (problem.line, problem.column) == (2, 10)


def test_line_ends_of_windows_and_a_byte_order_mark_are_read(base: str) -> None:
    """Editors write them; they change nothing."""
    assert value_of("\ufeff" + base.replace("\n", "\r\n")) == value_of(base)


def test_lines_are_counted_as_editors_count_them_on_windows(base: str, refused: Refused) -> None:
    """A carriage return does not make a line of its own."""
    (problem,) = refused(base.replace("\n", "\r\n").replace("mass_kg: [3.0, 4.5]", "mass_kg: yes"))
    assert (problem.line, problem.column) == (5, 10)


def test_as_deep_as_allowed_is_read() -> None:
    """The limit refuses nothing below it."""
    depth = DEEPEST - 1
    assert value_of("a: " + "[" * depth + "]" * depth) == {"a": value_of("[" * depth + "]" * depth)}


def test_ten_thousand_lines_of_values_keep_their_places(refused: Refused) -> None:
    """A long list is read and its last line is found."""
    entries = "".join(f"  - {i}.5\n" for i in range(5000))
    problems = refused(f"magbear: 1\nmass_kg:\n{entries}  - 010\n")
    assert 5003 in {problem.line for problem in problems}


def test_a_leak_of_the_parser_is_a_sentence(monkeypatch: pytest.MonkeyPatch, refused: Refused) -> None:
    """Whatever exception the parser raises, the user sees a place and a sentence."""

    def leak(*_: object) -> None:
        raise AttributeError("inside")

    monkeypatch.setattr(yaml.SafeLoader, "fetch_more_tokens", leak)
    (problem,) = refused("a: 1\n")
    assert problem.code == "E101"
    assert "inside" not in str(problem)


def test_too_many_values_are_refused(monkeypatch: pytest.MonkeyPatch, refused: Refused) -> None:
    """A file that would take minutes to read is not read to its end."""
    monkeypatch.setattr("magbear_cli.spec.reading.MOST_VALUES", 100)
    assert "E110" in {problem.code for problem in refused("a: [" + "1, " * 200 + "1]")}

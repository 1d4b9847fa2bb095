"""Tests of the model layer: each wrong value is refused with its place, its key and what to do."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.spec.cases import LARGEST_COUNT
from magbear_cli.spec.grammar import method_names, section_keys
from magbear_cli.spec.models import SECTIONS, StudyFile
from magbear_cli.spec.problems import CODES, Problem, StudyError, nearest
from magbear_cli.spec.study import read_study_text
from magbear_cli.spec.writing import inline

Refused = Callable[..., tuple[Problem, ...]]
Spoiled = Callable[[str, str], str]

BEARING = "bearing: {{air_gap_m: {}, force_constant_n_m2_per_a2: 4e-6, bias_current_a: 0.5}}"
STEP = "simulate: [{{step_m: 10e-6, {}}}]"


@pytest.mark.parametrize(
    ("line", "code", "column", "words"),
    [
        ("mass_kg: yes", "E104", 10, "number or [low, high]"),
        ("mass_kg: true", "E104", 10, "truth value"),
        ("mass_kg: ~", "E104", 10, "empty"),
        ("mass_kg: '3.6'", "E104", 10, "remove the quotes: 3.6"),
        ("mass_kg: 1,5", "E104", 10, "1.5"),
        ("mass_kg: 1 000", "E104", 10, "1000"),
        ("mass_kg: 1_000", "E104", 10, "1000"),
        ("mass_kg: 1.5 kg", "E104", 10, "write the number alone, 1.5"),
        ("mass_kg: 1.5kg", "E104", 10, "write the number alone, 1.5"),
        ("mass_kg: −1", "E104", 10, "minus of the keyboard: -1"),
        ("mass_kg: ٣", "E104", 10, "digits 0 to 9"),
        ("mass_kg: 3.6\u00a0", "E104", 10, "not part of a number"),
        ("mass_kg: 1\u00a0000", "E104", 10, "1000"),
        ("mass_kg: 0b1", "E104", 10, "write 1"),
        ("mass_kg: 1:30", "E104", 10, "one number"),
        ("mass_kg: nan", "E104", 10, "finite"),
        ("mass_kg: 2026-11-22", "E104", 10, "must be a number"),
        ("mass_kg: 0", "E105", 10, "greater than 0"),
        ("mass_kg: -3", "E105", 10, "greater than 0"),
        ("mass_kg: -0.0", "E105", 10, "greater than 0"),
        ("mass_kg: 1e9", "E105", 10, "kg"),
        ("mass_kg: []", "E104", 10, "not a list of 0"),
        ("mass_kg: [3]", "E104", 10, "not a list of 1"),
        ("mass_kg: [3, 4, 5]", "E104", 10, "not a list of 3"),
        ("mass_kg: [3, yes]", "E104", 14, "mass_kg.1"),
        ("mass_kg: [3, .nan]", "E109", 14, "finite"),
        ("mass_kg: [3, -1]", "E105", 14, "mass_kg.1"),
        ("mass_kg: [4.5, 3.0]", "E114", 10, "[3, 4.5]"),
        ("mass_kg: [3.0, 3]", "E114", 10, "3"),
        ("mass_kg: {low: 3, high: 4}", "E104", 10, "mapping"),
        ("magbear: 2", "E112", 10, "not 2"),
        ("magbear: one", "E112", 10, "must be 1, the format"),
        ("magbear: true", "E112", 10, "must be 1, the format"),
        ("magbear: 1.0", "E112", 10, "not 1.0"),
        ("name: 5", "E104", 7, "quotes"),
        ("name: a b", "E106", 7, "letters"),
        ("name: ../up", "E106", 7, "files"),
        ("name: ''", "E105", 7, "empty"),
        ("name: " + "x" * 300, "E105", 7, "80"),
        (BEARING.format("0"), "E105", 22, "greater than 0"),
        (BEARING.format("-4e-4"), "E105", 22, "the unit is m"),
        (BEARING.format("400"), "E105", 22, "at most 0.1"),
        (BEARING.format("400 µm"), "E104", 22, "400"),
        ("bearing: [1]", "E104", 10, "the name of a part or a mapping"),
        ("bearing: thesis_trust", "E106", 10, "did you mean 'thesis_thrust'"),
        ("bearing: missing.yaml", "E100", 10, "study file"),
        ("operating_point: {position_m: 400e-6}", "E114", 31, "air gap"),
        ("operating_point: {position_m: -0.05}", "E114", 31, "air gap"),
        ("uncertain: {parameter: mass, factor: [0.9, 1.1]}", "E106", 24, "force_constant"),
        ("uncertain: {parameter: force_constant, factor: [1.1, 0.9]}", "E114", 48, "begins at 1.1"),
        ("uncertain: {parameter: force_constant, factor: [1.0]}", "E104", 48, "2 values"),
        ("uncertain: {parameter: force_constant, factor: [0.0, 1.0]}", "E105", 48, "0.01 to 100"),
        ("uncertain: {parameter: force_constant}", "E103", 1, "factor"),
        ("performance: fast", "E106", 14, "configs/weights"),
        ("performance: 3", "E104", 14, "{dc_gain, corner_rad_s} or {num, den}"),
        ("performance: {dc_gain: 0, corner_rad_s: 200}", "E105", 24, "greater than 0"),
        ("performance: {dc_gain: 10, corner_rad_s: -200}", "E105", 42, "rad/s"),
        ("performance: {dc_gain: 10}", "E103", 1, "corner_rad_s"),
        ("performance: {num: [1], dc_gain: 10}", "E103", 1, "corner_rad_s"),
        ("performance: {num: [1], den: [1, 1], dc_gain: 10}", "E102", 38, "not both"),
        ("performance: {num: [1, 0], den: [5]}", "E115", 20, "not proper"),
        ("performance: {num: [0, 0], den: [1, 1]}", "E115", 20, "zero"),
        ("performance: {num: [1], den: [0]}", "E115", 30, "zero"),
        ("performance: {num: [1], den: [1, -1]}", "E115", 30, "left half-plane"),
        ("performance: {num: [1], den: [1, 0]}", "E115", 30, "left half-plane"),
        ("performance: {num: [1], den: [1, 0, 4]}", "E115", 30, "left half-plane"),
        ("performance: {num: [1], den: [1, 1, 1, 2]}", "E115", 30, "left half-plane"),
        ("performance: {num: [], den: [1, 1]}", "E113", 20, "empty list"),
        ("performance: {num: [1, x], den: [1, 1]}", "E104", 24, "performance.num.1"),
        ("performance: {num: 1, den: [1, 1]}", "E104", 20, "must be a list"),
        ("bandwidth: 20000", "E104", 12, "{omega_c_rad_s: 20000}"),
        ("bandwidth: {omega_c_rad_s: 0}", "E105", 28, "greater than 0"),
        ("bandwidth: {omega_c_rad_s: -1}", "E105", 28, "greater than 0"),
        ("bandwidth: {omega_c_rad_s: 1e12}", "E105", 28, "at most"),
        ("bandwidth: {omega_c_rad_s: on}", "E104", 28, "not the text 'on'"),
        ("controller: mu_convx", "E104", 13, "{method: mu_convex}"),
        ("controller: {method: mu_convx}", "E106", 22, "did you mean 'mu_convex'"),
        ("controller: {method: 3}", "E104", 22, "text"),
        ("controller: {order: 3}", "E103", 1, "method"),
        (
            "controller: {method: mu_convex, sample_time_s: 2.0e-5}",
            "E102",
            33,
            "legal are method, uncertainty, max_order",
        ),
        ("controller: {method: lqg, max_ordr: 3}", "E102", 27, "legal are method, q, r, xi, theta"),
        ("controller: {method: mu_convex, max_ordr: 3}", "E102", 33, "did you mean 'max_order'"),
        ("performance: {dc_gain: 10, corner_rad_s: 200, numm: 1}", "E102", 47, "legal are dc_gain, corner_rad_s"),
        ("controller: {method: mu_convex, order: 3}", "E102", 33, "it belongs to fixed_order"),
        ("controller: {method: mu_convex, uncertainty: complx}", "E106", 46, "did you mean 'complex'"),
        ("controller: {method: mu_convex, uncertainty: 3}", "E104", 46, "real, complex"),
        ("controller: {method: mu_convex, max_order: 1}", "E105", 44, "at least 2"),
        ("controller: {method: mu_convex, minimise: step}", "E106", 43, "step_current"),
        ("controller: {method: mu_convex, step_prefilter: fast}", "E106", 49, "configs/prefilters"),
        ("controller: {method: mu_convex, step_prefilter: thesis_fast}", "E114", 13, "minimise is worst_case"),
        ("controller: {method: mu_convex, step_prefilter: {omega_rad_s: 2e4}}", "E103", 33, "'zeta'"),
        ("controller: {method: lqg, step_prefilter: thesis_fast}", "E102", 27, "it belongs to mu_convex"),
        ("controller: {method: fixed_order, order: 7}", "E105", 42, "1 to 6"),
        ("controller: {method: fixed_order, order: 0}", "E105", 42, "1 to 6"),
        ("controller: {method: fixed_order, order: automatic}", "E104", 42, "whole number or auto"),
        ("controller: {method: fixed_order, order: 2, max_order: 4}", "E114", 56, "belongs to order: auto"),
        ("controller: {method: fixed_order, order: auto, max_order: 9}", "E105", 59, "at most 8"),
        ("controller: {method: fixed_order, order: 1.5}", "E104", 42, "whole number"),
        ("controller: {method: hinf, gamma_tolerance: 0}", "E105", 45, "greater than 0"),
        ("controller: {method: lqg, q: [1]}", "E104", 30, "at least 2"),
        ("controller: {method: lqg, q: [0, 0]}", "E105", 30, "all zero"),
        ("controller: {method: lqg, q: [1, -1]}", "E105", 34, "at least 0"),
        ("controller: {method: lqg, r: 0}", "E105", 30, "greater than 0"),
        ("controller: {method: stored}", "E103", 1, "path"),
        ("simulate: []", "E113", 11, "empty list"),
        ("simulate: {step_m: 10e-6}", "E104", 11, "must be a list"),
        ("simulate: [10e-6]", "E104", 12, "step_m"),
        ("simulate: [{}]", "E103", 12, "step_m or a disturbance"),
        ("simulate: [{step_m: 0.5}]", "E114", 21, "10 air gaps"),
        ("simulate: [{step_m: 10 µm}]", "E104", 21, "write the number alone, 10"),
        ("simulate: [{step_m: 1,5}]", "E108", 23, "1.5"),
        (STEP.format("masses_kg: []"), "E113", 39, "empty list"),
        (STEP.format("masses_kg: [3, 3.0]"), "E113", 43, "twice"),
        (STEP.format("masses_kg: [3600]"), "E114", 40, "far outside"),
        (STEP.format("model: lineer"), "E106", 35, "did you mean 'linear'"),
        (STEP.format("prefilter: {omega_rad_s: 1, zeta: 0}"), "E105", 62, "greater than 0"),
        (STEP.format("prefilter: {omega_rad_s: 1}"), "E103", 28, "zeta"),
        (STEP.format("sensor: thesis_prob"), "E106", 36, "thesis_probe"),
        (STEP.format("sensor: {omega_rad_s: 4000, damping_rad_s: -1}"), "E105", 71, "greater than 0"),
        (STEP.format("rotor: {sensor_mass_kg: 5, stiffness_n_per_m: 1, damping_n_s_per_m: 0}"), "E114", 52, "part of"),
        (STEP.format("gravity_compensation: on"), "E104", 50, "write true"),
        (STEP.format("gravity_compensation: no"), "E104", 50, "write false"),
        (STEP.format("duration_s: 0"), "E105", 40, "greater than 0"),
        (STEP.format("samples: 1"), "E105", 37, "at least 2"),
        (STEP.format("samples: 1000000000"), "E105", 37, "at most 100001"),
        (STEP.format("disturbance: {force_n: 50}"), "E103", 28, "duration_s"),
        (
            STEP.format("duration_s: 1, disturbance: {force_n: 5, start_s: 1, duration_s: 1}"),
            "E114",
            78,
            "begin it earlier",
        ),
        ("report: {figures: [mu, stp]}", "E106", 24, "did you mean 'step'"),
        ("report: {figures: []}", "E113", 19, "empty list"),
        ("run: {timeout_s: 0}", "E105", 18, "greater than 0"),
        ("run: {memory_gib: 0.3}", "E105", 19, "at least 1"),
    ],
)
def test_a_wrong_value_is_refused_at_its_place(
    line: str, code: str, column: int, words: str, refused: Refused, spoiled: Spoiled
) -> None:
    """Code, line and column are right, and the message says which key and what to do."""
    text = spoiled(line.partition(":")[0], line)
    (problem,) = [problem for problem in refused(text) if problem.code == code][:1]
    assert problem.line == text.splitlines().index(line) + 1
    assert problem.column == column
    assert words in f"{problem.sentence} {problem.remedy}"


def test_a_limit_that_is_sought_is_not_given(refused: Refused, spoiled: Spoiled) -> None:
    """The method that seeks the bandwidth limit is refused where the study gives one, at the place of that."""
    text = spoiled("controller", "controller: {method: limit}")
    (problem,) = refused(text)
    assert (problem.code, problem.line) == ("E114", 1 + text[: text.index("bandwidth:")].count("\n"))
    assert "seeks bandwidth.omega_c_rad_s itself" in problem.sentence


@pytest.mark.parametrize(
    ("controller", "words"),
    [
        ("{method: adaptive_lfe, sigma_m: 2e-6}", "more than controller.rho_m"),
        ("{method: adaptive_limit, low: 1e9, high: 1e8}", "not above controller.low"),
        ("{method: adaptive_limit}", "the case has none"),
    ],
)
def test_an_adaptive_law_agrees_with_itself(refused: Refused, controller: str, words: str) -> None:
    """A sphere turned inside out and a search without room or without runs are refused."""
    base = "magbear: 1\nname: a\nbearing: thesis_thrust\nmass_kg: 2\nperformance: thesis_slow\n"
    runs = "" if controller.endswith("limit}") else "simulate: [{step_m: 1e-5}]\n"
    (problem,) = refused(f"{base}controller: {controller}\n{runs}")
    assert problem.code == "E114"
    assert words in problem.sentence


@pytest.mark.parametrize(
    ("sweep", "code", "words"),
    [
        ("3", "E104", "mapping"),
        ("[mass_kg]", "E104", "mapping"),
        ("{mass_kg: 3}", "E104", "list"),
        ("{mass_kg: []}", "E113", "empty"),
        ("{mass_kg: [3, 3.0]}", "E113", "twice"),
        ("{bandwidth.omega_c_rad_s: [7000, 7e3]}", "E113", "twice"),
        ("{bandwidth.omega_c_rad_s: [7000, .nan]}", "E109", "finite"),
        ("{bandwidth.omega_c_rad_s: [7000, -1]}", "E105", "greater than 0"),
        ("{mass_kg: [[4, 3]]}", "E114", "[3, 4]"),
        ("{mas_kg: [3]}", "E117", "mass_kg"),
        ("{bandwith.omega_c_rad_s: [1000]}", "E117", "bandwidth.omega_c_rad_s"),
        ("{omega_c_rad_s: [1000]}", "E117", "bandwidth.omega_c_rad_s"),
        ("{simulate.0.stp_m: [1e-6]}", "E117", "simulate.0.step_m"),
        ("{simulate.3.step_m: [1e-6]}", "E117", "no entry 3"),
        ("{simulate.12.stp_m: [1e-6]}", "E117", "simulate.12.step_m"),
        ("{simulate.first.step_m: [1e-6]}", "E117", "no key"),
        ("{simulate.0: [{step_m: 1 mm}]}", "E104", "write the number alone"),
        ("{simulate.0.masses_kg.5: [3]}", "E117", "no entry 5"),
        ("{mass_kg.0.1: [3]}", "E117", "no key"),
        ("{mass_kg.low: [1]}", "E117", "no key"),
        ("{name: [a, b]}", "E117", "not part of a case"),
        ("{run.timeout_s: [1, 2]}", "E117", "not part of a case"),
        ("{sweep.mass_kg: [1]}", "E117", "did you mean 'mass_kg'"),
        ("{'': [1]}", "E117", "no key"),
        ("{.: [1]}", "E117", "no key"),
        ("{controller.order: [1]}", "E102", "it belongs to fixed_order"),
        ("{controller.sample_time_s: [1]}", "E117", "legal are controller.method, controller.uncertainty"),
        ("{controller.max_ordr: [1]}", "E117", "did you mean 'controller.max_order'"),
        ("{controller: [mu_convex]}", "E104", "{method: mu_convex}"),
        ("{controller: [{method: mu_convex}, {method: mu_convex, uncertainty: real}]}", "E119", "same"),
        ("{bearing.air_gap_m: [1e-7]}", "E114", "air gaps"),
        ("{mass_kg: [0.2]}", "E114", "far outside"),
    ],
)
def test_a_wrong_sweep_is_refused_on_its_line(sweep: str, code: str, words: str, base: str, refused: Refused) -> None:
    """What is wrong with a swept key or value is told where it stands."""
    problems = refused(f"{base}sweep: {sweep}\n")
    found = [problem for problem in problems if problem.code == code]
    assert found
    assert words in f"{found[0].sentence} {found[0].remedy}"
    if code != "E114" or "mass_kg: [[" in sweep:
        assert found[0].line == base.count("\n") + 1


def test_an_entry_of_a_number_cannot_be_swept(base: str, refused: Refused) -> None:
    """A known mass has no ends."""
    text = base.replace("mass_kg: [3.0, 4.5]", "mass_kg: 3.6")
    (problem,) = refused(f"{text}sweep: {{mass_kg.1: [4, 5]}}\n")
    assert problem.code == "E117"
    assert "no '1' below it" in problem.sentence


def test_a_sweep_of_very_many_keys_is_refused(base: str, refused: Refused) -> None:
    """Each would need a remedy, and none can be meant."""
    keys = "".join(f"  k{i}: [1]\n" for i in range(60))
    (problem,) = refused(f"{base}sweep:\n{keys}")
    assert problem.code == "E116"


def test_a_wrong_value_of_a_sweep_is_pointed_at(base: str, refused: Refused) -> None:
    """Of many values, the line and column of the wrong one."""
    sweep = "sweep:\n  bandwidth.omega_c_rad_s:\n    - 1000\n    - 2 kHz\n    - 3000\n"
    (problem,) = refused(base + sweep)
    assert (problem.line, problem.column) == (base.count("\n") + 4, 7)


def test_everything_that_is_wrong_is_told_at_once(refused: Refused) -> None:
    """Syntax-like faults of single values, unknown keys and wrong values come in one message, in order of lines."""
    text = (
        "magbear: 1\nnam: x\nbearing: thesis_thrust\nmass_kg: 010\nperformance: {dc_gain: 10, corner_rad_s: 0}\n"
        "controller: {method: lqx}\nsimulate: [{step_m: 1e400}]\nsweep: {mas_kg: [1]}\n"
    )
    problems = refused(text)
    assert [problem.line for problem in problems] == [2, 4, 5, 6, 7, 8]
    assert [problem.code for problem in problems] == ["E102", "E109", "E105", "E106", "E109", "E117"]


def test_a_misspelt_key_is_not_also_missing(base: str, refused: Refused) -> None:
    """One mistake is one message."""
    assert len(refused(base.replace("mass_kg: [3.0, 4.5]", "mas_kg: [3.0, 4.5]"))) == 1


@pytest.mark.parametrize("key", ["magbear", "name", "bearing", "mass_kg", "performance", "controller"])
def test_a_missing_key_is_named_with_an_example(key: str, refused: Refused, spoiled: Spoiled) -> None:
    """The user can copy the line that is missing."""
    (problem,) = refused(spoiled(key, ""))
    assert problem.code == "E103"
    assert f"{key}:" in problem.remedy


def test_the_message_has_the_form_that_editors_read(base: str, refused: Refused) -> None:
    """FILE:LINE:COL: error[CODE]: sentence, the source line, a caret with the remedy."""
    (problem,) = refused(base.replace("mass_kg: [3.0, 4.5]", "mas_kg: [3.0, 4.5]"))
    assert str(problem) == (
        "study.yaml:5:1: error[E102]: unknown key 'mas_kg'\n"
        "   5 | mas_kg: [3.0, 4.5]\n"
        "     | ^^^^^^  did you mean 'mass_kg'?"
    )


def test_every_code_is_explained_and_no_word_of_pydantic_is_shown(base: str, refused: Refused) -> None:
    """A spoiled study of every kind shows no vocabulary but ours."""
    text = base + "x: 1\n"
    for word in ("200", "20000", "10.0e-6", "mu_convex", "[mu, step]", "300", "[3.0, 4.5]}"):
        text = text.replace(word, "{[a]: 3}")
    shown = "\n".join(str(problem) for problem in refused(text))
    assert not re.search(r"pydantic|Input should|validation error|type=|Traceback", shown)
    assert set(re.findall(r"error\[(E\d+)\]", shown)) <= set(CODES)


def typos(word: str) -> Iterator[str]:
    """Every word with one letter missing, doubled, exchanged with the next or replaced by its neighbour."""
    for i, letter in enumerate(word):
        yield word[:i] + word[i + 1 :]
        yield word[:i] + letter + word[i:]
        yield word[:i] + word[i + 1 : i + 2] + letter + word[i + 2 :]
        yield word[:i] + "x" + word[i + 1 :]
        yield word[:i] + "x" + word[i:]
    yield word.replace("_", "-")
    yield word.upper()
    yield word.replace("_", "")


def test_at_least_95_percent_of_typos_are_understood() -> None:
    """The nearest legal key is the one that was meant, for each key at each depth and each method and part."""
    right = total = 0
    for pattern in SECTIONS:
        keys = section_keys(tuple("0" if key == "*" else key for key in pattern))
        for key in keys:
            wrong = {typo for typo in typos(key) if typo and typo not in keys}
            total += len(wrong)
            right += sum(nearest(typo, keys) == key for typo in wrong)
    for name in method_names():
        wrong = {typo for typo in typos(name) if typo and typo not in method_names()}
        total += len(wrong)
        right += sum(nearest(typo, method_names()) == name for typo in wrong)
    assert total > 1000
    assert right / total >= 0.95


def test_95_percent_of_typos_are_understood_in_a_study(base: str) -> None:
    """The same through the whole reading, for the keys of the base study."""
    right = total = 0
    for key in re.findall(r"([a-z][a-z0-9_]+):", base):
        for typo in sorted({typo for typo in typos(key) if typo.isidentifier() and len(typo) > 2})[::5]:
            text = re.sub(rf"(?m)(^|[{{ ]){key}:", rf"\g<1>{typo}:", base, count=1)
            try:
                read_study_text(text, "study.yaml")
            except StudyError as error:
                total += 1
                right += any(re.search(rf"'(\w+\.)*{key}'\?", problem.remedy) is not None for problem in error.problems)
    assert total > 150
    assert right / total >= 0.95


WRONG = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text(max_size=8).filter(str.isprintable),
    st.lists(st.integers(), max_size=3),
    st.dictionaries(st.text("abc", min_size=1, max_size=3), st.integers(), max_size=2),
)


@settings(deadline=None, max_examples=150)
@given(key=st.sampled_from([key for key in StudyFile.model_fields if key != "sweep"]), value=WRONG)
def test_any_value_of_any_key_is_taken_or_refused_with_a_place(key: str, value: object, base: str) -> None:
    """A value of any kind in the place of any section never ends in anything but a study or its refusal."""
    lines = [line for line in base.splitlines() if not line.startswith(" ")]
    text = "\n".join(f"{key}: {inline(value)}" if line.startswith(f"{key}:") else line for line in lines)
    text = text.replace("simulate:\n", "")
    problems: tuple[Problem, ...] = ()
    try:
        read_study_text(text, "study.yaml")
    except StudyError as error:
        problems = error.problems
    assert all(problem.line is not None and problem.column is not None for problem in problems)
    assert all(problem.code in CODES for problem in problems)


def test_a_grid_of_a_hundred_million_cases_is_refused_with_its_count(base: str, refused: Refused) -> None:
    """It is counted, not built."""
    axes = "".join(
        f"  {key}: [{', '.join(str(first + i * step) for i in range(100))}]\n"
        for key, first, step in (
            ("bandwidth.omega_c_rad_s", 1000, 1),
            ("performance.corner_rad_s", 100, 1),
            ("performance.dc_gain", 5, 1),
            ("mass_kg", 3, 0.001),
        )
    )
    (problem,) = refused(f"{base}sweep:\n{axes}")
    assert problem.code == "E116"
    assert "100000000" in problem.sentence
    assert str(LARGEST_COUNT) in problem.sentence

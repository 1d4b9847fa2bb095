"""Shared by the tests of the store: outcomes of every shape, and what it means that two of them are the same."""

from __future__ import annotations

import dataclasses
import subprocess
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from magbear_cli.errors import Status
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.table import Column, Table
from magbear_cli.store.toolchain import Toolchain
from magbear_cli.study.outcome import (
    CaseOutcome,
    FrequencyStudy,
    ImpossibilityProof,
    PoleStudy,
    StepOutcome,
    StudyResults,
    Summary,
)
from magbear_cli.study.plan import case_id

Strategy = st.SearchStrategy[Any]

texts = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\x00"), max_size=30)
finite = st.floats(allow_nan=False, allow_infinity=False)
plain = st.dictionaries(texts, st.none() | st.booleans() | finite | texts | st.lists(finite, max_size=3), max_size=3)
optional = st.none() | st.floats()


def arrays(*shape: int) -> Strategy:
    """Real arrays with every kind of float in them, large ones cheaply filled."""
    strategy: Strategy = hnp.arrays(np.float64, shape, elements=st.floats(width=64), fill=st.just(0.5))
    return strategy


def complexes(*shape: int) -> Strategy:
    """Complex arrays."""
    strategy: Strategy = hnp.arrays(np.complex128, shape, elements=st.complex_numbers(), fill=st.just(0.5j))
    return strategy


@st.composite
def systems(draw: st.DrawFn) -> StateSpace:
    """State-space systems, static gains included."""
    n = draw(st.integers(0, 4))
    entries = hnp.arrays(np.float64, (n + 1, n + 1), elements=st.floats(-1e12, 1e12))
    whole = draw(entries)
    return StateSpace(whole[:n, :n], whole[:n, n:], whole[n:, :n], whole[n:, n:])


@st.composite
def frequency_studies(draw: st.DrawFn) -> FrequencyStudy:
    """Frequency studies from one point to more than a compressed chunk."""
    w, k = draw(st.sampled_from([1, 3, 200])), draw(st.integers(1, 3))
    real, table = [draw(arrays(w)) for _ in range(6)], [draw(complexes(k, w)) for _ in range(3)]
    values: list[Any] = [
        real[0],
        *(draw(arrays(k)) for _ in range(3)),
        *real[1:4],
        *table,
        draw(complexes(w)),
        *real[4:],
    ]
    return FrequencyStudy(*values)


@st.composite
def pole_studies(draw: st.DrawFn) -> PoleStudy:
    """Pole studies."""
    k, n = draw(st.integers(1, 3)), draw(st.integers(0, 4))
    return PoleStudy(draw(arrays(k)), draw(arrays(k)), draw(arrays(k)), draw(complexes(k, n)))


@st.composite
def impossibility_proofs(draw: st.DrawFn) -> ImpossibilityProof:
    """Proofs of impossibility, with and without the derived coefficient."""
    n, k = draw(st.integers(1, 3)), draw(st.integers(1, 3))
    spare, m = draw(st.integers(0, 1)), draw(st.integers(0, 2))
    poles, coefficients = (draw(arrays(n)), draw(arrays(k))), (draw(arrays(n)), draw(arrays(k + spare)))
    return ImpossibilityProof(
        draw(st.floats()),
        poles[0],
        coefficients[0],
        poles[1],
        coefficients[1],
        draw(arrays(m, 4)),
        sentence=draw(texts),
    )


@st.composite
def step_outcomes(draw: st.DrawFn) -> StepOutcome:
    """Step responses with and without figures, finished and not."""
    n = draw(st.sampled_from([0, 1, 5, 150]))
    values: list[Any] = [draw(st.floats()), draw(st.floats()), draw(texts), draw(texts), draw(plain)]
    values += [draw(texts), draw(texts)]
    values += [draw(optional) for _ in range(5)]
    values += [draw(arrays(n)) for _ in range(6)]
    return StepOutcome(*values)


summaries = st.builds(
    Summary,
    **{
        field.name: optional
        for field in dataclasses.fields(Summary)
        if field.name not in {"level", "order", "iso_zone", "verified", "verification_sentence"}
    },
    level=st.floats(),
    order=st.none() | st.integers(0, 99),
    iso_zone=st.none() | st.sampled_from("ABCD"),
    verified=st.booleans(),
    verification_sentence=texts,
)


@st.composite
def tables(draw: st.DrawFn) -> Table:
    """Tables of one to three columns, empty ones too."""
    names = draw(st.lists(st.sampled_from(["omega_rad_s", "gain", "b2"]), min_size=1, max_size=3, unique=True))
    n = draw(st.sampled_from([0, 1, 4, 200]))
    columns = [Column(name, draw(arrays(n)), draw(st.sampled_from(["1", "A/m"])), f"the {name}") for name in names]
    return Table(tuple(columns), draw(texts))


@st.composite
def case_outcomes(draw: st.DrawFn, index: int = 0) -> CaseOutcome:
    """Outcomes of every status, with and without each of their parts."""
    mass = draw(st.floats(0.1, 9.0) | st.tuples(st.floats(0.1, 1.0), st.floats(1.5, 9.0)).map(list))
    bandwidth = draw(st.none() | st.floats(1.0, 1e6).map(lambda omega: {"omega_c_rad_s": omega}))
    method = {"method": draw(st.sampled_from(["mu_convex", "hinf"])), "number": index}
    inputs = {"controller": method, "mass_kg": mass, "bandwidth": bandwidth, "simulate": [draw(plain)]}
    return CaseOutcome(
        case_id=case_id(inputs),
        index=index,
        inputs=inputs,
        status=draw(st.sampled_from(Status)),
        sentence=draw(texts),
        summary=draw(summaries),
        controller=draw(st.none() | systems()),
        frequency=draw(st.none() | frequency_studies()),
        poles=draw(st.none() | pole_studies()),
        steps=tuple(draw(st.lists(step_outcomes(), max_size=2))),
        statistics=draw(st.dictionaries(texts, st.floats(), max_size=3)),
        impossibility=draw(st.none() | impossibility_proofs()),
        tables=draw(st.dictionaries(st.sampled_from(["hankel", "recovery_2"]), tables(), max_size=2)),
    )


@st.composite
def study_results(draw: st.DrawFn) -> StudyResults:
    """Whole studies, also such of which some cases are missing."""
    indexes = sorted(draw(st.sets(st.integers(0, 12), max_size=3)))
    outcomes = tuple(draw(case_outcomes(index)) for index in indexes)
    return StudyResults(
        draw(texts), draw(texts), outcomes, draw(plain), draw(st.dictionaries(texts, texts, max_size=3))
    )


@pytest.fixture(scope="session")
def any_case() -> st.SearchStrategy[CaseOutcome]:
    """A strategy for outcomes."""
    return case_outcomes()


@pytest.fixture(scope="session")
def any_study() -> st.SearchStrategy[StudyResults]:
    """A strategy for whole studies."""
    return study_results()


@pytest.fixture(scope="session")
def full_case() -> Callable[[int], CaseOutcome]:
    """A function from an index to an outcome with all its parts, different for each index."""
    return make_full_case


def make_full_case(index: int) -> CaseOutcome:
    """An outcome as a robust design leaves it, with made-up numbers."""
    draw = np.random.default_rng(index)
    w, k, n, t = 150, 3, 3, 200
    inputs = {
        "controller": {"method": "mu_convex"},
        "mass_kg": [3.0, 4.0 + index],
        "bandwidth": {"omega_c_rad_s": 2e4},
    }

    def table(*shape: int) -> Any:  # noqa: ANN401 - an array
        return draw.normal(size=shape) + 1j * draw.normal(size=shape)

    values: list[Any] = [np.logspace(0, 6, w), np.array([3.0, 3.5, 4.5]), np.ones(3), np.ones(3)]
    values += [draw.random(w) for _ in range(3)]
    values += [table(k, w), table(k, w), table(k, w), table(w), draw.random(w), draw.random(w)]
    step = StepOutcome(
        3.0,
        1e-5,
        "nonlinear",
        "mu_convex",
        {"step_m": 1e-5, "prefilter": None},
        "finished",
        "",
        1e-3,
        0.1,
        None,
        2.5,
        1e-9,
        np.linspace(0.0, 0.01, t),
        *(draw.random(t) for _ in range(5)),
    )
    matrices = draw.normal(size=(n + 1, n + 1))
    return CaseOutcome(
        case_id(inputs),
        index,
        inputs,
        Status.OK,
        "",
        Summary(level=0.5, peak_mu=0.512, worst_case=0.402, order=n, verified=True, iso_zone="A"),
        StateSpace(matrices[:n, :n], matrices[:n, n:], matrices[n:, :n], matrices[n:, n:]),
        FrequencyStudy(*values),
        PoleStudy(np.linspace(3.0, 4.5, 5), np.ones(5), np.ones(5), table(5, n + 2)),
        (step, step),
        {"solves": 12.0, "residual": 1e-12},
        ImpossibilityProof(
            0.39, np.array([1.0, 2.0]), np.array([3.0, 4.0]), np.array([5.0]), np.ones(2), np.ones((1, 4)), "checked"
        ),
    )


@pytest.fixture(scope="session")
def are_same() -> Callable[[object, object], bool]:
    """Whether two values are the same to the last bit, arrays and NaN included."""
    return same


def same(first: Any, second: Any) -> bool:  # noqa: ANN401 - compares anything
    """Walk both values and compare them leaf by leaf."""
    if dataclasses.is_dataclass(first):
        names = [field.name for field in dataclasses.fields(first)]
        return type(first) is type(second) and all(same(getattr(first, n), getattr(second, n)) for n in names)
    if isinstance(first, np.ndarray):
        return bool(first.shape == second.shape and first.dtype == second.dtype and first.tobytes() == second.tobytes())
    if isinstance(first, Mapping):
        return first.keys() == second.keys() and all(same(first[key], second[key]) for key in first)
    if isinstance(first, list | tuple):
        return len(first) == len(second) and all(map(same, first, second))
    if isinstance(first, float) and isinstance(second, float):
        return np.float64(first).tobytes() == np.float64(second).tobytes() or (first != first and second != second)  # noqa: PLR0124 - NaN
    return bool(first == second) and type(first) is type(second)


@pytest.fixture
def toolchain() -> Toolchain:
    """Some toolchain."""
    return Toolchain({"magbear": "1.0", "numpy": "2.0"})


@pytest.fixture
def mounted(tmp_path: Path) -> Iterator[Callable[[str], Path]]:
    """A function from mount options to a real small file system in memory; skipped where mounting is not allowed."""
    folders: list[Path] = []

    def mount(options: str) -> Path:
        folder = tmp_path / f"mount{len(folders)}"
        folder.mkdir(exist_ok=True)
        done = subprocess.run(
            ["mount", "-t", "tmpfs", "-o", options, "tmpfs", folder], check=False, capture_output=True, text=True
        )
        if done.returncode:
            pytest.skip(f"mounting a file system is not permitted here: {done.stderr.strip()}")
        folders.append(folder)
        return folder

    yield mount
    for folder in folders:
        subprocess.run(["umount", "-l", folder], check=True)

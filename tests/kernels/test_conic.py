"""The door to the conic solver."""

from __future__ import annotations

import sys
import types

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.conic import LARGEST_VIOLATION, Cone, ConicAnswer, _violation, solve_cone_program


@given(seed=st.integers(0, 10_000), size=st.integers(2, 6))
@settings(deadline=None, max_examples=30)
def test_the_nearest_point_of_a_ball_is_found(seed: int, size: int) -> None:
    """Minimising cᵀx over ‖x − a‖ ≤ 1 gives a − c/‖c‖, and the dual agrees with the primal."""
    rng = np.random.default_rng(seed)
    centre, cost = rng.normal(size=size), rng.normal(size=size)
    matrix = np.vstack([np.zeros(size), -np.eye(size)])
    answer = solve_cone_program(cost, matrix, np.concatenate([[1.0], -centre]), [(Cone.SECOND_ORDER, size + 1)])
    assert answer.is_solved
    np.testing.assert_allclose(answer.x, centre - cost / np.linalg.norm(cost), atol=1e-6)
    assert answer.violation < 1e-7
    dual = -float(np.concatenate([[1.0], -centre]) @ answer.z)
    assert dual == pytest.approx(answer.objective, abs=1e-6)


def test_all_cones_are_understood() -> None:
    """Equality, inequality and semidefinite rows hold at the solution."""
    # x ≥ 2, x + y = 3, [[1, y], [y, 1]] ⪰ 0: the least x is 2
    root = np.sqrt(2.0)
    matrix = np.array([[1.0, 1.0], [-1.0, 0.0], [0.0, 0.0], [0.0, -root], [0.0, 0.0]])
    bound = np.array([3.0, -2.0, 1.0, 0.0, 1.0])
    cones = [(Cone.ZERO, 1), (Cone.NONNEGATIVE, 1), (Cone.POSITIVE_SEMIDEFINITE, 2)]
    answer = solve_cone_program(np.array([1.0, 0.0]), matrix, bound, cones)
    np.testing.assert_allclose(answer.x, [2.0, 1.0], atol=1e-6)


def test_an_impossible_program_is_called_so() -> None:
    """Between x ≥ 1 and x ≤ 0 there is no point."""
    answer = solve_cone_program(
        np.array([1.0]), np.array([[-1.0], [1.0]]), np.array([-1.0, 0.0]), [(Cone.NONNEGATIVE, 2)]
    )
    assert answer.is_infeasible
    assert not answer.is_solved


@pytest.mark.parametrize("place", ["q", "a", "b"])
def test_numbers_that_are_not_finite_are_refused(place: str) -> None:
    """NaN in any part of the data is refused before the solver sees it."""
    data = {"q": np.array([1.0]), "a": np.array([[-1.0]]), "b": np.array([-2.0])}
    data[place] = data[place] * np.nan
    with pytest.raises(NumericsError, match="not finite"):
        solve_cone_program(data["q"], data["a"], data["b"], [(Cone.NONNEGATIVE, 1)])


def test_a_panic_of_the_solver_becomes_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    """The compiled core's PanicException derives from BaseException and is caught by its name."""
    panic = type("PanicException", (BaseException,), {})

    def fail(*_: object) -> None:
        raise panic("index out of bounds")

    import clarabel

    fake = types.ModuleType("clarabel")
    for name in ("ZeroConeT", "NonnegativeConeT", "SecondOrderConeT", "PSDTriangleConeT", "DefaultSettings"):
        setattr(fake, name, getattr(clarabel, name))
    fake.DefaultSolver = fail  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "clarabel", fake)
    with pytest.raises(NumericsError, match="broke down"):
        solve_cone_program(np.array([1.0]), np.array([[-1.0]]), np.array([-2.0]), [(Cone.NONNEGATIVE, 1)])


def test_an_answer_that_misses_its_constraints_does_not_count() -> None:
    """Whatever the solver says, a point that breaks a cone by more than the stated bound is no answer."""
    x = np.zeros(1)
    assert ConicAnswer(x, x, 0.0, "almostsolved", LARGEST_VIOLATION).is_solved
    assert not ConicAnswer(x, x, 0.0, "almostsolved", 2.0 * LARGEST_VIOLATION).is_solved
    assert not ConicAnswer(x, x, 0.0, "solved", float("inf")).is_solved
    assert not ConicAnswer(x, x, 0.0, "solved", float("nan")).is_solved


def test_the_violation_of_a_matrix_cone_is_its_negative_eigenvalue() -> None:
    """[[1, 3], [3, 1]] has the eigenvalue −2; a positive definite matrix misses nothing."""
    root = np.sqrt(2.0)
    cones = [(Cone.POSITIVE_SEMIDEFINITE, 2)]
    assert _violation(np.array([1.0, 3.0 * root, 1.0]), cones) == pytest.approx(2.0)
    assert _violation(np.array([2.0, root, 2.0]), cones) == 0.0
    three = np.array([[4.0, 1.0, -7.0], [1.0, 5.0, 2.0], [-7.0, 2.0, 6.0]])
    packed = np.array([4.0, root, 5.0, -7.0 * root, 2.0 * root, 6.0])
    assert _violation(packed, [(Cone.POSITIVE_SEMIDEFINITE, 3)]) == pytest.approx(-np.linalg.eigvalsh(three)[0])

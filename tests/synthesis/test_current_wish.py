"""What is minimised, as a function of coefficients and poles."""

from __future__ import annotations

import numpy as np
import pytest

from magbear_cli.model.filters import Prefilter
from magbear_cli.synthesis.all_pass_sections import Sections
from magbear_cli.synthesis.current_wish import CurrentWish
from magbear_cli.synthesis.section_controller import SectionController
from magbear_cli.synthesis.step_current import Instants

FORM = SectionController(
    Sections(np.array([[5.0, 40.0], [9.0, 80.0], [3.0, 2.0]]), 12.0), np.array([-9.0, 2.0, 3.0, 1.0])
)
OMEGA = np.concatenate([[0.0], np.geomspace(0.1, 300.0, 40), [np.inf]])


@pytest.mark.parametrize("wish", [CurrentWish(), CurrentWish(Instants.between(50.0, 0.5), Prefilter(30.0, 1.0))])
def test_moves_of_poles_are_right_to_first_order(wish: CurrentWish) -> None:
    """A small move changes K S and the step's current as the affine terms say, up to its square."""
    affine = wish.with_moves(FORM, OMEGA)
    move = np.random.default_rng(2).normal(size=FORM.sections.logarithms.size)
    errors = []
    for size in (1e-2, 1e-3):
        moved = SectionController(FORM.sections.with_logarithms(FORM.sections.logarithms + size * move), FORM.q)
        v = np.concatenate([FORM.q, size * move])
        wrong = affine.offset + affine.columns @ v - moved.control_sensitivity(OMEGA)
        late = affine.step_offset + affine.step_columns @ v - wish.step(moved)
        errors.append(np.abs(wrong).max() + np.abs(late).max(initial=0.0))
    assert errors[1] < 0.02 * errors[0]


def test_a_prefilter_weighs_what_it_lets_through() -> None:
    """At rest everything counts, at the filter's own speed half of it for zeta = 1; without a filter everything."""
    wish = CurrentWish(Instants.between(50.0, 0.5), Prefilter(30.0, 1.0))
    assert wish.weight(np.array([0.0, 30.0])) == pytest.approx([1.0, 0.5])
    assert CurrentWish().weight(OMEGA[:-1]) == pytest.approx(1.0)
    assert (wish.kind, CurrentWish().kind) == ("step_current", "ks_peak")

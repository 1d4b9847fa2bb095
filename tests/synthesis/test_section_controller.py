"""Controllers by the poles of the nominal loop."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.lti.frequency import frequency_response
from magbear_cli.synthesis.all_pass_sections import Sections
from magbear_cli.synthesis.section_controller import SectionController

PAIR = st.tuples(st.floats(0.5, 30.0), st.floats(0.2, 2.0))
FORMS = st.builds(
    lambda pairs, lag, q: SectionController(
        Sections(np.array([[2.0 * zeta * w, w**2] for w, zeta in pairs]), lag),
        np.array(q[: 2 * len(pairs) - 3 + (lag is not None)]),
    ),
    st.lists(PAIR, min_size=2, max_size=4),
    st.one_of(st.none(), st.floats(0.5, 30.0)),
    st.lists(st.integers(-20, 20).map(float), min_size=6, max_size=6),
)
OMEGA = np.concatenate([[0.0], np.geomspace(1e-2, 1e3, 30), [np.inf]])


@settings(deadline=None, max_examples=60)
@given(form=FORMS)
def test_the_matrices_are_the_function(form: SectionController) -> None:
    """The state-space system has the response, with two states less than the loop has poles."""
    system = form.controller()
    assert system.order == form.sections.order - 2
    expected = form.response(OMEGA)
    assert frequency_response(system, OMEGA)[:, 0, 0] == pytest.approx(
        expected, rel=1e-6, abs=1e-7 * np.abs(expected).max()
    )


@settings(deadline=None, max_examples=60)
@given(form=FORMS)
def test_control_sensitivity_is_affine_and_right(form: SectionController) -> None:
    """K S from the affine terms is K/(1 − K G) with G = −1/(1 + ω²)."""
    plant = np.where(np.isfinite(OMEGA), -1.0 / (1.0 + np.where(np.isfinite(OMEGA), OMEGA, 0.0) ** 2), 0.0)
    response = form.response(OMEGA)
    expected = response / (1.0 - response * plant)
    assert form.control_sensitivity(OMEGA) == pytest.approx(expected, rel=1e-6, abs=1e-8 * np.abs(expected).max())


@settings(deadline=None, max_examples=60)
@given(form=FORMS)
def test_the_loop_has_the_poles_that_were_given(form: SectionController) -> None:
    """The closed-loop matrix has the characteristic polynomial of the sections, whatever the coefficients."""
    k = form.controller()
    plant, enter, leave = np.array([[0.0, 1.0], [1.0, 0.0]]), np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]])
    closed = np.block([[plant + enter @ k.d @ leave, enter @ k.c], [k.b @ leave, k.a]])
    at = 1j * np.geomspace(0.1, 100.0, 9)
    wanted = np.prod([at**2 + b * at + c for b, c in form.sections.quadratics], axis=0)
    if form.sections.lag is not None:
        wanted = wanted * (at + form.sections.lag)
    found = np.array([np.linalg.det(s * np.eye(closed.shape[0]) - closed) for s in at])
    assert found == pytest.approx(wanted, rel=1e-6)

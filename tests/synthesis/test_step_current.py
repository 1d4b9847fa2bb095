"""The linear current of a step."""

from __future__ import annotations

import numpy as np
import pytest

from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.filters import Prefilter
from magbear_cli.synthesis.all_pass_sections import Sections
from magbear_cli.synthesis.section_controller import SectionController
from magbear_cli.synthesis.step_current import Instants, affine_step_current, peak_step_current

FORM = SectionController(
    Sections.of_poles(np.array([-6.0 + 25j, -6.0 - 25j, -18.0 + 17j, -18.0 - 17j, -0.7, -3.0 + 1j, -3.0 - 1j])),
    np.array([5.0, -3.0, 2.0, 4.0]),
)


def test_the_current_of_a_known_loop_is_known() -> None:
    """With K = −4 (s + 1)/(s + 3), u = 4 (s − 1)/(s + 1): it begins at 4, decays like 8 e^(−t) − 4, and ends at −4."""
    controller = StateSpace.of([[-3.0]], [[1.0]], [[8.0]], [[-4.0]])
    assert peak_step_current(controller, None) == pytest.approx(4.0, rel=1e-9)
    form = SectionController(Sections(np.array([[2.0, 1.0], [6.0, 8.0]])), np.array([-4.0]))
    instants = Instants.between(4.0, 1.0)
    offset, columns = affine_step_current(form, None, instants)
    peak = np.abs(offset + columns @ form.q).max()
    assert peak == pytest.approx(peak_step_current(form.controller(), None), rel=1e-3)


@pytest.mark.parametrize("prefilter", [None, Prefilter(150.0, 1.0), Prefilter(2.0, 0.3)])
def test_the_affine_form_and_the_matrices_agree(prefilter: Prefilter | None) -> None:
    """The cascade of the form and the closed loop of its controller's matrices have the same largest current."""
    offset, columns = affine_step_current(FORM, prefilter, Instants.between(300.0, 0.5))
    current = np.abs(offset + columns @ FORM.q)
    assert current.max() == pytest.approx(peak_step_current(FORM.controller(), prefilter), rel=1e-3)


def test_the_current_begins_and_ends_as_the_gain_says() -> None:
    """Unfiltered, it begins at |K S| for ω = ∞ and ends at that for ω = 0."""
    offset, columns = affine_step_current(FORM, None, Instants.between(300.0, 0.5))
    ends = FORM.control_sensitivity(np.array([np.inf, 0.0])).real
    assert (offset + columns @ FORM.q)[[0, -1]] == pytest.approx(ends, rel=1e-6)


def test_instants_double_their_width() -> None:
    """They begin at 0, are fine enough for the fastest and reach beyond the slowest."""
    times = Instants.between(100.0, 0.5).times()
    widths = np.diff(times)
    assert times[0] == 0.0
    assert widths[0] <= 0.05 / 100.0
    assert times[-1] >= 5.0 / 0.5
    assert np.all(np.diff(widths) >= -1e-12 * widths[1:])


def test_an_unstable_loop_has_no_peak() -> None:
    """Without feedback the rotor falls."""
    assert peak_step_current(StateSpace.gain([[-0.5]]), None) == np.inf

"""The adaptive law's gains are those of the reference model, and Table 4.2 is one of them."""

from __future__ import annotations

import numpy as np
import pytest

from magbear_cli.errors import NumericsError
from magbear_cli.model.family import Plant
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.synthesis.adaptive_lfe import AdaptiveLfeOptions, design_adaptive_lfe
from magbear_cli.synthesis.state_feedback import placed_gain

WEIGHT = RationalWeight.low_pass(18.0, 17.0)


def problem(k_i: float) -> ControlProblem:
    """The thesis's bearing with a current law, 2.2 to 4.5 kg."""
    return ControlProblem.of_mass(62500.0, k_i, (2.2, 4.5), WEIGHT, 2000.0)


def test_the_printed_gain_is_that_of_the_full_current_law() -> None:
    """K = [1.71e4, 52.8] places two poles at −600 rad/s for 2.2 kg and 50 N/A; the half law needs twice as much."""
    assert placed_gain(Plant(2.2, 62_500.0, 50.0), 600.0, 1.0) == pytest.approx((1.71e4, 52.8), rel=1e-3)
    assert placed_gain(Plant(2.2, 62_500.0, 25.0), 600.0, 1.0) == pytest.approx((3.42e4, 105.6), rel=1e-3)


@pytest.mark.parametrize(("k_i", "mass", "zeta"), [(25.0, None, 1.0), (50.0, 3.3, 0.4)])
def test_a_placed_gain_puts_the_poles_there(k_i: float, mass: float | None, zeta: float) -> None:
    """With a placed gain the lightest rotor, or the one named, has the reference model's poles, and b is k_i/m."""
    asked = problem(k_i)
    design = design_adaptive_lfe(
        asked, AdaptiveLfeOptions(gain=None, design_mass_kg=mass, reference_omega_rad_s=300.0, reference_zeta=zeta)
    )
    law, m = design.law, mass or 2.2
    loop = [m, k_i * law.gain_speed_a_s_per_m, k_i * law.gain_position_a_per_m - 62500.0]
    assert loop == pytest.approx([m, m * 600.0 * zeta, m * 300.0**2])
    assert law.input_gain_m_per_s2_a == pytest.approx(k_i / m)
    assert design.statistics["design_mass_kg"] == m


def test_the_printed_law_presumes_the_input_gain_of_its_gain() -> None:
    """The b that belongs to Table 4.2 is 50 N/A over 2.2 kg, whatever the circuit really gives."""
    design = design_adaptive_lfe(problem(25.0))
    assert design.law.input_gain_m_per_s2_a == pytest.approx(50.0 / 2.2, rel=1e-3)
    assert design.statistics["plant_input_gain_m_per_s2_a"] == pytest.approx(25.0 / 2.2)
    assert design.statistics["feedback_pole_real_lightest_rad_s"] == pytest.approx(-300.0, rel=1e-3)
    assert np.isfinite(list(design.statistics.values())).all()


def test_a_gain_without_speed_needs_an_input_gain() -> None:
    """A gain that does not damp has no input gain that belongs to it."""
    with pytest.raises(NumericsError, match="input gain"):
        design_adaptive_lfe(problem(25.0), AdaptiveLfeOptions(gain=(1e4, 0.0)))
    given = AdaptiveLfeOptions(gain=(1e4, 0.0), input_gain_m_per_s2_a=10.0)
    assert design_adaptive_lfe(problem(25.0), given).law.input_gain_m_per_s2_a == 10.0

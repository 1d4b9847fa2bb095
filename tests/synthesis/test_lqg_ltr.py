"""LQG/LTR: the gain of the thesis, and the recovery of the filter's loop."""

from __future__ import annotations

import numpy as np
import pytest

from magbear_cli.errors import NumericsError, Status
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.synthesis.lqg import kalman_gain
from magbear_cli.synthesis.lqg_ltr import LqgLtrOptions, design_lqg_ltr, filter_loop


def _problem(k_i: float = 50.0) -> ControlProblem:
    return ControlProblem.of_mass(62500.0, k_i, (2.0, 2.0), RationalWeight.low_pass(10.0, 200.0))


@pytest.mark.parametrize(("theta", "gain"), [(8e-9, (482.0, 1.163e5)), (1e-8, (466.0, 1.09e5))])
def test_filter_gain_of_the_thesis(theta: float, gain: tuple[float, float]) -> None:
    """Program A.3's Θ = 8e-9 gives [482, 1.163e5]; the gain printed in section 2.3.3 belongs to 1e-8."""
    statistics = design_lqg_ltr(_problem(), LqgLtrOptions(theta=theta)).statistics
    assert statistics["filter_gain_position_per_s"] == pytest.approx(gain[0], rel=2e-3)
    assert statistics["filter_gain_speed_per_s2"] == pytest.approx(gain[1], rel=5e-3)


@pytest.mark.parametrize("k_i", [25.0, 50.0])
def test_the_recovered_loop_is_close_to_the_filter_loop(k_i: float) -> None:
    """S of the loop stays within 0.03 of S of the filter at every frequency, and so does T."""
    problem = _problem(k_i)
    design = design_lqg_ltr(problem)
    assert design.status is Status.OK
    assert design.controller is not None
    assert design.controller.order == 2
    omega = np.geomspace(0.1, 1e6, 400)
    estimate = kalman_gain(problem, np.diag([1e-7, 50.0]), 8e-9)
    target = frequency_response(filter_loop(problem, estimate), omega)[:, 0, 0]
    gain = frequency_response(design.controller, omega)[:, 0, 0]
    sensitivity = 1.0 / (1.0 - gain * problem.plant(omega, 2.0))
    assert np.abs(sensitivity - target).max() < 0.03
    assert design.statistics["recovery_error"] == pytest.approx(np.abs(sensitivity - target).max(), rel=1e-2)


def test_the_filter_loop_is_kalman_s() -> None:
    """The filter's own loop never amplifies: abs(S) ≤ 1 when the noise on the position is all there is."""
    problem = _problem()
    estimate = kalman_gain(problem, np.diag([1e-7, 50.0]), 8e-9)
    sensitivity = frequency_response(filter_loop(problem, estimate), np.geomspace(0.1, 1e6, 400))
    assert np.abs(sensitivity).max() <= 1.0 + 1e-9


def test_cheaper_control_recovers_better() -> None:
    """Without a weight on the speed the recovery error goes to zero with R."""
    errors = [
        design_lqg_ltr(_problem(), LqgLtrOptions(q=(1e6, 0.0), r=r)).statistics["recovery_error"]
        for r in (1e-4, 1e-8, 1e-12, 1e-16)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 2e-3


def test_weights_of_the_wrong_sign_are_refused() -> None:
    """Each bad weight is named."""
    for options, name in (({"xi": (-1.0, 0.0)}, "xi"), ({"theta": 0.0}, "theta"), ({"r": -1.0}, "r")):
        with pytest.raises(NumericsError, match=f"^{name} must"):
            LqgLtrOptions(**options)

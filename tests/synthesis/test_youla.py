"""All stabilising controllers of the nominal plant."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.model.robust_performance import control_sensitivity
from magbear_cli.synthesis.stabilisation import stabilises
from magbear_cli.synthesis.youla import YoulaController

SCALED = ControlProblem.of_mass(1.0, 1.0, (1.0, 1.0), RationalWeight.low_pass(10.0, 1.0), 50.0)


@given(seed=st.integers(0, 10_000), count=st.integers(1, 8), alpha=st.floats(0.5, 20.0))
@settings(deadline=None, max_examples=50)
def test_every_q_stabilises_and_k_s_is_affine_in_it(seed: int, count: int, alpha: float) -> None:
    """Whatever Q, the loop is stable, the realisation has the response, and K S = r0 + B q."""
    rng = np.random.default_rng(seed)
    controller = YoulaController(alpha, np.geomspace(0.1, 100.0, count), rng.normal(size=count + 1) * 5.0)
    system = controller.controller()
    assert system.order == count + 2
    assert stabilises(SCALED, system)
    omega = np.append(np.geomspace(0.01, 1e3, 25), np.inf)
    response = controller.response(omega)
    direct = np.array([system(1j * w)[0, 0] for w in omega[:-1]])
    np.testing.assert_allclose(direct, response[:-1], rtol=1e-6, atol=1e-8)
    assert system.d[0, 0] == response[-1]
    offset, basis = controller.affine_terms(omega)
    np.testing.assert_allclose(
        offset + basis @ controller.q, control_sensitivity(SCALED, response, omega), rtol=1e-6, atol=1e-8
    )

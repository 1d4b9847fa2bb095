"""Systems with random poles over many decades."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from magbear_cli.lti.state_space import StateSpace


@pytest.fixture
def random_system() -> Callable[..., StateSpace]:
    """A maker of stable systems: (seed, order, inputs, outputs, decades of pole speed)."""

    def make(seed: int, order: int, inputs: int = 1, outputs: int = 1, decades: float = 2.0) -> StateSpace:
        generator = np.random.default_rng(seed)
        speeds = 10.0 ** generator.uniform(-decades / 2, decades / 2, order)
        mixed = np.eye(order) + 0.3 * generator.standard_normal((order, order)) / max(order, 1)
        turn = np.zeros((order, order))
        for i in range(0, order - 1, 2):
            turn[i, i + 1], turn[i + 1, i] = speeds[i], -speeds[i]
            speeds[i + 1] = speeds[i]
        a = mixed @ (turn - np.diag(speeds * generator.uniform(0.05, 1.0))) @ np.linalg.inv(mixed)
        return StateSpace.of(
            a,
            generator.standard_normal((order, inputs)) * np.sqrt(speeds)[:, None],
            generator.standard_normal((outputs, order)),
            generator.standard_normal((outputs, inputs)),
        )

    return make

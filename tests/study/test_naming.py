"""What controllers are called."""

from __future__ import annotations

from typing import Any

import pytest

from magbear_cli.study.naming import controller_name


@pytest.mark.parametrize(
    ("controller", "name"),
    [
        ({"method": "lqg", "r": 1.0}, "lqg"),
        ({"method": "fixed_order", "order": 2, "minimise": "ks_peak"}, "fixed_order 2, least current"),
        ({"method": "mu_convex", "minimise": "worst_case", "uncertainty": "real"}, "mu_convex"),
        ({"method": "mu_convex", "minimise": "step_current"}, "mu_convex, least step current"),
        (
            {"method": "mu_convex", "minimise": "ks_peak", "uncertainty": "complex"},
            "mu_convex, complex mu, least current",
        ),
        ({"method": "adaptive_lfe", "gamma": 2e9, "trigger": "position"}, "adaptive_lfe, γ = 2e+09"),
        (
            {"method": "adaptive_limit", "trigger": "state", "adaptation_input_gain_m_per_s2_a": 1.0},
            "adaptive_limit, trigger on the state, b = 1 in the rate",
        ),
        ({"method": "stored", "source": "k.json"}, "stored (k.json)"),
    ],
)
def test_a_name_says_what_was_sought(controller: dict[str, Any], name: str) -> None:
    """The method, and the options that change what the controller is."""
    assert controller_name(controller) == name

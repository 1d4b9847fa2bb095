"""What a controller is called in tables and figures: its method, and the options that change what it is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

NAMED_OPTIONS = frozenset(
    {
        "method",
        "order",
        "uncertainty",
        "minimise",
        "form",
        "gamma",
        "trigger",
        "adaptation_input_gain_m_per_s2_a",
        "source",
    }
    | set("abcd")
)

_WISHES = {"ks_peak": "least current", "step_current": "least step current"}


def controller_name(controller: Mapping[str, Any]) -> str:
    """A name such as ``fixed_order 2, least current``, ``mu_convex, complex mu`` or ``stored (k.json)``."""
    method = str(controller["method"])
    words = [f"fixed_order {controller['order']}" if method == "fixed_order" else method]
    if method == "stored":
        words = [f"stored ({controller.get('source', controller.get('path', ''))})"]
    if method == "adaptive_lfe":
        words.append(f"γ = {controller['gamma']:.4g}")
    if controller.get("trigger") == "state":
        words.append("trigger on the state")
    if controller.get("adaptation_input_gain_m_per_s2_a") is not None:
        words.append(f"b = {controller['adaptation_input_gain_m_per_s2_a']:.4g} in the rate")
    if controller.get("uncertainty") == "complex":
        words.append("complex mu")
    if controller.get("minimise") in _WISHES:
        words.append(_WISHES[controller["minimise"]])
    if controller.get("form") == "as_printed":
        words.append("as printed")
    return ", ".join(words)

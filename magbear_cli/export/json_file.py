"""A controller as JSON; its ``a``, ``b``, ``c``, ``d`` are what the method ``stored`` reads."""

from __future__ import annotations

import json
from typing import Any

from magbear_cli.export.handover import Handover, matrices


def json_files(handover: Handover) -> dict[str, bytes]:
    """The one file: the continuous controller, and beside it the sampled one in z, in sections and in increments."""
    document: dict[str, Any] = {"name": handover.name, **matrices(handover.controller), **handover.document()}
    if handover.sampled is not None:
        sampled = handover.sampled
        document["sampled"] = {
            **sampled.document(),
            **matrices(sampled.controller.shifted),
            "sos": sampled.controller.second_order_sections().tolist(),
            "increments": [matrices(section) for section in sampled.controller.sections],
            "test_positions_m": handover.test_positions_m.tolist(),
            "test_currents_a": handover.test_currents_a.tolist(),
        }
    text = json.dumps(document, indent=1, allow_nan=False) + "\n"
    return {f"{handover.name}.json": text.encode("ascii")}

"""The zone of ISO 14839-3 that the peak of the sensitivity function puts a magnetic bearing in."""

from __future__ import annotations

import math

# ISO 14839-3:2006, table 1: 9.5, 12 and 14 dB
_ZONE_LIMITS = (("A", 3.0), ("B", 4.0), ("C", 5.0))


def iso_zone(peak_sensitivity: float) -> str:
    """Zone A (newly commissioned machines) below 3, B (unrestricted operation) below 4, C below 5, otherwise D.

    The standard takes the peak of |S| over the frequencies of interest of the machine as measured; here it is the peak
    over all frequencies of the loop as modelled. A peak that is not a number is in zone D.
    """
    if math.isnan(peak_sensitivity):
        return "D"
    return next((zone for zone, limit in _ZONE_LIMITS if peak_sensitivity < limit), "D")

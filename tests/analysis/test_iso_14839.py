"""The zones have the limits of the standard."""

import pytest

from magbear_cli.analysis.iso_14839 import iso_zone


@pytest.mark.parametrize(
    ("peak", "zone"),
    [
        (1.0, "A"),
        (2.99, "A"),
        (3.0, "B"),
        (3.99, "B"),
        (4.0, "C"),
        (4.99, "C"),
        (5.0, "D"),
        (float("inf"), "D"),
        (float("nan"), "D"),
    ],
)
def test_the_zone_of_a_peak(peak: float, zone: str) -> None:
    """A below 9.5 dB, B below 12 dB, C below 14 dB, D above and where there is no peak."""
    assert iso_zone(peak) == zone

"""Frequencies around resonances."""

from __future__ import annotations

import numpy as np
import pytest

from magbear_cli.lti.resonance import resonance_frequencies


def test_points_lie_within_the_width_of_each_light_root() -> None:
    """Both sides of a resonance are looked at from a tenth of its half-width on, however narrow it is."""
    roots = np.array([-0.3 + 300j, -0.3 - 300j, 1e-4 + 2000j, -50.0, -80.0 + 60.0j])
    found = resonance_frequencies(roots)
    for centre, width in ((300.0, 0.3), (2000.0, 1e-4)):
        distance = (found - centre) / width
        assert ((distance > 0) & (distance < 0.2)).any()
        assert ((distance > -0.2) & (distance < 0)).any()
    assert not ((found > 50) & (found < 100)).any()


def test_an_undamped_root_is_not_met_itself() -> None:
    """At an undamped root there is no response, and no point."""
    found = resonance_frequencies([7.0j])
    assert found.size
    assert 7.0 not in found
    assert np.abs(found - 7.0).min() == pytest.approx(7.0e-10, rel=0.1)


def test_no_root_no_points() -> None:
    """Nothing is asked of an empty list."""
    assert resonance_frequencies([]).size == 0

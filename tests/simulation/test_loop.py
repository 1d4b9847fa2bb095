"""The closed loop: what stands still at its operating point."""

from __future__ import annotations

import pytest

from magbear_cli.model.bearing import Bearing, CurrentLaw, gravity_current, linearization, magnetic_force
from magbear_cli.simulation.loop import Magnets
from magbear_cli.simulation.scenario import StepScenario
from magbear_cli.spec import json_schema

POINTS = [(0.0, 0.0), (1.5e-4, 0.0), (-1.0e-4, 0.3), (2.0e-4, -0.2)]


@pytest.mark.parametrize("law", list(CurrentLaw))
@pytest.mark.parametrize(("position", "current"), POINTS)
def test_gravity_is_balanced_at_the_operating_point(law: CurrentLaw, position: float, current: float) -> None:
    """The standing current adds the weight to the force at the operating point; off the middle it is another one."""
    bearing = Bearing(4.0e-4, 1.0e-5, 1.0, law)
    scenario = StepScenario(
        0.0, 4.5, gravity_m_per_s2=9.8, gravity_compensation=True, position_m=position, current_a=current
    )
    standing = Magnets(bearing, scenario).standing_current_a
    held = linearization(bearing, position, current).force_n
    assert float(magnetic_force(bearing, position, standing)) == pytest.approx(held + 4.5 * 9.8, rel=1e-12)
    middle = gravity_current(bearing, 4.5, 9.8)
    assert (standing == pytest.approx(middle, rel=1e-12)) == (position == 0.0 and current == 0.0)


def test_the_schema_says_where_gravity_is_balanced() -> None:
    """The words that users read are those of the code."""
    description = json_schema()["$defs"]["Scenario"]["properties"]["gravity_compensation"]["description"]
    assert description == "Add the constant current that balances gravity at the operating point."

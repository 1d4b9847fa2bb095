"""What every synthesis method answers: a controller or none, a status with its sentence, and statistics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from magbear_cli.errors import Status
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.table import Table


@dataclass(frozen=True)
class Design:
    """The answer of a synthesis method.

    ``controller`` maps the measured position (m) to the control current (A), u = K y with positive feedback.
    ``status`` is ``ok`` when the method found what it sought, ``infeasible`` only with a proof, ``not_achieved`` when
    the method did not get there. ``level`` is the figure the method minimised, as the method itself believes it.
    ``statistics`` holds numbers for the log: iterations, residuals, grid sizes. ``claims_optimum``: the method holds
    that no controller of any order has a much smaller worst case over the real mass range. ``tables`` holds, by name,
    what the method has to show beside its controller: singular values, fits, loops it aimed at.
    """

    controller: StateSpace | None
    status: Status
    sentence: str = ""
    level: float = float("nan")
    statistics: Mapping[str, float] = field(default_factory=dict)
    claims_optimum: bool = False
    tables: Mapping[str, Table] = field(default_factory=dict)

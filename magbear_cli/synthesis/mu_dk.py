"""D-K iteration for a bearing, the classic way to low mu: ``dk_iteration`` on the plant with scalar blocks."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from magbear_cli.errors import NumericsError, Status
from magbear_cli.kernels.block_structure import BlockStructure
from magbear_cli.model.generalized_plant import Form, build_generalized_plant, uncertainty_unit
from magbear_cli.model.problem import ControlProblem
from magbear_cli.synthesis.channel_scaling import thesis_scales, with_channel_scales
from magbear_cli.synthesis.design import Design
from magbear_cli.synthesis.dk_iteration import DkOptions, DkProblem, design_dk
from magbear_cli.synthesis.frequency_span import frequency_span, with_bandwidth
from magbear_cli.synthesis.scaling_step import peak_mu

_GRID = 100  # points of the grid for the D-scales, when none is given
_DENSE = 900  # points of the grid that mu is judged on, before its peaks are looked into
_BEYOND = 10.0  # how far the grid for the D-scales reaches past the slowest and the fastest mark
_DENSE_BEYOND = 1e4  # the same for the grid that mu is judged on


@dataclass(frozen=True)
class MuDkOptions(DkOptions):
    """How long to iterate, and with what D-scales.

    Parameters
    ----------
    frequency_grid : (low, high, points), rad/s and logarithmic, for the D-scales; None: from the problem
    form : the third output as derived, or as the thesis's program A.5 has it

    Without ``channel_scaling`` the units are those of the thesis; with ``fit_every_scale`` the controller has, as the
    thesis's, 33 states for scales of order five. The other options are those of ``DkOptions``.
    """

    frequency_grid: tuple[float, float, float] | None = None
    form: Form = "mended"

    def __post_init__(self) -> None:
        """Refuse numbers no iteration can work with."""
        super().__post_init__()
        if self.frequency_grid is not None:
            low, high, points = self.frequency_grid
            if not (0 < low < high < np.inf and 2 <= points < np.inf):
                raise NumericsError(f"a frequency grid needs 0 < low < high and two points, not {self.frequency_grid}")
            if points < 2 * self.d_order + 1:
                raise NumericsError(f"{points:.0f} points do not determine D-scales of order {self.d_order}")


def design_mu_dk(problem: ControlProblem, options: MuDkOptions | None = None) -> Design:
    """The controller with the least peak mu (complex blocks) among the iterates of the D-K iteration.

    Level, statistics and statuses as for ``design_dk``; ``statistics`` has the peak of the mended form beside, and the
    nominal mass with the spread of 1/m that the blocks stand for (thesis Table 2.2).

    Notes
    -----
    The thesis, sections 2.3.4 and 3.3-3.5. Order = 2 + the order of W1 + 2·d_order for each fitted scale.
    """
    options = options or MuDkOptions()
    try:
        bearing = _problem(problem, options)
        design = design_dk(bearing, options)
        if design.controller is None:
            return design
        mended = build_generalized_plant(problem).closed_by(design.controller)
        peak, _ = peak_mu(mended, bearing.structure, bearing.dense_rad_s)
    except NumericsError as error:
        return Design(None, Status.FAILED, str(error))
    told = {
        "peak_mu_mended": peak,
        "nominal_mass_kg": problem.nominal.mass_kg,
        "uncertainty_unit_per_kg": uncertainty_unit(problem),
    }
    return replace(design, statistics={**design.statistics, **told})


def _problem(problem: ControlProblem, options: MuDkOptions) -> DkProblem:
    """The bearing's plant in the thesis's units, its scalar blocks, and grids that hold what shapes the problem."""
    plant = build_generalized_plant(problem, options.form)
    scales = thesis_scales(problem, plant)
    structure = BlockStructure.scalar(scales.size)
    unit_rad_s = float(np.sqrt(problem.natural_rad_s * (problem.omega_c_rad_s or problem.natural_rad_s)))
    span = frequency_span(with_bandwidth(problem))
    omega = np.geomspace(span.slow / _BEYOND, span.fast * _BEYOND, _GRID)
    if options.frequency_grid is not None:
        low, high, points = options.frequency_grid
        omega = np.geomspace(low, high, int(points))
    plant = replace(plant, system=with_channel_scales(plant.system, structure, scales))
    return DkProblem(plant, structure, unit_rad_s, omega, span.grid(_DENSE, margin=_DENSE_BEYOND))

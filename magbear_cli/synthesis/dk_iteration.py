"""D-K iteration on any generalised plant: a controller for fixed D-scales, D-scales for a fixed controller, in turn.

Each D-scale is fitted by a rational function, which adds its states to the controller twice: on the way in and out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError, Status
from magbear_cli.kernels.block_structure import BlockStructure
from magbear_cli.kernels.hinf import require_hinf_plant
from magbear_cli.lti.balancing import with_balanced_states, with_time_unit
from magbear_cli.lti.connection import lower_lft
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.generalized_plant import GeneralizedPlant
from magbear_cli.model.table import Column, Table
from magbear_cli.synthesis.channel_scaling import constant_scales, with_channel_scales
from magbear_cli.synthesis.design import Design
from magbear_cli.synthesis.gamma_search import GammaSearch, Ports, controller_in_si, search_gamma, with_unit_penalty
from magbear_cli.synthesis.scaling_step import RationalScales, fit_scales, peak_mu

Floats = NDArray[np.float64]

_DENSE = 600  # points of the grid that mu is judged on, where the caller has none of his own
_BEYOND = 1e4  # how far that grid reaches past both ends of the one for the D-scales
_FIRST_GAMMA = 1.02  # times the level that the present controller reaches with the fitted D-scales
_DOUBLINGS = 6  # of gamma in a step: from a level far above the present one nothing good has come
_GAIN = 1e-4  # of peak mu: a step that gains less is idle
_PATIENCE = 2  # idle steps in a row: then nothing more will come


@dataclass(frozen=True)
class DkOptions:
    """How long to iterate, and with what D-scales.

    Parameters
    ----------
    d_order : states of each fitted D-scale
    iterations : steps of D and K after the first controller, at most
    gamma_tolerance : relative width of the last bracket of each search for the least gamma
    channel_scaling : begin with the constant D-scales of least gamma; otherwise with the plant's own units
    fit_every_scale : fit all D-scales and not only their ratios to that of the last full block
    """

    d_order: int = 2
    iterations: int = 6
    gamma_tolerance: float = 1e-3
    channel_scaling: bool = True
    fit_every_scale: bool = False

    def __post_init__(self) -> None:
        """Refuse numbers no iteration can work with."""
        if not 1e-6 <= self.gamma_tolerance < 1:
            raise NumericsError(f"gamma_tolerance must lie between 1e-6 and 1, not {self.gamma_tolerance}")
        if self.d_order < 0 or self.iterations < 0:
            raise NumericsError("d_order and iterations must not be negative")


@dataclass(frozen=True, eq=False)
class DkProblem:
    """A generalised plant, the blocks that its disturbances and errors belong to, and the frequencies that matter.

    Parameters
    ----------
    plant : GeneralizedPlant
    structure : uncertainty and performance, in the order of the plant's channels; performance is a full block
    unit_rad_s : the unit of frequency in which to solve, near the middle of what matters
    omega_rad_s : (w,) positive ascending grid for the D-scales
    dense_rad_s : (v,) ascending grid that mu is judged on, 0 and ∞ allowed at its ends
    """

    plant: GeneralizedPlant
    structure: BlockStructure
    unit_rad_s: float
    omega_rad_s: Floats
    dense_rad_s: Floats

    def __post_init__(self) -> None:
        """Refuse a structure that does not fit the plant."""
        system, ports = self.plant.system, self.ports
        channels = (system.outputs - ports.measurements, system.inputs - ports.controls)
        if channels != (self.structure.outputs, self.structure.inputs):
            wanted = f"{self.structure.outputs} errors and {self.structure.inputs} disturbances"
            raise NumericsError(f"the block structure has {wanted}, the plant {channels[0]} and {channels[1]}")

    @classmethod
    def over(cls, plant: GeneralizedPlant, structure: BlockStructure, omega_rad_s: Floats) -> DkProblem:
        """The problem on a grid for the D-scales, judged far beyond both of its ends and at 0 and ∞ too."""
        low, high = float(omega_rad_s[0]), float(omega_rad_s[-1])
        inner = np.geomspace(low / _BEYOND, high * _BEYOND, _DENSE)
        return cls(plant, structure, float(np.sqrt(low * high)), omega_rad_s, np.concatenate([[0.0], inner, [np.inf]]))

    @property
    def ports(self) -> Ports:
        """The plant's numbers of measurements and controls."""
        return Ports(self.plant.measurements, self.plant.controls)


@dataclass(frozen=True, eq=False)
class _Setting:
    """The plant in scaled time, controls and channels, those units, and the frequencies it is looked at."""

    plant: StateSpace
    structure: BlockStructure
    ports: Ports
    unit_rad_s: float
    unit_controls: Floats
    omega: Floats
    dense: Floats


@dataclass(frozen=True, eq=False)
class _Iterate:
    controller: StateSpace
    peak: float
    gamma: float
    step: int
    scales: RationalScales | None = None


def design_dk(problem: DkProblem, options: DkOptions | None = None) -> Design:
    """The controller with the least peak mu (complex blocks) among the iterates of the D-K iteration.

    ``level`` is the peak of mu recomputed from the matrices returned, in SI units, between the points of a dense grid
    as well; the loop of every iterate was stable in the units it was found in. ``statistics`` holds the frequency of
    the peak, the peak of the first controller, the gamma of the step the controller comes from, the number of that
    step, and the numbers of steps and of H-infinity solves; the table ``scales`` the D-scales of that step. A level
    above one is ``not_achieved`` and no proof; no controller or numbers that cannot be worked with are
    ``not_achieved`` and ``failed``, with the reason.

    Notes
    -----
    Doyle 1985. Order = that of the plant + 2·d_order for each fitted scalar block; for a full block d_order times its
    outputs and inputs, for a repeated one 2·d_order times its size. D-K iteration is not monotone, so the best iterate
    is kept and two steps without gain are the last. A step that finds no controller is tried again with D-scales fitted
    under another weighting.
    """
    options = options or DkOptions()
    try:
        setting = _setting(problem, options)
        best, statistics = _iterate(setting, options)
        if best is None:
            return Design(None, Status.NOT_ACHIEVED, "no stabilising controller was found", statistics=statistics)
        controller = controller_in_si(best.controller, setting.unit_rad_s, setting.unit_controls)
        level, omega = peak_mu(problem.plant.closed_by(controller), problem.structure, problem.dense_rad_s)
    except NumericsError as error:
        return Design(None, Status.FAILED, str(error))
    statistics |= {"gamma": best.gamma, "best_step": best.step, "peak_omega_rad_s": omega}
    tables = {} if best.scales is None else {"scales": _scales_table(best.scales, setting.unit_rad_s)}
    return Design(controller, *_verdict(level, best.peak), level, statistics, tables=tables)


def _scales_table(scales: RationalScales, unit_rad_s: float) -> Table:
    """The D-scales that the controller was designed with, in dB: best at each frequency, and fitted."""
    decibel = 20.0 / np.log(10.0)
    columns = [Column("omega_rad_s", unit_rad_s * scales.omega_rad_s, "rad/s", "frequency")]
    for place, found in enumerate(scales.found):
        number = place + 1
        columns.append(Column(f"d_{number}_found_db", decibel * found, "dB", f"scale of block {number}, found"))
        fit = decibel * scales.fitted(place)
        columns.append(Column(f"d_{number}_fit_db", fit, "dB", f"scale of block {number}, fitted"))
    return Table(tuple(columns), "D-scale (dB)")


def _verdict(level: float, believed: float) -> tuple[Status, str]:
    if not level <= 1.01 * believed:
        sentence = f"peak mu is {believed:.4g} in scaled units, but {level:.4g} for the controller in SI units"
        return Status.UNVERIFIED, sentence
    if level > 1.0:
        return Status.NOT_ACHIEVED, f"the least peak mu found is {level:.4g}, above 1 (no proof)"
    return Status.OK, ""


def _setting(problem: DkProblem, options: DkOptions) -> _Setting:
    """The plant in good units; refused in plain words when the method cannot work on it."""
    own, structure, ports = problem.plant.system, problem.structure, problem.ports
    scaled, _ = with_unit_penalty(own, ports)
    matrices = (scaled.a, scaled.b, scaled.c, scaled.d)
    require_hinf_plant(*matrices, measurements=ports.measurements, controls=ports.controls)
    plant = with_time_unit(own, problem.unit_rad_s)
    if options.channel_scaling:
        plant = with_channel_scales(plant, structure, constant_scales(plant, structure, ports))
    plant, unit_controls = with_unit_penalty(plant, ports)
    grids = problem.omega_rad_s / problem.unit_rad_s, problem.dense_rad_s / problem.unit_rad_s
    return _Setting(with_balanced_states(plant), structure, ports, problem.unit_rad_s, unit_controls, *grids)


def _iterate(setting: _Setting, options: DkOptions) -> tuple[_Iterate | None, dict[str, float]]:
    """The best of the first controller and of those after it, each from the one before."""
    search = search_gamma(setting.plant, options.gamma_tolerance, ports=setting.ports)
    statistics: dict[str, float] = {"solves": search.solves, "steps": 0}
    if search.best is None:
        return None, statistics
    best = _judged(setting, search.best.controller, search.best.gamma, 0)
    statistics["first_peak_mu"] = best.peak
    waiting, idle = _fits(setting, best, options), 0
    for step in range(1, options.iterations + 1):
        if not waiting or idle == _PATIENCE:
            break
        scales = waiting.pop(0)
        search = _k_step(setting, scales, options)
        statistics["solves"] += search.solves
        statistics["steps"] = step
        if search.best is None:
            continue
        found = _judged(setting, search.best.controller, search.best.gamma, step, scales)
        idle = 0 if found.peak < best.peak * (1.0 - _GAIN) else idle + 1
        best = min(best, found, key=lambda iterate: iterate.peak)
        waiting = _fits(setting, found, options)
    return best, statistics


def _k_step(setting: _Setting, scales: RationalScales, options: DkOptions) -> GammaSearch:
    def measure(controller: StateSpace) -> float:
        return scales.norm(lower_lft(setting.plant, controller), setting.dense)

    try:
        return search_gamma(
            scales.around(setting.plant, setting.ports),
            options.gamma_tolerance,
            ports=setting.ports,
            start=_FIRST_GAMMA * scales.level,
            doublings=_DOUBLINGS,
            measure=measure,
            looked_at=True,  # the plant itself was; scales that are stable and of minimum phase do it no harm
        )
    except NumericsError as error:
        return GammaSearch(sentence=str(error))


def _fits(setting: _Setting, present: _Iterate, options: DkOptions) -> list[RationalScales]:
    loop = lower_lft(setting.plant, present.controller)
    return fit_scales(loop, setting.structure, setting.omega, options.d_order, every_scale=options.fit_every_scale)


def _judged(
    setting: _Setting, controller: StateSpace, gamma: float, step: int, scales: RationalScales | None = None
) -> _Iterate:
    peak, _ = peak_mu(lower_lft(setting.plant, controller), setting.structure, setting.dense)
    return _Iterate(controller, peak, gamma, step, scales)

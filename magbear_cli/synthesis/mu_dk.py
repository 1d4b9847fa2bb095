"""D-K iteration, the classic way to low mu: a controller for fixed D-scales, D-scales for a fixed controller, in turn.

Each D-scale is fitted by a rational function, which adds its states to the controller twice: on the way in and out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError, Status
from magbear_cli.kernels.hinf import require_hinf_plant
from magbear_cli.lti.balancing import with_balanced_states, with_time_unit
from magbear_cli.lti.connection import lower_lft
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.generalized_plant import Form, GeneralizedPlant, build_generalized_plant
from magbear_cli.model.problem import ControlProblem
from magbear_cli.synthesis.channel_scaling import constant_scales, thesis_scales, with_channel_scales
from magbear_cli.synthesis.design import Design
from magbear_cli.synthesis.frequency_span import frequency_span, with_bandwidth
from magbear_cli.synthesis.gamma_search import GammaSearch, controller_in_si, search_gamma, with_unit_penalty
from magbear_cli.synthesis.scaling_step import RationalScales, fit_scales, peak_mu

Floats = NDArray[np.float64]

_GRID = 100  # points of the grid for the D-scales, when none is given
_DENSE = 900  # points of the grid that mu is judged on, before its peaks are looked into
_BEYOND = 10.0  # how far the grid for the D-scales reaches past the slowest and the fastest mark
_FIRST_GAMMA = 1.02  # times the level that the present controller reaches with the fitted D-scales
_DOUBLINGS = 6  # of gamma in a step: from a level far above the present one nothing good has come
_GAIN = 1e-4  # of peak mu: a step that gains less is idle
_PATIENCE = 2  # idle steps in a row: then nothing more will come


@dataclass(frozen=True)
class MuDkOptions:
    """How long to iterate, and with what D-scales.

    Parameters
    ----------
    d_order : states of each fitted D-scale
    iterations : steps of D and K after the first controller, at most
    gamma_tolerance : relative width of the last bracket of each search for the least gamma
    frequency_grid : (low, high, points), rad/s and logarithmic, for the D-scales; None: from the problem
    form : the third output as derived, or as the thesis's program A.5 has it
    channel_scaling : begin with the constant D-scales of least gamma; otherwise with the units of the thesis
    fit_every_scale : fit all D-scales and not only their ratios to the last, as the thesis does (33 states)
    """

    d_order: int = 2
    iterations: int = 6
    gamma_tolerance: float = 1e-3
    frequency_grid: tuple[float, float, float] | None = None
    form: Form = "mended"
    channel_scaling: bool = True
    fit_every_scale: bool = False

    def __post_init__(self) -> None:
        """Refuse numbers no iteration can work with."""
        if not 1e-6 <= self.gamma_tolerance < 1:
            raise NumericsError(f"gamma_tolerance must lie between 1e-6 and 1, not {self.gamma_tolerance}")
        if self.d_order < 0 or self.iterations < 0:
            raise NumericsError("d_order and iterations must not be negative")
        if self.frequency_grid is not None:
            low, high, points = self.frequency_grid
            if not (0 < low < high < np.inf and 2 <= points < np.inf):
                raise NumericsError(f"a frequency grid needs 0 < low < high and two points, not {self.frequency_grid}")
            if points < 2 * self.d_order + 1:
                raise NumericsError(f"{points:.0f} points do not determine D-scales of order {self.d_order}")


@dataclass(frozen=True, eq=False)
class _Setting:
    """The plant in scaled time, current and channels, those units, and the frequencies it is looked at."""

    plant: StateSpace
    unit_rad_s: float
    unit_a: float
    omega: Floats
    dense: Floats


@dataclass(frozen=True, eq=False)
class _Iterate:
    controller: StateSpace
    peak: float
    gamma: float
    step: int


def design_mu_dk(problem: ControlProblem, options: MuDkOptions | None = None) -> Design:
    """The controller with the least peak mu (complex blocks) among the iterates of the D-K iteration.

    ``level`` is the peak of mu recomputed from the matrices returned, in SI units, between the points of a dense grid
    as well. ``statistics`` holds the peak of the mended form, that of the first controller, the gamma of the step the
    controller comes from, the number of that step, and the numbers of steps and of H-infinity solves. Status and
    sentence as for ``design_hinf``: a level above one is ``not_achieved`` and no proof.

    Notes
    -----
    Doyle 1985; the thesis, sections 2.3.4 and 3.3-3.5. Order = 2 + the order of W1 + 2·d_order for each fitted scale.
    D-K iteration is not monotone, so the best iterate is kept and two steps without gain are the last. A step that
    finds no controller is tried again with D-scales fitted under another weighting.
    """
    options = options or MuDkOptions()
    try:
        generalized = build_generalized_plant(problem, options.form)
        setting = _setting(problem, generalized, options)
        best, statistics = _iterate(setting, options)
        if best is None:
            return Design(None, Status.NOT_ACHIEVED, "no stabilising controller was found", statistics=statistics)
        controller = controller_in_si(best.controller, setting.unit_rad_s, setting.unit_a)
        dense = setting.dense * setting.unit_rad_s
        level, omega = peak_mu(generalized.closed_by(controller), dense)
        mended, _ = peak_mu(build_generalized_plant(problem).closed_by(controller), dense)
    except NumericsError as error:
        return Design(None, Status.FAILED, str(error))
    statistics |= {"gamma": best.gamma, "best_step": best.step, "peak_omega_rad_s": omega, "peak_mu_mended": mended}
    if not level <= 1.01 * best.peak:
        sentence = f"peak mu is {best.peak:.4g} in scaled units, but {level:.4g} for the controller in SI units"
        return Design(controller, Status.UNVERIFIED, sentence, level, statistics)
    if level > 1.0:
        sentence = f"the least peak mu found is {level:.4g}, above 1 (no proof)"
        return Design(controller, Status.NOT_ACHIEVED, sentence, level, statistics)
    return Design(controller, Status.OK, "", level, statistics)


def _setting(problem: ControlProblem, generalized: GeneralizedPlant, options: MuDkOptions) -> _Setting:
    """The plant in good units; refused in plain words when the method cannot work on it."""
    unit_rad_s = float(np.sqrt(problem.natural_rad_s * (problem.omega_c_rad_s or problem.natural_rad_s)))
    named = with_channel_scales(generalized.system, thesis_scales(problem, generalized))
    per_current, unit_a = with_unit_penalty(named)
    require_hinf_plant(per_current.a, per_current.b, per_current.c, per_current.d, measurements=1, controls=1)
    plant = with_time_unit(named, unit_rad_s)
    if options.channel_scaling:
        plant = with_channel_scales(plant, constant_scales(plant))
    plant, unit_a = with_unit_penalty(plant)
    span = frequency_span(with_bandwidth(problem))
    if options.frequency_grid is None:
        omega = np.geomspace(span.slow / _BEYOND, span.fast * _BEYOND, _GRID)
    else:
        omega = _logarithmic(*options.frequency_grid)
    dense = span.grid(_DENSE, margin=1e4)
    return _Setting(with_balanced_states(plant), unit_rad_s, unit_a, omega / unit_rad_s, dense / unit_rad_s)


def _logarithmic(low: float, high: float, points: float) -> Floats:
    return np.geomspace(low, high, int(points))


def _iterate(setting: _Setting, options: MuDkOptions) -> tuple[_Iterate | None, dict[str, float]]:
    """The best of the first controller and of those after it, each from the one before."""
    search = search_gamma(setting.plant, options.gamma_tolerance)
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
        found = _judged(setting, search.best.controller, search.best.gamma, step)
        idle = 0 if found.peak < best.peak * (1.0 - _GAIN) else idle + 1
        best = min(best, found, key=lambda iterate: iterate.peak)
        waiting = _fits(setting, found, options)
    return best, statistics


def _k_step(setting: _Setting, scales: RationalScales, options: MuDkOptions) -> GammaSearch:
    def measure(controller: StateSpace) -> float:
        return scales.norm(lower_lft(setting.plant, controller), setting.dense)

    start = _FIRST_GAMMA * scales.level
    plant = scales.around(setting.plant)
    return search_gamma(plant, options.gamma_tolerance, start=start, doublings=_DOUBLINGS, measure=measure)


def _fits(setting: _Setting, present: _Iterate, options: MuDkOptions) -> list[RationalScales]:
    loop = lower_lft(setting.plant, present.controller)
    return fit_scales(loop, setting.omega, options.d_order, every_scale=options.fit_every_scale)


def _judged(setting: _Setting, controller: StateSpace, gamma: float, step: int) -> _Iterate:
    return _Iterate(controller, peak_mu(lower_lft(setting.plant, controller), setting.dense)[0], gamma, step)

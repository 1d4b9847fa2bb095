"""The best controller of a given low order: a first-order lead found on a grid, then descents, one lag at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import Status
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import worst_level
from magbear_cli.model.scaling import scale_problem
from magbear_cli.synthesis.descent import Descended, Descent, Grids
from magbear_cli.synthesis.design import Design
from magbear_cli.synthesis.exact_level import exact_level
from magbear_cli.synthesis.frequency_span import FrequencySpan, frequency_span, with_bandwidth
from magbear_cli.synthesis.half_plane import (
    complex_mu_level,
    complex_mu_rows,
    real_mass_level,
    real_mass_rows,
    widest_margin,
)
from magbear_cli.synthesis.lag_ratio import LagRatio
from magbear_cli.synthesis.least_current import least_current_descent
from magbear_cli.synthesis.near_integrator import raise_slow_poles
from magbear_cli.synthesis.stabilisation import loop_resonances, stabilises

_TOO_NEAR = 0.1  # of the logarithm: two lags so close are one
_FASTEST_LAG = 3.0  # times the fastest mark
_AROUND_RESONANCE = (0.3, 1.0, 3.0)  # of a resonance of the weight: lags that may shape K across it


@dataclass(frozen=True)
class FixedOrderOptions:
    """What to search for.

    ``order``: states of the controller; ``uncertainty``: the mass as the real number it is, or a complex block;
    ``minimise``: the worst case itself, or the peak of |K S| with the worst case (or mu) held at 1.
    """

    order: int = 1
    uncertainty: Literal["real", "complex"] = "real"
    minimise: Literal["worst_case", "ks_peak"] = "worst_case"


def design_fixed_order(problem: ControlProblem, options: FixedOrderOptions) -> Design:
    """The controller of this order with the least worst case (real mass) or peak mu (complex blocks), or least current.

    The search is local, from several starts: what it reaches is an upper bound of the least value of this order. The
    level of the answer is the worst case, the peak of mu, or the peak of |K S| in A/m, whichever was minimised.
    """
    if problem.family.is_fixed:  # mu of a known plant is its worst case
        options = replace(options, uncertainty="real")
    limited = with_bandwidth(problem)
    raised = raise_slow_poles(limited)
    scaled, scaling = scale_problem(raised.problem)
    best = search_order(scaled, options)
    controller = raised.lowered(scaling.controller(best.controller.controller()))
    if raised.problem is not limited and options.uncertainty == "real":  # the weight that was asked for decides
        best = replace(best, level=exact_level(limited, controller))
    statistics = {"cone_programs": float(best.solves), "scaled_level": best.level}
    if best.level > 1.0:
        sentence = (
            f"the best controller of order {options.order} found reaches {best.level:.4g}, above the level 1 asked for"
        )
        return Design(controller, Status.NOT_ACHIEVED, sentence, best.level, statistics)
    if options.minimise == "ks_peak":
        own = scale_problem(raise_slow_poles(problem).problem)[0]
        least = _search_least_current(own, best, options)
        statistics["cone_programs"] += float(least.solves)
        return Design(
            raised.lowered(scaling.controller(least.controller.controller())),
            Status.OK,
            level=least.level * scaling.gain_a_per_m,
            statistics=statistics,
        )
    return Design(controller, Status.OK, "", best.level, statistics)


def search_order(scaled: ControlProblem, options: FixedOrderOptions) -> Descended[LagRatio]:
    """The best controller found of this order."""
    return next(islice(search_orders(scaled, options), options.order - 1, None))


def search_orders(scaled: ControlProblem, options: FixedOrderOptions) -> Iterator[Descended[LagRatio]]:
    """The best found of order 1, 2, 3, … without end: from a lead, then from the best before it with one lag more."""
    span = frequency_span(scaled)
    grids = Grids(span.grid(70), span.grid(900, margin=1e4))
    descent = ratio_descent(scaled, options.uncertainty)
    best = descent.run(best_lead(scaled), grids)
    while True:
        yield _recomputed(scaled, best, options)
        best = _grow(best, best.controller.poles.size + 1, descent, grids, span)


def _recomputed(scaled: ControlProblem, best: Descended[LagRatio], options: FixedOrderOptions) -> Descended[LagRatio]:
    """The same controller with the level of its matrices, peaks between the frequencies of the descent included."""
    if options.uncertainty == "complex":
        return best
    return replace(best, level=max(best.level, exact_level(scaled, best.controller.controller())))


def _search_least_current(
    scaled: ControlProblem, meeting: Descended[LagRatio], options: FixedOrderOptions
) -> Descended[LagRatio]:
    """Descend on the peak of |K S|: from the lead, growing, where a lead meets the specification; else as it stands.

    ``meeting`` is a controller of the full order that meets the specification.
    """
    span = frequency_span(with_bandwidth(scaled))
    grids = Grids(span.grid(80), span.grid(900, margin=1e4))
    descent = least_current_descent(scaled, options.uncertainty)
    direct = descent.run(meeting.controller, grids)
    first = search_order(with_bandwidth(scaled), replace(options, order=1))
    if options.order == 1 or first.level > 1.0:
        return direct
    grown = _grow(descent.run(first.controller, grids), options.order, descent, grids, span)
    best = min(direct, grown, key=lambda descended: descended.level)
    return replace(best, solves=direct.solves + first.solves + grown.solves)


def _grow(
    best: Descended[LagRatio], order: int, descent: Descent[LagRatio], grids: Grids, span: FrequencySpan
) -> Descended[LagRatio]:
    """One lag more at a time, each time descending from several places for it."""
    solves = best.solves
    for _ in range(best.controller.poles.size, order):
        lags = _new_lags(best.controller.poles, span)
        trials = [descent.run(best.controller.with_lag(lag), grids) for lag in lags]
        solves += sum(trial.solves for trial in trials)
        best = min(trials, key=lambda trial: trial.level)
    return replace(best, solves=solves)


def ratio_descent(scaled: ControlProblem, uncertainty: Literal["real", "complex"]) -> Descent[LagRatio]:
    """The descent of K = X/Y on the worst case over the real mass, or on mu with complex blocks."""
    span = frequency_span(scaled)
    level, rows = (real_mass_level, real_mass_rows) if uncertainty == "real" else (complex_mu_level, complex_mu_rows)

    def measure(ratio: LagRatio, omega: NDArray[np.float64]) -> NDArray[np.float64]:
        return level(scaled, ratio.response(omega), omega)

    def propose(ratio: LagRatio, omega: NDArray[np.float64], target: float) -> tuple[LagRatio, float]:
        return widest_margin(rows(scaled, ratio, omega, target), ratio, span.fastest_pole)

    def resonances(ratio: LagRatio) -> NDArray[np.float64]:
        return loop_resonances(scaled, ratio.controller())

    return Descent(measure, propose, lambda ratio: stabilises(scaled, ratio.controller()), resonances)


def _new_lags(present: NDArray[np.float64], span: FrequencySpan) -> list[float]:
    """Lags spread over the span and around the weight's resonances, none on top of one that is there.

    Where all are there, the one with the most room.
    """
    slow, fast = span.slow, _FASTEST_LAG * span.fast
    spread = np.geomspace(slow, fast, 4)
    candidates = np.concatenate([spread, np.outer(span.weight_resonances, _AROUND_RESONANCE).ravel()])
    lags: list[float] = []
    for candidate in candidates:
        others = np.concatenate([present, lags])
        if _distance(np.array([candidate]), others)[0] > _TOO_NEAR:
            lags.append(float(candidate))
    if lags:
        return lags
    candidates = np.geomspace(slow, fast, 8 * (present.size + 1))
    return [float(candidates[_distance(candidates, present).argmax()])]


def _distance(candidates: NDArray[np.float64], present: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far each candidate is from the nearest lag that is there, in the logarithm."""
    return np.asarray(np.abs(np.log(candidates[:, None] / present[None, :])).min(axis=1), dtype=float)


def best_lead(scaled: ControlProblem) -> LagRatio:
    """K = −k (1 + s/z)/(1 + s/p) with the least worst case on a grid of (k, z, p) that is stable for every mass."""
    span = frequency_span(scaled)
    gain = np.geomspace(1.2, 0.5 * max(span.fast**2, 10.0), 32)
    zero = np.geomspace(0.1, span.fast, 14)
    spread = np.geomspace(1.5, 3e3, 14)
    k, z, ratio = (axis.ravel() for axis in np.meshgrid(gain, zero, spread, indexing="ij"))
    p = z * ratio
    # Routh: (m s² − 1)(1 + s/p) + k (1 + s/z) is stable for k > 1 and k/z − 1/p > (k − 1)/p, whatever the mass.
    stable = k / z > k / p
    k, z, p = k[stable], z[stable], p[stable]
    # A resonance can hide between few frequencies: the best on a coarse grid are judged again on a finer one.
    for points, kept in ((36, 60), (400, 1)):
        order = np.argsort(_worst_of_leads(scaled, (k, z, p), span.grid(points, margin=10.0)), kind="stable")[:kept]
        k, z, p = k[order], z[order], p[order]
    k_best, z_best, p_best = k[0], z[0], p[0]
    x = -k_best * np.array([p_best / z_best, 1.0 - p_best / z_best])
    return LagRatio(np.array([p_best]), x, np.array([1.0, 0.0]))


def _worst_of_leads(
    scaled: ControlProblem,
    leads: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    omega: NDArray[np.float64],
) -> NDArray[np.float64]:
    """The worst case of each lead (k, z, p) over the mass range and these frequencies."""
    k, z, p = leads
    worst = np.zeros(k.size)
    for point in omega:
        at = np.full(k.size, point)
        response = -k * (1 + 1j * point / z) / (1 + 1j * point / p) if np.isfinite(point) else -k * p / z + 0j
        worst = np.maximum(worst, worst_level(scaled, np.asarray(response), at)[0])
    return worst

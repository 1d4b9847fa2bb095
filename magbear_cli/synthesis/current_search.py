"""The search for least current over given poles, and over as many poles that may move.

With a convex set held about the present controller (half-planes or D-scales) the least current is a convex problem in
the coefficients of K S over given closed-loop poles. Held anew about the answer, the set contains it, so the current
can only fall. Over many poles that finds the optimum of any order; over few, moves of the poles join the unknowns, in
steps that are believed only after everything was recomputed.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.model.problem import ControlProblem
from magbear_cli.model.robust_performance import control_sensitivity
from magbear_cli.synthesis.all_pass_sections import Sections
from magbear_cli.synthesis.control_set import Uncertainty, held_set, specification_level
from magbear_cli.synthesis.current_program import CurrentUnits, least_current
from magbear_cli.synthesis.current_wish import CurrentWish
from magbear_cli.synthesis.descent import Responds
from magbear_cli.synthesis.peak import local_maxima
from magbear_cli.synthesis.section_controller import SectionController

Floats = NDArray[np.float64]

AIM = 0.999  # of the level asked for, at the constrained frequencies
MET = 0.9995  # of the level asked for, at all frequencies: what a proof without a grid needs beneath one
_GAIN = 3e-4  # of the cost: an iteration that gains less is the last
_EXCHANGE = 3e-4  # a peak between the constrained points that is higher than this by a part joins them
_SETTLING, _MOVES = 12, 16  # most iterations with the poles held, then moving
_LARGEST_MOVE, _LEAST_MOVE = 0.4, 0.015  # of the logarithm of a pole
_MOVED = 1e-3  # of the cost: a move that gains less is too large
_PENALTY = 100.0  # what missing the specification by one costs, in units of the current
_STRIDE = 5  # between the instants that are constrained anyway
_NEAR = 0.93  # of the largest current: the instants that are constrained too


@dataclass(frozen=True, eq=False)
class Curves:
    """The specification's level and |K S| over the dense frequencies; |u| over the instants, none if it is no wish."""

    levels: Floats
    gains: Floats
    step: Floats


@dataclass(frozen=True, eq=False)
class Candidate:
    """A controller with its recomputed figures, in the units of the scaled problem.

    ``level`` is the largest of the specification; ``cost`` is what is minimised, a missed specification included.
    """

    form: SectionController
    cost: float
    level: float
    curves: Curves

    @property
    def peak_ks(self) -> float:
        """The largest |K S|."""
        return float(self.curves.gains.max())

    @property
    def peak_step(self) -> float:
        """The largest current after a unit step; zero where it is no wish."""
        return float(self.curves.step.max(initial=0.0))


@dataclass
class CurrentSearch:
    """One problem: what is specified, what is wished, the dense frequencies that judge and those constrained so far."""

    scaled: ControlProblem
    uncertainty: Uncertainty
    wish: CurrentWish
    dense: Floats
    omega: Floats
    solves: int = 0
    _near: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    _step_unit: float = 0.0

    def settle(self, present: Responds, sections: Sections, most: int = _SETTLING) -> Candidate:
        """The least current over these poles, reached by holding anew until nothing is gained, ``most`` times at most.

        Raises
        ------
        NumericsError
            when not a single cone program was solved.
        """
        still = SectionController(sections, np.zeros(sections.order - 3))
        best: Candidate | None = None
        for _ in range(most):
            try:
                candidate, fresh = self._solved(present, still)
            except NumericsError:
                if best is None:
                    raise
                break
            small = best is not None and candidate.cost > best.cost * (1.0 - _GAIN)
            if best is None or candidate.cost < best.cost:
                best = candidate
            present = candidate.form
            if small and not fresh:
                break
        if best is None:
            raise NumericsError("no cone program of least current was solved")
        return best

    def polish(self, best: Candidate) -> Candidate:
        """Move the poles too, within a trust region that shrinks when a step gains nothing."""
        move = _LARGEST_MOVE
        for _ in range(_MOVES):
            if move < _LEAST_MOVE:
                break
            try:
                candidate = self._moved(best, move)
            except NumericsError:
                move /= 3.0
                continue
            enough = candidate.cost < best.cost * (1.0 - _MOVED)
            best = candidate if candidate.cost < best.cost else best
            move = min(1.5 * move, _LARGEST_MOVE) if enough else move / 3.0
        return best

    def nudge(self, candidate: Candidate) -> Candidate:
        """The better of a controller and of what one large move of its poles makes of it."""
        try:
            moved = self._moved(candidate, _LARGEST_MOVE)
        except NumericsError:
            return candidate
        return min(candidate, moved, key=lambda tried: tried.cost)

    def _moved(self, best: Candidate, move: float) -> Candidate:
        """The controller with moved poles, its coefficients solved for once more where the first step gained little."""
        candidate, _ = self._solved(best.form, best.form, move)
        if candidate.cost <= best.cost * (1.0 - _MOVED):
            return candidate
        return self._solved(candidate.form, candidate.form)[0]

    def judge(self, form: SectionController) -> Candidate:
        """The figures of a controller over the dense frequencies and instants."""
        levels = specification_level(self.scaled, form, self.dense, self.uncertainty)
        gains, step = np.abs(form.control_sensitivity(self.dense)), np.abs(self.wish.step(form))
        price_ks, price_step = self.wish.prices()
        cost = price_ks * float(gains.max()) + price_step * float(step.max(initial=0.0))
        level = float(levels.max())
        missed = max(0.0, level - MET) if np.isfinite(level) else np.inf
        return Candidate(form, cost * (1.0 + _PENALTY * missed), level, Curves(levels, gains, step))

    def _solved(self, present: Responds, form: SectionController, move: float = 0.0) -> tuple[Candidate, bool]:
        """One cone program over the form's poles about the present controller, judged; whether points were added.

        With a move the poles are unknowns too, each logarithm within this bound.
        """
        self.solves += 1
        held = held_set(self.scaled, present, self.omega, AIM, self.uncertainty)
        current = self.wish.with_moves(form, self.omega) if move else self.wish.affine(form, self.omega)
        instants = np.union1d(np.arange(0, current.step_offset.size, _STRIDE), self._near)
        chosen = replace(
            current, step_offset=current.step_offset[instants], step_columns=current.step_columns[instants]
        )
        bounds = np.full(current.columns.shape[1] - form.q.size, move)
        ks = float(np.abs(control_sensitivity(self.scaled, present.response(self.omega), self.omega)).max())
        units = CurrentUnits((ks, self._step_unit or ks), self.wish.prices())
        solution = least_current(chosen, held, units, bounds)
        sections = form.sections
        if move:
            sections = sections.with_logarithms(sections.logarithms + solution[form.q.size :])
        answer = self.judge(SectionController(sections, solution[: form.q.size]))
        return answer, self._exchange(answer)

    def _exchange(self, candidate: Candidate) -> bool:
        """Constrain the peaks found between the constrained points; whether there were any."""
        curves = candidate.curves
        peaks = local_maxima(curves.levels, AIM + _EXCHANGE)
        if self.wish.kind == "ks_peak":
            largest = np.abs(candidate.form.control_sensitivity(self.omega)).max()
            peaks = np.union1d(peaks, local_maxima(curves.gains, largest * (1.0 + _EXCHANGE)))
        fresh = np.setdiff1d(self.dense[peaks], self.omega)
        self.omega = np.union1d(self.omega, fresh)
        if curves.step.size:
            self._near = np.flatnonzero(curves.step > _NEAR * curves.step.max())
            self._step_unit = float(curves.step.max())
        return fresh.size > 0

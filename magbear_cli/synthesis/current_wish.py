"""What least current means: the peak of |K S|, or of the current after a step; and how poles and gains enter it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from magbear_cli.model.filters import Prefilter
from magbear_cli.synthesis.section_controller import SectionController
from magbear_cli.synthesis.step_current import Instants, affine_step_current

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_TIE = 0.003  # what the peak of |K S| counts beside the step's current: of equal steps the quieter is wanted
_DIFFERENCE = 1e-5  # of the logarithm of a pole, for its derivative


@dataclass(frozen=True)
class AffineCurrent:
    """K S = offset + columns v at some frequencies, −u = step_offset + step_columns v at some instants.

    The first unknowns v are the coefficients of the form; the others, where there are any, moves of its poles.
    """

    offset: Complexes  # (w,)
    columns: Complexes  # (w, m)
    step_offset: Floats  # (t,)
    step_columns: Floats  # (t, m)


@dataclass(frozen=True)
class CurrentWish:
    """``instants`` None: the peak of |K S|; else the largest |u| there after a unit step through ``prefilter``.

    ``fastest``: up to which frequency the wish itself, and not only the specification, asks for poles.
    """

    instants: Instants | None = None
    prefilter: Prefilter | None = None
    fastest: float = 0.0

    @property
    def kind(self) -> Literal["ks_peak", "step_current"]:
        """The wish's name."""
        return "ks_peak" if self.instants is None else "step_current"

    def prices(self) -> tuple[float, float]:
        """What the peak of |K S| and what that of the step's current counts."""
        return (1.0, 0.0) if self.instants is None else (_TIE, 1.0)

    def weight(self, omega: Floats) -> Floats:
        """How much of K S at these frequencies goes into the current: all, or what the prefilter lets through."""
        if self.prefilter is None:
            return np.ones_like(omega)
        speed, zeta = self.prefilter.omega_rad_s, self.prefilter.zeta
        return np.asarray(speed**2 / np.abs(speed**2 - omega**2 + 2j * zeta * speed * omega))

    def step(self, form: SectionController) -> Floats:
        """−u at the instants, (t,); nothing where only K S matters."""
        offset, columns = self._affine_step(form)
        return offset + columns @ form.q

    def affine(self, form: SectionController, omega: Floats) -> AffineCurrent:
        """Both currents as functions of the form's coefficients, its poles held."""
        return AffineCurrent(*form.affine_terms(omega), *self._affine_step(form))

    def with_moves(self, form: SectionController, omega: Floats) -> AffineCurrent:
        """The same, with moves of the logarithms of the poles to first order about the form as further unknowns."""
        still = self.affine(form, omega)
        current, step = still.offset + still.columns @ form.q, still.step_offset + still.step_columns @ form.q
        columns, step_columns = [], []
        for direction in np.eye(form.sections.logarithms.size):
            moved = form.sections.with_logarithms(form.sections.logarithms + _DIFFERENCE * direction)
            other = SectionController(moved, form.q)
            columns.append((other.control_sensitivity(omega) - current) / _DIFFERENCE)
            step_columns.append((self.step(other) - step) / _DIFFERENCE)
        return AffineCurrent(
            still.offset,
            np.hstack([still.columns, np.stack(columns, axis=1)]),
            still.step_offset,
            np.hstack([still.step_columns, np.stack(step_columns, axis=1)]),
        )

    def _affine_step(self, form: SectionController) -> tuple[Floats, Floats]:
        if self.instants is None:
            return np.zeros(0), np.zeros((0, form.q.size))
        return affine_step_current(form, self.prefilter, self.instants)

"""A proof, in plain numbers, that no linear controller reaches a level: two stable rational functions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from magbear_cli.errors import NumericsError
from magbear_cli.model.problem import RationalWeight

HIGHEST_RELATIVE_DEGREE = 3


@dataclass(frozen=True)
class ImpossibilityCertificate:
    """The functions G_X and G_Y of a proof that every controller's worst case is above ``level``.

    With c and p the coefficients and poles (positive, ascending, in rad/s) of one function, and c0 its constant,
    G(s) = c0 + Σ c_k p_k/(s + p_k). One coefficient is not stored but follows from the others, so that a condition
    holds to the last digit: that of the slowest lag of G_X makes G_X'(0) = 0; when W1 falls off like 1/s² or 1/s³, that
    of the fastest lag of G_Y makes its 1/s term vanish.

    It proves its level when at every ω there are R, P ≥ 0 with |G_Y + level·R| < |W1| R, |G_X − level·P| < |W3| P and
    k_z + m_low ω² ≤ k_z R/P ≤ k_z + m_high ω².

    Parameters
    ----------
    x_poles_rad_s : (n,) with x_coefficients (n,): the constant, then those of the lags but the slowest
    y_poles_rad_s : (k,) with y_coefficients (k + 1,): the constant, then the lags; one less with a derived coefficient
    """

    level: float
    x_poles_rad_s: tuple[float, ...]
    x_coefficients: tuple[float, ...]
    y_poles_rad_s: tuple[float, ...]
    y_coefficients: tuple[float, ...]

    def __post_init__(self) -> None:
        """Refuse numbers that do not make two functions."""
        numbers = [self.level, *self.x_poles_rad_s, *self.x_coefficients, *self.y_poles_rad_s, *self.y_coefficients]
        if not np.isfinite(numbers).all() or self.level <= 0:
            raise NumericsError("a certificate needs finite numbers and a positive level")
        for poles in (self.x_poles_rad_s, self.y_poles_rad_s):
            if not poles or poles[0] <= 0 or any(b <= a for a, b in pairwise(poles)):
                raise NumericsError("the poles of a certificate are positive and ascending")
        spare = len(self.y_poles_rad_s) + 1 - len(self.y_coefficients)
        if len(self.x_coefficients) != len(self.x_poles_rad_s) or spare not in {0, 1}:
            raise NumericsError("the coefficients of a certificate do not match its poles")

    def numbers(self) -> dict[str, float | list[float]]:
        """The certificate as plain JSON values."""
        return {
            "level": self.level,
            "x_poles_rad_s": list(self.x_poles_rad_s),
            "x_coefficients": list(self.x_coefficients),
            "y_poles_rad_s": list(self.y_poles_rad_s),
            "y_coefficients": list(self.y_coefficients),
        }

    @classmethod
    def of_numbers(cls, numbers: Mapping[str, float | Sequence[float]]) -> ImpossibilityCertificate:
        """The certificate from what ``numbers`` gave; refuses what is no certificate."""
        level = numbers["level"]
        names = ("x_poles_rad_s", "x_coefficients", "y_poles_rad_s", "y_coefficients")
        lists = [numbers[name] for name in names]
        if not isinstance(level, (int, float)):
            raise NumericsError("the level of a certificate is one number")
        rows = [tuple(float(value) for value in row) for row in lists if not isinstance(row, (int, float))]
        if len(rows) != len(names):
            raise NumericsError("the poles and coefficients of a certificate are lists of numbers")
        return cls(float(level), *rows)


def relative_degree(weight: RationalWeight) -> int:
    """By how many powers of s the denominator exceeds the numerator."""
    return len(np.trim_zeros(weight.den, "f")) - len(np.trim_zeros(weight.num, "f"))

"""A proof, in plain numbers, that no linear controller reaches a level: two stable rational functions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import numpy as np

from magbear_cli.errors import NumericsError
from magbear_cli.model.problem import ControlProblem, RationalWeight

HIGHEST_RELATIVE_DEGREE = 3
PAIR_NUMBERS = 4  # of a second-order term: natural frequency, damping, and two coefficients
_ON_AXIS = 1e-6  # of its modulus: how near to the axis a zero of W1 counts as on it


@dataclass(frozen=True)
class ImpossibilityCertificate:
    """The functions G_X and G_Y of a proof that every controller's worst case is above ``level``.

    With c and p the coefficients and poles (positive, ascending, in rad/s) of one function, and c0 its constant,
    G(s) = c0 + Σ c_k p_k/(s + p_k). G_Y has second-order terms (a n² + b n s)/(s² + 2 ζ n s + n²) beside them, where W1
    has complex poles. Coefficients that follow from the others are not stored, so that a condition holds to the last
    digit: that of the slowest lag of G_X makes G_X'(0) = 0; when W1 falls off like 1/s² or 1/s³, that of the fastest
    lag of G_Y makes its 1/s term vanish; when W1 vanishes at rest, the constant of G_X makes G_X(0) = −G_Y(0).

    It proves its level when at every ω there are R, P ≥ 0 with |G_Y + level·R| < |W1| R, |G_X − level·P| < |W3| P and
    R/P between the ρ of both ends of the family, over the first end's k_z/k_i.

    Parameters
    ----------
    x_poles_rad_s : (n,) with x_coefficients (n,): the constant, then those of the lags but the slowest; one less with a
        derived constant
    y_poles_rad_s : (k,) with y_coefficients (k + 1,): the constant, then the lags; one less with a derived coefficient
    y_pairs : rows of four, the second-order terms of G_Y: n in rad/s, ζ, a, b
    """

    level: float
    x_poles_rad_s: tuple[float, ...]
    x_coefficients: tuple[float, ...]
    y_poles_rad_s: tuple[float, ...]
    y_coefficients: tuple[float, ...]
    y_pairs: tuple[tuple[float, ...], ...] = ()

    def __post_init__(self) -> None:
        """Refuse numbers that do not make two functions."""
        lists = (self.x_poles_rad_s, self.x_coefficients, self.y_poles_rad_s, self.y_coefficients, *self.y_pairs)
        numbers = [self.level, *(value for values in lists for value in values)]
        if not np.isfinite(numbers).all() or self.level <= 0:
            raise NumericsError("a certificate needs finite numbers and a positive level")
        for poles in (self.x_poles_rad_s, self.y_poles_rad_s):
            if not poles or poles[0] <= 0 or any(b <= a for a, b in pairwise(poles)):
                raise NumericsError("the poles of a certificate are positive and ascending")
        spare = len(self.y_poles_rad_s) + 1 - len(self.y_coefficients)
        spare_x = len(self.x_poles_rad_s) - len(self.x_coefficients)
        if spare_x not in {0, 1} or spare not in {0, 1}:
            raise NumericsError("the coefficients of a certificate do not match its poles")
        if any(len(pair) != PAIR_NUMBERS or pair[0] <= 0 or pair[1] <= 0 for pair in self.y_pairs):
            raise NumericsError("a second-order term of a certificate has a frequency and a damping above zero")

    def numbers(self) -> dict[str, float | list[float]]:
        """The certificate as plain JSON values."""
        return {
            "level": self.level,
            "x_poles_rad_s": list(self.x_poles_rad_s),
            "x_coefficients": list(self.x_coefficients),
            "y_poles_rad_s": list(self.y_poles_rad_s),
            "y_coefficients": list(self.y_coefficients),
            "y_pairs": [value for pair in self.y_pairs for value in pair],
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
        if len(rows) != len(names):  # one of them was a number
            raise NumericsError("the poles and coefficients of a certificate are lists of numbers")
        flat = numbers.get("y_pairs", [])
        if isinstance(flat, (int, float)) or len(flat) % PAIR_NUMBERS:
            raise NumericsError("the second-order terms of a certificate are four numbers each")
        pairs = [tuple(float(v) for v in flat[i : i + PAIR_NUMBERS]) for i in range(0, len(flat), PAIR_NUMBERS)]
        return cls(float(level), rows[0], rows[1], rows[2], rows[3], tuple(pairs))


def relative_degree(weight: RationalWeight) -> int:
    """By how many powers of s the denominator exceeds the numerator."""
    return len(np.trim_zeros(weight.den, "f")) - len(np.trim_zeros(weight.num, "f"))


def vanishes_at_rest(weight: RationalWeight) -> bool:
    """Whether the weight has a zero at s = 0, of the first order or higher."""
    return float(weight.num[-1]) == 0.0


def without_certificate(problem: ControlProblem) -> str:
    """Why no certificate of this kind exists for any level of a problem; empty where one may."""
    weight = problem.performance
    if problem.omega_c_rad_s is None:
        return "without a bandwidth limit there is nothing to be proven impossible"
    if not 0 <= relative_degree(weight) <= HIGHEST_RELATIVE_DEGREE:
        return f"the performance weight must fall off like 1/s^{HIGHEST_RELATIVE_DEGREE} at most and be proper"
    if (weight.poles_rad_s.real >= 0).any():
        return "the performance weight must be stable"
    if len(weight.num) > 1 and float(weight.num[-1]) == 0.0 == float(weight.num[-2]):
        return "certificates do not handle a performance weight that vanishes like s² at rest"
    zeros = np.roots(weight.num)
    zeros = zeros[np.abs(zeros) > 0]
    on_axis = zeros[np.abs(zeros.real) <= _ON_AXIS * np.abs(zeros)]
    if on_axis.size:
        return (
            f"certificates do not handle a performance weight with a zero on the imaginary axis,"
            f" at {abs(on_axis[0]):.6g} rad/s"
        )
    return ""


def derives_constant(problem: ControlProblem) -> bool:
    """Whether G_X(0) = −G_Y(0): where W1 vanishes at rest and every plant has the same stiffness there."""
    return vanishes_at_rest(problem.performance) and problem.family.is_known_at_rest


def fast_end_excess(weight: RationalWeight, level: float) -> int:
    """The sign of |W1(∞)| − level, exactly: every proper controller has S(∞) = 1, so none comes below |W1(∞)|."""
    num, den = np.trim_zeros(weight.num, "f"), np.trim_zeros(weight.den, "f")
    if len(num) < len(den) or not len(num):
        return -1
    excess = abs(Fraction(float(num[0]))) - Fraction(level) * abs(Fraction(float(den[0])))
    return 1 if len(num) > len(den) else (excess > 0) - (excess < 0)

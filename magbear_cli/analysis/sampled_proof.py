"""The proof that a sampled controller reaches a level, for every mass and every frequency up to π/T.

In s = (z − 1)/(z + 1) the loop at the sampling instants is one of continuous time: a quotient n/a, computed exactly
from the stored sections, and a plant whose dynamic stiffness runs along a segment (``model.held_plant``). So the
argument of ``gridless`` holds word for word, with W1 and W3 taken at ω = (2/T) arctan(v), s = jv. Where the delay is no
whole number of samples, two coefficients of the hold depend on the mass; they are replaced by intervals that hold all
their values. Stability is shown for one member of the family by Routh's test in exact arithmetic, and no other can
lose it.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from magbear_cli.analysis.axis_cover import cover_axis
from magbear_cli.analysis.exact_polynomial import Polynomial, exact_transfer_function, is_hurwitz
from magbear_cli.analysis.gridless import Disc, LevelProof, enclosed_fraction, level_conditions, polynomial_on_axis
from magbear_cli.analysis.interval import Enclosure, Interval
from magbear_cli.analysis.sampled_loop import SampledLoop
from magbear_cli.analysis.weight_enclosure import squared_modulus, squared_polynomial
from magbear_cli.lti.sampled_system import SampledSystem
from magbear_cli.model.held_plant import hold_shares_at, hold_stiffness

Floats = NDArray[np.float64]

_LIBRARY_ERROR = 16.0 * np.finfo(float).eps  # more than sinh, tanh and arctan of the C library are wrong by


def prove_sampled_level(loop: SampledLoop, level: float) -> LevelProof:
    """Prove that the sampled loop is stable and |W1 S| + |W3 T| < level, for every mass and 0 ≤ ω ≤ π/T.

    Parameters
    ----------
    level : a bound that the worst case does not touch
    """
    num, den = transformed(loop.controller)
    prover = _Prover.of(loop, (num, den), level)
    if not is_hurwitz(prover.member()):
        sentence = f"the sampled loop with m = {loop.problem.family.first.mass_kg:.6g} kg is not stable"
        return LevelProof(proved=False, sentence=sentence, level=level)
    with np.errstate(all="ignore"):
        cover = cover_axis(lambda x, fast: prover.conditions(x, fast=fast))
    if cover.is_positive:
        sentence = (
            f"proven for every mass and all frequencies up to π/T: stable, and the worst case is below {level:.6g}"
        )
    else:
        sentence = f"the level {level:.6g} {'is exceeded' if cover.is_refuted else 'could not be shown'}"
        sentence += f" near {prover.omega_rad_s(cover.x, fast=cover.fast):.6g} rad/s"
    return LevelProof(cover.is_positive, sentence, level, cover.boxes, cover.narrowest_box)


def transformed(controller: SampledSystem) -> tuple[Polynomial, Polynomial]:
    """The controller in s = (z − 1)/(z + 1) by descending powers: δ = 2 s/(1 − s) put into every section, exactly."""
    num, den = [Fraction(1)], [Fraction(1)]
    for section in controller.sections:
        own = exact_transfer_function(section)
        num, den = _product(num, _in_s(own[0])), _product(den, _in_s(own[1]))
    return num, den


def _in_s(polynomial: Polynomial) -> Polynomial:
    """p(2 s/(1 − s)) (1 − s)^n of a polynomial with n + 1 coefficients."""
    result = [Fraction(0)] * len(polynomial)
    degree = len(polynomial) - 1
    for place, coefficient in enumerate(polynomial):
        power = degree - place
        term = [coefficient * 2**power]
        for _ in range(power):
            term = _product(term, [Fraction(1), Fraction(0)])
        for _ in range(place):
            term = _product(term, [Fraction(-1), Fraction(1)])
        result = [old + new for old, new in zip(result, term, strict=True)]
    return result


def _product(one: Polynomial, other: Polynomial) -> Polynomial:
    result = [Fraction(0)] * (len(one) + len(other) - 1)
    for i, left in enumerate(one):
        for j, right in enumerate(other):
            result[i + j] += left * right
    return result


def _power(polynomial: Polynomial, exponent: int) -> Polynomial:
    result = [Fraction(1)]
    for _ in range(exponent):
        result = _product(result, polynomial)
    return result


@dataclass(frozen=True, eq=False)
class _Prover:
    """n with the whole delays in it, a likewise, the hold's two coefficients, and the ends of the family."""

    loop: SampledLoop
    num: Polynomial
    den: Polynomial
    hold: tuple[Interval, Interval]  # of s and of s²; the constant is 1
    ends: tuple[tuple[Interval, Interval, Interval], ...]  # µ, k_z and k_i
    level: float
    unit: float  # where the two halves of the axis meet, a power of two

    @classmethod
    def of(cls, loop: SampledLoop, quotient: tuple[Polynomial, Polynomial], level: float) -> _Prover:
        problem, sampling = loop.problem, loop.sampling
        late = sampling.whole_samples + (1 if sampling.part_s > 0.0 else 0)
        num = _product(quotient[0], _power([Fraction(-1), Fraction(1)], late))
        den = _product(quotient[1], _power([Fraction(1), Fraction(1)], late))
        if sampling.part_s > 0.0:
            slow, fast = (hold_shares_at(pole, sampling) for pole in problem.family.pole_range)
            r0, r2 = (_widened(low, high) for low, high in zip(fast, slow, strict=True))
            hold = (r0 - r2, r0 + r2 - 1.0)
        else:
            hold = (Interval.of(-1.0), Interval.of(0.0))  # without a part of a sample h has (1 − s) alone
        unit = 2.0 ** round(float(np.log2(problem.natural_rad_s * sampling.sample_time_s / 2.0)))
        return cls(loop, num, den, hold, _ends(loop), level, unit)

    def member(self) -> Polynomial:
        """(µ s² − k_z) a − k_i n of one member of the family, exactly."""
        held, k_z, k_i = (Fraction(float(part.low)) for part in self.ends[0])
        odd, even = (Fraction(float(part.low)) for part in self.hold)
        loop = _product(self.den, [held, Fraction(0), -k_z])
        pushed = _product(self.num, [even, odd, Fraction(1)])
        missing = [Fraction(0)] * (len(loop) - len(pushed))
        return [one - k_i * other for one, other in zip(loop, missing + pushed, strict=True)]

    def omega_rad_s(self, x: float, *, fast: bool) -> float:
        """The frequency that x stands for."""
        angle = np.arctan2(self.unit, x) if fast else np.arctan(self.unit * x)
        return float(2.0 * angle / self.loop.sampling.sample_time_s)

    def conditions(self, x: Enclosure, *, fast: bool) -> list[Enclosure]:
        """The Bernstein coefficients of ``gridless``, in x = v/unit on the slow half and x = unit/v on the fast one."""
        problem, omega = self.loop.problem, self._omega(x, fast=fast)
        num, den = self._coefficients(fast=fast)
        n, a = polynomial_on_axis(num, x), polynomial_on_axis(den, x)
        w1_a = squared_modulus(problem.performance, omega).root() * squared_polynomial(den, x).root()
        limited = x.of_constant(0.0)
        if problem.omega_c_rad_s is not None:
            w3 = omega.square() * (Interval.of(1.0) / problem.omega_c_rad_s / problem.omega_c_rad_s)
            limited = squared_polynomial(num, x).root() * w3
        square, one = x.square(), x.of_constant(1.0)
        inertia, rest = (one, square) if fast else (square, one)
        discs = []
        for held, k_z, k_i in self.ends:
            own = inertia * (held * self.unit * self.unit) + rest * k_z
            pulled = -k_i if fast else k_i
            discs.append(Disc(a[0] * own + n[0] * pulled, a[1] * own + n[1] * pulled, w1_a * own + limited * k_i))
        return level_conditions(discs, self.level)

    def _coefficients(self, *, fast: bool) -> tuple[list[Interval], list[Interval]]:
        """Numerator and denominator in x, the first with two more coefficients; read backwards on the fast half."""
        num = [enclosed_fraction(value) for value in self.num]
        zero = Interval.of(0.0)
        terms = [[*num, zero, zero], [zero, *num, zero], [zero, zero, *num]]
        odd, even = self.hold
        full = [even * e + odd * o + c for e, o, c in zip(terms[0], terms[1], terms[2], strict=True)]
        den = [enclosed_fraction(value) for value in self.den]
        rows = []
        for row, degree in ((full, len(den) + 1), (den, len(den) - 1)):
            scaled = [value * self.unit ** (len(row) - 1 - place) for place, value in enumerate(row)]
            padded = [zero] * (degree + 1 - len(row)) + scaled
            rows.append(padded[::-1] if fast else padded)
        return rows[0], rows[1]

    def _omega(self, x: Enclosure, *, fast: bool) -> Enclosure:
        """ω = (2/T) arctan(v) and its slope over x."""
        scale = 2.0 / Interval.of(self.loop.sampling.sample_time_s)
        if fast:
            square = x.whole.square() + self.unit**2
            slope = Interval.of(-self.unit) / square * scale
            ends = [np.arctan2(self.unit, part) for part in (x.whole.high, x.whole.low, x.centre.high, x.centre.low)]
        else:
            square = x.whole.square() * self.unit**2 + 1.0
            slope = Interval.of(self.unit) / square * scale
            ends = [np.arctan(self.unit * part) for part in (x.whole.low, x.whole.high, x.centre.low, x.centre.high)]
        return Enclosure(_widened(*ends[2:]) * scale, _widened(*ends[:2]) * scale, slope, x.reach)


def _ends(loop: SampledLoop) -> tuple[tuple[Interval, Interval, Interval], ...]:
    """µ, k_z and k_i of both ends: (µ v² + k_z)/k_i of every plant of the box lies between theirs at every v.

    µ rises with the mass and with k_z, and (µ v² + k_z)/k_z falls with k_z, so that a factor common to both
    stiffnesses moves the quotient as it does in continuous time.
    """
    ends = []
    for plant in loop.problem.family.ends:
        held = hold_stiffness(plant, loop.sampling)
        k_z, k_i = plant.negative_stiffness_n_per_m, plant.current_stiffness_n_per_a
        ends.append((_widened(held, held), Interval.of(k_z), Interval.of(k_i)))
    return tuple(ends)


def _widened(low: Floats | float, high: Floats | float) -> Interval:
    """The interval between computed values, made wider by what the library may be wrong by."""
    return Interval.of(low - _LIBRARY_ERROR * np.abs(low), high + _LIBRARY_ERROR * np.abs(high))

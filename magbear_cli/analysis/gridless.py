"""The proof that a stored controller reaches a level, for every plant and every frequency: no grid, no tolerance.

With K = n/a the level |W1 S| + |W3 T| < L holds at ω when L |(m ω² + k_z) a + k_i n| exceeds
|W1| |a| (m ω² + k_z) + |W3| k_i |n|. Both sides are affine along the segment between the ends of the family, each end
times any positive number. Squared, their difference is a quadratic there, positive when its Bernstein coefficients b0,
b1, b2 have b0 > 0, b2 > 0 and b1 + √(b0 b2) > 0: three functions of ω alone. They are enclosed over boxes that cover
[0, ∞], with the coefficients of n and a computed exactly from the controller's matrices. Where they are positive the
closed-loop polynomial has no root on the axis for any member, so that the whole family is stable once Routh's test, in
exact arithmetic, has shown one member to be.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from magbear_cli.analysis.axis_cover import cover_axis
from magbear_cli.analysis.exact_polynomial import Polynomial, exact_transfer_function, is_hurwitz
from magbear_cli.analysis.interval import Enclosure, Interval, polynomial
from magbear_cli.analysis.weight_enclosure import squared_polynomial
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.family import Plant
from magbear_cli.model.problem import ControlProblem

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class LevelProof:
    """Whether the level is proven, the sentence that says so or what is in the way, and the boxes it took."""

    proved: bool
    sentence: str
    level: float
    boxes: int = 0
    narrowest_box: float = float("nan")  # relative width


def prove_level(problem: ControlProblem, controller: StateSpace, level: float) -> LevelProof:
    """Prove that the loop is stable and |W1 S| + |W3 T| < level for every plant of the family and all frequencies.

    Parameters
    ----------
    controller : from measured position in m to control current in A, exactly as stored
    level : a bound that the worst case does not touch; a part in a thousand above it is proven in a second
    """
    if (controller.inputs, controller.outputs) != (1, 1):
        return LevelProof(
            proved=False, sentence="the controller does not map one measurement to one current", level=level
        )
    num, den = exact_transfer_function(controller)
    first = problem.family.first
    if not is_hurwitz(_closed_loop(first, num, den)):
        sentence = f"the loop with m = {first.mass_kg:.6g} kg is not stable"
        return LevelProof(proved=False, sentence=sentence, level=level)
    with np.errstate(all="ignore"):
        return _Prover.of(problem, (num, den), level).run()


def _closed_loop(plant: Plant, num: Polynomial, den: Polynomial) -> Polynomial:
    """(m s² − k_z) a − k_i n, exactly."""
    mass, k_z = Fraction(plant.mass_kg), Fraction(plant.negative_stiffness_n_per_m)
    k_i = Fraction(plant.current_stiffness_n_per_a)
    result = [mass * d for d in den] + [Fraction(0), Fraction(0)]
    for index, (n, d) in enumerate(zip(num, den, strict=True)):
        result[index + 2] -= k_z * d + k_i * n
    return result


def level_conditions(discs: list[Disc], level: float) -> list[Enclosure]:
    """b0, b2 and b1 + √(b0 b2) of the discs of a family's ends; b0 alone of one disc."""
    square = Interval.of(level).square()
    first, last = discs[0], discs[-1]
    ends = [disc.with_itself(square) for disc in (first, last)]
    if len(discs) == 1:
        return ends[:1]
    return [*ends, first.with_other(last, square) + ends[0].root() * ends[1].root()]


@dataclass(frozen=True, eq=False)
class Disc:
    """Real and imaginary part of the centre q a + k_i n of one end, and L times the radius."""

    real: Enclosure
    imaginary: Enclosure
    radius: Enclosure

    def with_itself(self, square: Interval) -> Enclosure:
        """L² |c|² − r², with squares kept squares."""
        return (self.real.square() + self.imaginary.square()) * square - self.radius.square()

    def with_other(self, other: Disc, square: Interval) -> Enclosure:
        """The bilinear form L² Re(c̄ c') − r r'."""
        both = self.real * other.real + self.imaginary * other.imaginary
        return both * square - self.radius * other.radius


@dataclass(frozen=True, eq=False)
class _Prover:
    """Coefficients in units of Ω, a power of two near the plant's own speed: s = Ω s'."""

    problem: ControlProblem
    unit: float
    num: list[Interval]
    den: list[Interval]
    level: float

    @classmethod
    def of(cls, problem: ControlProblem, quotient: tuple[Polynomial, Polynomial], level: float) -> _Prover:
        unit = 2.0 ** round(float(np.log2(problem.natural_rad_s)))
        num, den = ([enclosed_fraction(c / Fraction(unit) ** k) for k, c in enumerate(part)] for part in quotient)
        return cls(problem, unit, num, den, level)

    def run(self) -> LevelProof:
        """Both halves of the axis, slow frequencies in x = ω/Ω and fast ones in x = Ω/ω."""
        cover = cover_axis(lambda x, fast: self._conditions(x, fast=fast))
        if cover.is_positive:
            sentence = (
                f"proven for every mass and all frequencies: stable, and the worst case is below {self.level:.6g}"
            )
        else:
            verb = "is exceeded" if cover.is_refuted else "could not be shown"
            sentence = f"the level {self.level:.6g} {verb} {self._place(cover.x, fast=cover.fast)}"
        return LevelProof(cover.is_positive, sentence, self.level, cover.boxes, cover.narrowest_box)

    def _place(self, x: float, *, fast: bool) -> str:
        if x == 0.0:
            return "as ω → ∞" if fast else "at ω = 0"
        return f"near {self.unit / x if fast else self.unit * x:.6g} rad/s"

    def _conditions(self, x: Enclosure, *, fast: bool) -> list[Enclosure]:
        """b0, b2 and b1 + √(b0 b2), all divided by powers of ω on the fast half so that they stay finite."""
        num, den = (part[::-1] if fast else part for part in (self.num, self.den))
        n, a = polynomial_on_axis(num, x), polynomial_on_axis(den, x)
        n_size, a_size = squared_polynomial(num, x).root(), squared_polynomial(den, x).root()
        w1_a = self._performance(x, fast=fast) * a_size
        square, one = x.square(), x.of_constant(1.0)
        # In units: ω² = Ω² x²; on the fast half everything is divided by ω², and x = Ω/ω.
        inertia, rest = (one, square) if fast else (square, one)
        limited = x.of_constant(0.0)
        if self.problem.omega_c_rad_s is not None:
            limited = n_size * inertia * (Interval.of(1.0) / self.problem.omega_c_rad_s / self.problem.omega_c_rad_s)
        discs = []
        for plant in self.problem.family.ends:
            k_z, k_i = Interval.of(plant.negative_stiffness_n_per_m), Interval.of(plant.current_stiffness_n_per_a)
            own = inertia * plant.mass_kg + rest * (k_z / self.unit / self.unit)
            pulled = rest * (k_i / self.unit / self.unit)
            discs.append(Disc(a[0] * own + n[0] * pulled, a[1] * own + n[1] * pulled, w1_a * own + limited * k_i))
        return level_conditions(discs, self.level)

    def _performance(self, x: Enclosure, *, fast: bool) -> Enclosure:
        """|W1|, from its polynomials in units of Ω."""
        parts = []
        for coefficients in (self.problem.performance.num, self.problem.performance.den):
            trimmed = np.trim_zeros(np.array(coefficients, dtype=float), "f")
            # Ω is a power of two, so that these products are exact.
            row = [Interval.of(c * self.unit ** (trimmed.size - 1 - k)) for k, c in enumerate(trimmed)]
            parts.append(row[::-1] if fast else row)
        modulus = squared_polynomial(parts[0], x).root() * squared_polynomial(parts[1], x).root().reciprocal()
        for _ in range(len(parts[1]) - len(parts[0]) if fast else 0):
            modulus = modulus * x
        return modulus


def polynomial_on_axis(coefficients: list[Interval], x: Enclosure) -> tuple[Enclosure, Enclosure]:
    """Real and imaginary part of a polynomial, by descending powers, at jx."""
    ascending, square = coefficients[::-1], x.square()
    parts = []
    for start in (0, 1):
        chosen = [c if k % 2 == 0 else -c for k, c in enumerate(ascending[start::2])]
        parts.append(polynomial(chosen[::-1], square) if chosen else x.of_constant(0.0))
    return parts[0], x * parts[1]


def enclosed_fraction(value: Fraction) -> Interval:
    """The doubles on both sides of a rational number."""
    nearest = float(value)
    return Interval.of(np.nextafter(nearest, -np.inf), np.nextafter(nearest, np.inf))

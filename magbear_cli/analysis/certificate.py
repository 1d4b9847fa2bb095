"""The checker of a proof of impossibility: its scalar conditions, shown for all frequencies by interval arithmetic.

The certificate's functions G_X, G_Y prove that every linear time-invariant controller's worst case is above the level g
(decision 0010) if at every ω there are P, R ≥ 0 with |G_X − g P| < |W3| P, |G_Y + g R| < |W1| R and
q_low ≤ R/P ≤ q_high, the ρ = (m ω² + k_z)/k_i of both ends of the family over ρ(0) of the first: P carries the inverse
of that unit. With X = |G_X|²,
u = Re G_X, v = Im G_X, D_X = |W3|² X − g² v² > 0 and B± = g u ± √D_X, B+ > 0, the first says X/B+ < P < X/B− (no upper
bound where B− ≤ 0). The second alike, with −G_Y, W1 and A±. The two intervals of R/P meet if
|G_Y|² B− < q_high |G_X|² A+ and q_low |G_X|² A− < |G_Y|² B+.

All six are enclosed over boxes of ω that cover [0, ∞]: near 0 divided by the powers of ω, near ∞ by those of 1/ω, with
which they vanish. Nothing is taken from the search but the certificate's numbers; no sample is trusted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from magbear_cli.analysis.interval import Enclosure, Interval
from magbear_cli.analysis.lag_sum import LagSum
from magbear_cli.analysis.weight_enclosure import (
    squared_modulus,
    squared_modulus_at_infinity,
    without_zero_at_rest,
)
from magbear_cli.model.impossibility_certificate import (
    PAIR_NUMBERS,
    ImpossibilityCertificate,
    derives_constant,
    relative_degree,
    vanishes_at_rest,
    without_certificate,
)
from magbear_cli.model.problem import ControlProblem

Floats = NDArray[np.float64]

_FIRST_RATIO = 1.05  # upper over lower end of the first boxes
_NARROWEST = 1e-7  # relative width of a box that is no longer split
_MOST_BOXES = 20_000
_BEYOND = 1e6  # how far past all poles and corners the two end boxes begin

CONDITIONS = (
    "the bound on G_X leaves no measure",
    "the bound on G_Y leaves no force",
    "G_X points away from the measure",
    "G_Y points away from the force",
    "no plant is stiff enough",
    "no plant is soft enough",
)


@dataclass(frozen=True)
class CertificateCheck:
    """Whether the proof holds, the sentence that says so or where it does not, and the boxes it took."""

    valid: bool
    sentence: str
    level: float
    boxes: int = 0
    narrowest_box: float = float("nan")  # relative width


def check_certificate(problem: ControlProblem, certificate: ImpossibilityCertificate) -> CertificateCheck:
    """Show, or fail to show, that no linear controller of this problem has a worst case at or below the level."""
    refusal = _refusal(problem, certificate)
    if refusal:
        return CertificateCheck(valid=False, sentence=refusal, level=certificate.level)
    with np.errstate(all="ignore"):
        return _Checker(problem, certificate).run()


def _refusal(problem: ControlProblem, certificate: ImpossibilityCertificate) -> str:
    refusal = without_certificate(problem)
    if refusal:
        return refusal
    derived = len(certificate.y_poles_rad_s) + 1 - len(certificate.y_coefficients)
    if derived != int(relative_degree(problem.performance) >= 2):
        return "the certificate's functions do not fit the fall-off of the performance weight"
    if len(certificate.x_poles_rad_s) - len(certificate.x_coefficients) != int(derives_constant(problem)):
        return "the certificate's functions do not fit the performance weight at rest"
    return ""


@dataclass(frozen=True, eq=False)
class _End:
    """m/k_i (in s²) and k_z/k_i of one end of the family, both over the first end's k_z/k_i."""

    inertia: Interval
    stiffness: Interval


@dataclass(frozen=True, eq=False)
class _Checker:
    problem: ControlProblem
    certificate: ImpossibilityCertificate

    def run(self) -> CertificateCheck:
        """Both ends first, then boxes that are halved where a condition is not yet shown."""
        level = self.certificate.level
        low, high = self._ends()
        near_zero = self._near_zero_of_vanishing if vanishes_at_rest(self.problem.performance) else self._near_zero
        # One unit in the last place beyond 1/high, so that no frequency lies between this box and the last of the axis.
        far = float(np.nextafter(1.0 / high, np.inf))
        for end, at_end in (("ω → 0", near_zero(low)), ("ω → ∞", self._near_infinity(far))):
            shown = [bool(value.low[0] > 0) for value in at_end]
            if not all(shown):
                sentence = f"not shown at {end}: {CONDITIONS[shown.index(False)]}"
                return self._answer(sentence, 2, np.inf)
        count = int(np.ceil(np.log(high / low) / np.log(_FIRST_RATIO)))
        edges = np.geomspace(low, high, count + 1)
        edges[0], edges[-1] = low, high
        boxes, narrowest = 0, np.inf
        lower, upper = edges[:-1], edges[1:]
        while lower.size:
            boxes += lower.size
            narrowest = min(narrowest, float(((upper - lower) / lower).min()))
            values = self._over_boxes(lower, upper)
            refuted = np.stack([value.centre.high < 0 for value in values])
            if refuted.any():
                row, column = (int(i[0]) for i in np.nonzero(refuted))
                place = 0.5 * (lower[column] + upper[column])
                sentence = f"refuted at {place:.6g} rad/s: {CONDITIONS[row]}"
                return self._answer(sentence, boxes, narrowest)
            open_ = ~np.all([value.whole.low > 0 for value in values], axis=0)
            lower, upper = lower[open_], upper[open_]
            if lower.size and (narrowest < _NARROWEST or boxes + 2 * lower.size > _MOST_BOXES):
                sentence = f"not shown near {lower[0]:.6g} rad/s within {boxes} boxes"
                return self._answer(sentence, boxes, narrowest)
            middle = 0.5 * (lower + upper)
            lower, upper = np.concatenate([lower, middle]), np.concatenate([middle, upper])
        sentence = (
            f"proven for all frequencies: no linear time-invariant controller has a worst case of {level:.6g} or less"
        )
        return replace(self._answer(sentence, boxes, narrowest), valid=True)

    def _answer(self, sentence: str, boxes: int, narrowest: float) -> CertificateCheck:
        level = self.certificate.level
        return CertificateCheck(valid=False, sentence=sentence, level=level, boxes=boxes, narrowest_box=narrowest)

    def _ends(self) -> tuple[float, float]:
        """Where the end boxes stop: far outside of all poles, corners, the plant and ω_c."""
        problem, certificate = self.problem, self.certificate
        weight = [*np.abs(np.roots(problem.performance.num)), *np.abs(np.roots(problem.performance.den))]
        plant = [end.pole_rad_s for end in problem.family.ends]
        pairs = [pair[0] for pair in certificate.y_pairs]
        marks = np.array(
            [*certificate.x_poles_rad_s, *certificate.y_poles_rad_s, *pairs, *weight, *plant, problem.omega_c_rad_s]
        )
        marks = marks[marks > 0]
        return float(marks.min()) / _BEYOND, float(marks.max()) * _BEYOND

    def _near_zero(self, high: float) -> list[Interval]:
        """The same functions over [0, high], those that vanish at 0 divided by their power of ω."""
        omega = Interval.of(np.array([0.0]), np.array([high]))
        square = omega.square()
        (x_real, x_cubic), (y_real, y_linear) = self._x.near_zero(omega.as_column), self._y.near_zero(omega.as_column)
        x_size, y_size = (
            x_real.square() + (omega * square * x_cubic).square(),
            y_real.square() + (omega * y_linear).square(),
        )
        w1_squared = squared_modulus(self.problem.performance, Enclosure.of_variable(omega.low, omega.high)).whole
        x_room = self._limit() * x_size - square * (x_cubic * self._level).square()
        y_room = w1_squared * y_size - (omega * y_linear * self._level).square()
        least, most = self._ends_of_range()
        factors = square * least.inertia + least.stiffness, square * most.inertia + most.stiffness
        roots = square * x_room.root(), y_room.root()
        reals = x_real * self._level, -y_real * self._level
        return [x_room, y_room, *_meeting((x_size, y_size), reals, roots, factors)]

    def _near_zero_of_vanishing(self, high: float) -> list[Interval]:
        """The functions over [0, high] where W1 vanishes like ω: the second divided by ω², the last two by ω.

        Where all plants have one stiffness at rest, G_X(0) = −G_Y(0) takes out what would be left of the last two at
        ω = 0. With u = Re G_X = c + ω² u2 and a = −Re G_Y = c − ω² y2 the first of them is
        q |G_X|² (g a + ω r) − |G_Y|² (g u − ω² t), in which |G_X|² a − |G_Y|² u is u a (u − a) but for terms of ω².
        """
        omega = Interval.of(np.array([0.0]), np.array([high]))
        square, level = omega.square(), self._level
        x_curved, x_cubic = self._x.parts_near_zero(omega.as_column)
        y_curved, y_linear = self._y.parts_near_zero(omega.as_column)
        at_rest = self._x.at_rest, -self._y.at_rest
        u, a = at_rest[0] + square * x_curved, at_rest[1] - square * y_curved
        x_size, y_size = u.square() + (omega * square * x_cubic).square(), a.square() + (omega * y_linear).square()
        variable = Enclosure.of_variable(omega.low, omega.high)
        reduced = squared_modulus(without_zero_at_rest(self.problem.performance), variable).whole  # |W1/ω|²
        x_room = self._limit() * x_size - square * (x_cubic * level).square()
        y_room = reduced * y_size - (y_linear * level).square()
        t, r = x_room.root(), y_room.root()
        most_x, most_y = u * level + square * t, a * level + omega * r
        least, most = self._ends_of_range()
        if not derives_constant(self.problem):
            factors = square * least.inertia + least.stiffness, square * most.inertia + most.stiffness
            reals, roots = (u * level, a * level), (square * t, omega * r)
            return [x_room, y_room, *_meeting((x_size, y_size), reals, roots, factors)]
        rest = u * a * (x_curved + y_curved) + square.square() * x_cubic.square() * a - y_linear.square() * u
        heavy = omega * level * (rest + most.inertia * x_size * a)
        heavy = heavy + (square * most.inertia + 1.0) * x_size * r + omega * y_size * t
        light = -(omega * level * (rest + least.inertia * x_size * a))
        light = light + (square * least.inertia + 1.0) * x_size * r + omega * y_size * t
        return [x_room, y_room, most_x, most_y, heavy, light]

    def _near_infinity(self, high: float) -> list[Interval]:
        """The same functions over 1/ω in [0, high], each times the power of ω that makes it finite and not zero."""
        inverse = Interval.of(np.array([0.0]), np.array([high]))
        square = inverse.square()
        (x_real, x_linear), (y_real, y_lowest) = (
            self._x.near_infinity(inverse.as_column),
            self._y.near_infinity(inverse.as_column),
        )
        degree = relative_degree(self.problem.performance)
        powers = [Interval.of(np.ones(1)), inverse, square, square * inverse]
        lowest = 3 if degree >= 2 else 1
        x_size = x_real.square() + (inverse * x_linear).square()
        y_size = y_real.square() + (powers[lowest] * y_lowest).square()
        variable = Enclosure.of_variable(inverse.low, inverse.high)
        w1_squared = squared_modulus_at_infinity(self.problem.performance, variable).whole
        x_room = self._limit() * x_size - (square * inverse * x_linear * self._level).square()
        y_room = w1_squared * y_size - (powers[lowest - degree] * y_lowest * self._level).square()
        least, most = self._ends_of_range()
        factors = square * least.stiffness + least.inertia, square * most.stiffness + most.inertia
        roots = x_room.root(), powers[degree] * y_room.root()
        reals = square * x_real * self._level, -y_real * self._level
        return [x_room, y_room, *_meeting((x_size, y_size), reals, roots, factors)]

    def _over_boxes(self, low: Floats, high: Floats) -> list[Enclosure]:
        """The six functions of ω that must be positive, in the order of their names, over boxes with 0 < low."""
        omega = Enclosure.of_variable(low, high)
        square = omega.square()
        (x_real, x_imaginary), (y_real, y_imaginary) = self._x.over_boxes(low, high), self._y.over_boxes(low, high)
        x_size, y_size = x_real.square() + x_imaginary.square(), y_real.square() + y_imaginary.square()
        w1_squared = squared_modulus(self.problem.performance, omega)
        x_room = square.square() * self._limit() * x_size - (x_imaginary * self._level).square()
        y_room = w1_squared * y_size - (y_imaginary * self._level).square()
        least, most = self._ends_of_range()
        factors = square * least.inertia + least.stiffness, square * most.inertia + most.stiffness
        reals = x_real * self._level, -y_real * self._level
        return [x_room, y_room, *_meeting((x_size, y_size), reals, (x_room.root(), y_room.root()), factors)]

    @property
    def _level(self) -> Interval:
        return Interval.of(self.certificate.level)

    @property
    def _x(self) -> LagSum:
        certificate = self.certificate
        if not derives_constant(self.problem):
            return LagSum.of(certificate.x_poles_rad_s, certificate.x_coefficients, 0)
        lags = LagSum.of(certificate.x_poles_rad_s, (0.0, *certificate.x_coefficients), 0)
        return replace(lags, constant=-(lags.at_rest + self._y.at_rest))

    @property
    def _y(self) -> LagSum:
        derived = -1 if relative_degree(self.problem.performance) >= 2 else None
        lags = LagSum.of(self.certificate.y_poles_rad_s, self.certificate.y_coefficients, derived)
        return replace(lags, pairs=np.array(self.certificate.y_pairs, dtype=float).reshape(-1, PAIR_NUMBERS))

    def _ends_of_range(self) -> tuple[_End, _End]:
        """The first and the last end, which have the smaller and the larger ρ at every frequency."""
        family = self.problem.family
        first = Interval.of(family.first.negative_stiffness_n_per_m) / family.first.current_stiffness_n_per_a
        ends = []
        for plant in (family.first, family.last):
            unit = first * plant.current_stiffness_n_per_a
            known = family.is_known_at_rest or plant is family.first
            stiffness = Interval.of(1.0) if known else Interval.of(plant.negative_stiffness_n_per_m) / unit
            ends.append(_End(Interval.of(plant.mass_kg) / unit, stiffness))
        return ends[0], ends[1]

    def _limit(self) -> Interval:
        """1/ω_c⁴."""
        return Interval.of(float(self.problem.omega_c_rad_s or np.nan)).square().square().reciprocal()


Number = TypeVar("Number", Interval, Enclosure)


def _meeting(
    sizes: tuple[Number, Number],
    reals: tuple[Number, Number],
    roots: tuple[Number, Number],
    factors: tuple[Number, Number],
) -> list[Number]:
    """B+, A+, and the two differences that are positive when the intervals of R/P and of the family meet.

    Pairs are of X and Y: |G|², level times the real part, the root of the room; and the factors of both ends.
    """
    most_x, least_x = reals[0] + roots[0], reals[0] - roots[0]
    most_y, least_y = reals[1] + roots[1], reals[1] - roots[1]
    heavy = factors[1] * sizes[0] * most_y - sizes[1] * least_x
    light = sizes[1] * most_x - factors[0] * sizes[0] * least_y
    return [most_x, most_y, heavy, light]

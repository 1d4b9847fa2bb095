"""A sampled system as a chain of sections of at most two states, each counted in the change from sample to sample.

With δ = z − 1 a section is δx = A x + B e, y = C x + D e: the state's increment is computed and added. Where sampling
is fast, poles crowd at z = 1, and single precision can hold them by their distance from it only (Middleton and Goodwin
1986). The transfer function is that of the usual form with A + I in place of A.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment

from magbear_cli.errors import NumericsError
from magbear_cli.lti.balancing import with_balanced_states
from magbear_cli.lti.connection import series
from magbear_cli.lti.conversion import zeros_poles_gain
from magbear_cli.lti.state_space import StateSpace

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_CIRCLE = np.geomspace(1e-6, np.pi, 400)  # angles (rad) at which the peak of a section is looked for
_LEAST_TURN = 1e-12  # in δ; poles nearer to zero are taken for integrators when the unit of a state is chosen


@dataclass(frozen=True, eq=False)
class SampledSystem:
    """One input, one output: sections in δ, the first takes the measurement and the last gives the output.

    Parameters
    ----------
    sections : one-by-one systems of at most two states, at least one of them
    sample_time_s : positive
    """

    sections: tuple[StateSpace, ...]
    sample_time_s: float

    @property
    def order(self) -> int:
        """The number of states."""
        return sum(section.order for section in self.sections)

    @property
    def incremental(self) -> StateSpace:
        """The whole chain in δ: A, B, C, D with x[k+1] = x[k] + A x[k] + B y[k]."""
        return reduce(series, self.sections)

    @property
    def shifted(self) -> StateSpace:
        """The whole chain in z: A, B, C, D with x[k+1] = A x[k] + B y[k]."""
        whole = self.incremental
        return StateSpace(whole.a + np.eye(whole.order), whole.b, whole.c, whole.d)

    @property
    def has_integrator(self) -> bool:
        """Whether a pole is exactly at z = 1, where the response is then infinite."""
        return any(section.order > 0 and delta_polynomials(section)[1][-1] == 0.0 for section in self.sections)

    def second_order_sections(self) -> Floats:
        """Rows b0 b1 b2 1 a1 a2 by descending powers of z, one a section."""
        rows = []
        for section in self.sections:
            num, den = delta_polynomials(section)
            shift = np.array([[1.0, -2.0, 1.0], [0.0, 1.0, -1.0], [0.0, 0.0, 1.0]])  # (z − 1)², z − 1 and 1
            padded = [np.concatenate([np.zeros(3 - part.size), part]) @ shift for part in (num, den)]
            missing = 3 - den.size  # a section of fewer states is one of two with poles and zeros at z = 0
            rows.append(np.concatenate([np.roll(part, -missing) for part in padded]))
        return np.array(rows)

    def response(self, angle_rad: ArrayLike) -> Complexes:
        """The response at z = exp(j·angle), of the shape of the angles; angle is ω times the sample time."""
        angle = np.asarray(angle_rad, dtype=float)
        delta = 2j * np.sin(angle / 2.0) * np.exp(0.5j * angle)  # exp(j·angle) − 1 without cancellation
        result = np.ones(angle.shape, dtype=complex)
        for section in self.sections:
            num, den = delta_polynomials(section)
            result = result * np.polyval(num, delta) / np.polyval(den, delta)
        return result

    def output(self, measurements: ArrayLike) -> Floats:
        """What the system answers to these samples (n,) from rest, by the recursion that firmware runs."""
        states = [np.zeros(section.order) for section in self.sections]
        answers = []
        for measurement in np.asarray(measurements, dtype=float).ravel():
            signal = float(measurement)
            for place, section in enumerate(self.sections):
                state = states[place]
                states[place] = state + (section.a @ state + section.b[:, 0] * signal)
                signal = float(section.c[0] @ state + section.d[0, 0] * signal)
            answers.append(signal)
        return np.array(answers)


def delta_polynomials(section: StateSpace) -> tuple[Floats, Floats]:
    """(num, den) of a section of at most two states by descending powers of δ, den monic."""
    a, b, c, d = section.a, section.b[:, 0], section.c[0], float(section.d[0, 0])
    if section.order == 0:
        return np.array([d]), np.array([1.0])
    if section.order == 1:
        den = np.array([1.0, -a[0, 0]])
        return np.array([d, c[0] * b[0] + d * den[1]]), den
    den = np.array([1.0, -(a[0, 0] + a[1, 1]), a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]])
    adjugate = np.array([[-a[1, 1], a[0, 1]], [a[1, 0], -a[0, 0]]])
    return np.array([d, c @ b + d * den[1], c @ adjugate @ b + d * den[2]]), den


def bilinear(system: StateSpace, sample_time_s: float, prewarp_rad_s: float = 0.0) -> SampledSystem:
    """The system sampled by Tustin's rule s = (ω0/tan(ω0 T/2))·(z − 1)/(z + 1), section by section.

    Parameters
    ----------
    system : one input, one output
    sample_time_s : T
    prewarp_rad_s : ω0, below π/T: where the response is that of the system exactly; 0 for the rule s = (2/T) …

    Raises
    ------
    NumericsError
        when the prewarped frequency is not below half the sampling frequency, or a pole lies where the rule has none.
    """
    if not 0.0 <= prewarp_rad_s * sample_time_s < np.pi:
        raise NumericsError(
            f"prewarping at {prewarp_rad_s:.6g} rad/s needs a sample time below {np.pi / prewarp_rad_s:.3g} s"
        )
    speed = 2.0 / sample_time_s
    if prewarp_rad_s > 0.0:
        speed = prewarp_rad_s / np.tan(prewarp_rad_s * sample_time_s / 2.0)
    zeros, poles, gain = zeros_poles_gain(system)
    if np.any(poles == speed):
        raise NumericsError("a pole of the controller is where Tustin's rule has no image; change the sample time")
    chain = []  # zeros, poles and direct gain of each section, in δ
    for own_zeros, own_poles in paired(zeros, poles):
        missing = own_poles.size - own_zeros.size  # zeros at infinity go to z = −1
        moved = np.concatenate([2.0 * own_zeros / (speed - own_zeros), np.full(missing, -2.0)])
        landed = 2.0 * own_poles / (speed - own_poles)
        direct = float((np.prod(speed - own_zeros) / np.prod(speed - own_poles)).real)
        peak = _peak(moved, landed, direct)
        gain *= peak
        chain.append((moved, landed, direct / peak))
    moved, landed, direct = chain[-1]
    chain[-1] = (moved, landed, direct * gain)
    return SampledSystem(tuple(_section(*part) for part in chain), sample_time_s)


def _section(zeros: Complexes, poles: Complexes, direct: float) -> StateSpace:
    """direct·Π(δ − zero)/Π(δ − pole) with as many zeros as poles, in states that rounding hardly disturbs.

    Two real poles follow each other; a pair σ ± jω is a rotation, less tight where ω is small. How one state drives the
    next is a matter of units; poles at zero give none, and there the second state drives the output as it is driven.
    """
    if poles.size == 0:
        return StateSpace.gain([[direct]])
    if poles.size == 1:
        pole, zero = poles[0].real, zeros[0].real
        return with_balanced_states(StateSpace.of([[pole]], [1.0], [direct * (pole - zero)], [[direct]]))
    first, second = (poles[0], poles[1]) if poles[0].imag == 0 else (poles[0].real, poles[0].real)
    slope = direct * (poles.sum() - zeros.sum()).real
    square = 0.0 if poles[0].imag == 0 else poles[0].imag ** 2
    rest = direct * (np.prod(second - zeros).real - square)
    turn = max(np.sqrt(square), 0.1 * float(np.abs(poles).max()))
    if turn < _LEAST_TURN:
        turn = float(np.sqrt(abs(rest))) or 1.0
    a = [[first.real, -square / turn], [turn, second.real]]
    return with_balanced_states(StateSpace.of(a, [1.0, 0.0], [[slope, rest / turn]], [[direct]]))


def paired(zeros: Complexes, poles: Complexes) -> list[tuple[Complexes, Complexes]]:
    """Groups (zeros, poles) of at most two poles, slow ones first, each pole with a zero near to it.

    A zero that nearly cancels a pole must stand in its section: apart they would make a large gain and take it back,
    and rounding with it. Conjugate zeros need two poles of one section, so they choose first; real ones then go one by
    one.
    """
    upper, alone = poles[poles.imag > 0], [np.array([pole]) for pole in poles[poles.imag == 0]]
    groups = [(zeros[:0], np.array([pole, pole.conjugate()])) for pole in upper]
    pairs = [np.array([zero, zero.conjugate()]) for zero in zeros[zeros.imag > 0]]
    while pairs:
        empty = [place for place, (own, _) in enumerate(groups) if own.size == 0]
        homes = [groups[place][1] for place in empty]
        couples = list(combinations(range(len(alone)), 2))
        homes += [np.concatenate([alone[one], alone[other]]) for one, other in couples]
        costs = np.array([[_distance(pair, home) for home in homes] for pair in pairs])
        row, column = (int(place) for place in np.unravel_index(costs.argmin(), costs.shape))
        if column < len(empty):
            groups[empty[column]] = (pairs[row], homes[column])
        else:
            groups.append((pairs[row], homes[column]))
            couple = couples[column - len(empty)]
            alone = [pole for place, pole in enumerate(alone) if place not in couple]
        del pairs[row]
    open_ = [place for place, (own, _) in enumerate(groups) if own.size == 0]
    slots = [groups[place][1][half : half + 1] for place in open_ for half in (0, 1)] + alone
    real = [np.array([zero]) for zero in zeros[zeros.imag == 0]]
    given: dict[int, Complexes] = {}
    if real:
        costs = np.array([[_distance(zero, slot) for slot in slots] for zero in real])
        given = {int(slot): real[int(row)] for row, slot in zip(*linear_sum_assignment(costs), strict=True)}
    taken = [given.get(place, zeros[:0]) for place in range(len(slots))]
    for number, place in enumerate(open_):
        groups[place] = (np.concatenate(taken[2 * number : 2 * number + 2]), groups[place][1])
    singles = sorted(zip(taken[2 * len(open_) :], alone, strict=True), key=lambda single: _speed(single[1]))
    for start in range(0, len(singles), 2):
        parts = singles[start : start + 2]
        groups.append((np.concatenate([own for own, _ in parts]), np.concatenate([around for _, around in parts])))
    return sorted(groups, key=lambda group: _speed(group[1])) or [(zeros[:0], poles[:0])]


def _distance(zeros: Complexes, poles: Complexes) -> float:
    """How far apart they are, relative to their size."""
    sizes = [np.log(np.maximum(np.abs(roots), 1e-12)) + 1j * np.abs(np.angle(-roots)) for roots in (zeros, poles)]
    return float(np.abs(sizes[0] - sizes[1]).mean())


def _speed(roots: Complexes) -> float:
    return float(np.exp(np.log(np.maximum(np.abs(roots), 1e-12)).mean()))


def _peak(zeros: Complexes, poles: Complexes, direct: float) -> float:
    """About the largest gain over the circle, as a power of two; one where there is none."""
    delta = 2j * np.sin(_CIRCLE / 2.0) * np.exp(0.5j * _CIRCLE)
    gain = direct * np.prod(delta[:, None] - zeros, axis=1) / np.prod(delta[:, None] - poles, axis=1)
    largest = float(np.abs(gain).max())
    return 2.0 ** round(float(np.log2(largest))) if 0.0 < largest < np.inf else 1.0

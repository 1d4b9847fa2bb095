"""The search for a proof that no linear controller reaches a level: the dual of the exact real-mass problem.

An adversary weighs, at every frequency, the masses of the range by a measure of total P and force R, and turns the
two bounds against the controller. If the weighted sum of the closed-loop inequalities is the real part of G_Y Y + G_X X
with stable G_X and G_Y, it integrates to zero over frequency while it must be positive (decision 0010). Here the
measure is left free at grid points, and G_X and G_Y are sought among sums of lags by a cone program with a margin;
frequencies where the conditions fail between the points join the grid. What is found is a candidate: a proof only once
it is checked.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.conic import Cone, solve_cone_program
from magbear_cli.model.family import FIRST, LAST
from magbear_cli.model.impossibility_certificate import (
    ImpossibilityCertificate,
    derives_constant,
    relative_degree,
    vanishes_at_rest,
    without_certificate,
)
from magbear_cli.model.problem import ControlProblem, RationalWeight
from magbear_cli.model.scaling import scale_problem
from magbear_cli.synthesis.frequency_span import FrequencySpan, frequency_span
from magbear_cli.synthesis.near_integrator import raise_slow_poles

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_LAGS = (1.0, 5.0)  # the slowest lag over the slow end of the span, the fastest over its fast end
_CORE, _TAIL, _DENSE = 110, 14, 3000  # grid points within the span, on each side of it, and to find failures between
_BEYOND_CORE, _BEYOND = 5.0, 1e5
_X_REACH = 0.02  # of ω_c: slower lags of G_X nearly cancel each other, since W3 is tiny there
_Y_PART = 0.85  # lags of G_Y beside those of G_X: more only make its coefficients large
_FEWEST = 12  # lags, however narrow the span
_SLACK = 1e-4  # relative room on the dense grid that a checker can be expected to confirm
_MOST_FAILURES = 24  # frequencies that join the grid in a round: more of them are ripples of rounding
_MOST_DAMPING = 0.95  # of second-order terms: beyond, they nearly are lags, and their coefficients cancel
_LEAST = 1e-4  # of the mean: how small R and P may become beside their units


@dataclass(frozen=True)
class ImpossibilityOptions:
    """``lags_per_decade``: how dense the poles of both functions lie; ``rounds``: most cone programs."""

    lags_per_decade: float = 12.0
    rounds: int = 6


@dataclass(frozen=True)
class ImpossibilitySearch:
    """What a search came to: functions that hold on a dense grid and are worth checking, or None.

    ``margin`` is that of the last cone program, relative to R and P: negative where these lags cannot do it, and then
    the nearer to zero the less is missing; NaN where no program was solved.
    """

    certificate: ImpossibilityCertificate | None
    margin: float = float("nan")


def find_impossibility(
    problem: ControlProblem, level: float = 1.0, options: ImpossibilityOptions | None = None
) -> ImpossibilitySearch:
    """Search for two functions that prove a level out of reach; not to find any proves nothing.

    Where none can be found, ``without_certificate`` says why: without a bandwidth limit every level above |W1(∞)| is
    reached by gain alone; W1 must be stable and fall off by at most the third power of s.
    """
    options = options or ImpossibilityOptions()
    if without_certificate(problem):
        return ImpossibilitySearch(None)
    # A proof for the weight with its slowest poles raised, which is nowhere larger, is one for the weight itself.
    scaled, scaling = scale_problem(raise_slow_poles(problem).problem)
    search = _Search.of(scaled, level, options.lags_per_decade)
    try:
        found = search.run(options.rounds)
    except NumericsError:
        return ImpossibilitySearch(None)
    if found.certificate is None:
        return found
    unit = scaling.omega_rad_s
    in_si = replace(
        found.certificate,
        x_poles_rad_s=tuple(pole * unit for pole in found.certificate.x_poles_rad_s),
        y_poles_rad_s=tuple(pole * unit for pole in found.certificate.y_poles_rad_s),
        y_pairs=tuple((pair[0] * unit, *pair[1:]) for pair in found.certificate.y_pairs),
    )
    return replace(found, certificate=in_si)


@dataclass(frozen=True, eq=False)
class _Functions:
    """Real and imaginary parts of the functions that G_X or G_Y is sought in, (w, n) each."""

    real: Floats
    imaginary: Floats


@dataclass(frozen=True, eq=False)
class _Search:
    """The problem in its own units, the lags, and what does not change from round to round."""

    scaled: ControlProblem
    level: float
    span: FrequencySpan
    x_poles: Floats
    y_poles: Floats
    y_pairs: Floats  # (m, 2): natural frequency and damping of W1's complex poles

    @classmethod
    def of(cls, scaled: ControlProblem, level: float, lags_per_decade: float) -> _Search:
        span = frequency_span(scaled)
        slow, fast = _LAGS[0] * span.slow, _LAGS[1] * span.fast
        count = max(_FEWEST, int(np.ceil(lags_per_decade * np.log10(fast / slow))))
        y_poles = np.geomspace(slow, fast, int(_Y_PART * count))
        slow = max(slow, _X_REACH * span.fast)
        count = max(_FEWEST, int(np.ceil(lags_per_decade * np.log10(fast / slow))))
        return cls(scaled, level, span, np.geomspace(slow, fast, count), y_poles, _complex_poles(scaled.performance))

    def run(self, rounds: int) -> ImpossibilitySearch:
        """Solve, look between the grid points, add what fails there, until nothing fails or the margin is gone."""
        slow, fast = self.span.slow, self.span.fast
        core = np.geomspace(slow / _BEYOND_CORE, fast * _BEYOND_CORE, _CORE)
        low = np.geomspace(slow / _BEYOND, slow / _BEYOND_CORE, _TAIL)
        high = np.geomspace(fast * _BEYOND_CORE, fast * _BEYOND, _TAIL)
        omega = np.unique(np.concatenate([low, core, high, self.span.resonances]))
        dense = np.union1d(np.geomspace(slow / _BEYOND, fast * _BEYOND, _DENSE), self.span.resonances)
        # Below the fast end R and P k_z follow √(1 + ω²) and its inverse; beyond it R levels off and P falls like 1/ω².
        p_unit = 1.0 / np.sqrt((1.0 + omega**2) * (1.0 + (omega / fast) ** 2))
        r_unit = (1.0 + omega**2) * p_unit
        margin = np.nan
        for turn in range(rounds):
            x, y, margin, r, p = self._widest_margin(omega, r_unit, p_unit)
            if self._derives_constant:  # to the last digit, not to the solver's
                x[0] -= self._at_rest(x, y)
            slack = self.slack(x, y, dense)
            if slack.min() > _SLACK:
                return ImpossibilitySearch(self._certificate(x, y), margin)
            if margin <= _SLACK:  # more points only take from it
                break
            inner = slack[1:-1]
            failures = np.flatnonzero((inner <= slack[:-2]) & (inner <= slack[2:]) & (inner < _SLACK)) + 1
            worst = failures[np.argsort(slack[failures], kind="stable")[:_MOST_FAILURES]]
            finer = np.union1d(omega, dense[worst])
            if turn == 0:  # the first answer tells the true shapes of R and P
                r_unit, p_unit = np.maximum(r, 0.01 * r_unit), np.maximum(p, 0.01 * p_unit)
            r_unit, p_unit = (
                np.exp(np.interp(np.log(finer), np.log(omega), np.log(unit))) for unit in (r_unit, p_unit)
            )
            omega = finer
        return ImpossibilitySearch(None, margin)

    def slack(self, x: Floats, y: Floats, omega: Floats) -> Floats:
        """The smallest relative room among the conditions at each frequency, (w,); positive where they hold."""
        g_x, g_y = _at(self._x_functions(omega), x), _at(self._y_functions(omega), y)
        w1, w3 = self.scaled.performance_bound(omega), self.scaled.bandwidth_bound(omega)
        y_low, y_high, y_room = _interval_bounds(-g_y, w1, self.level)
        x_low, x_high, x_room = _interval_bounds(g_x, w3, self.level)
        least, most = self._ratios(omega)
        size_x, size_y = np.abs(g_x) ** 2, np.abs(g_y) ** 2
        with np.errstate(divide="ignore", invalid="ignore"):
            light = 1 - least * size_x * y_low / (size_y * x_high)
            heavy = 1 - size_y * x_low / (most * size_x * y_high)
        signs = np.where((x_high > 0) & (y_high > 0), 1.0, -1.0)
        if vanishes_at_rest(self.scaled.performance):  # the intervals of R and P shrink to a point at rest
            light, heavy = light / np.minimum(w1, 1.0), heavy / np.minimum(w1, 1.0)
        room = np.min([light, heavy, x_room, y_room, signs], axis=0)
        return np.asarray(np.where(np.isnan(room), -1.0, room))

    def _ratios(self, omega: Floats) -> tuple[Floats, Floats]:
        """R/P at the first and at the last end of the family: ρ over that of the first at rest."""
        family = self.scaled.family
        first, last = (family.current_per_displacement(omega, share) for share in (FIRST, LAST))
        unit = float(family.current_per_displacement(0.0, FIRST))
        return first / unit, last / unit

    def _x_functions(self, omega: Floats) -> _Functions:
        """1, and p_k/(s + p_k) less the multiple of the slowest lag that makes the derivative at 0 vanish."""
        slowest, poles, at = self.x_poles[0], self.x_poles[1:], omega[:, None]
        own, shared = poles**2 + at**2, slowest**2 + at**2
        real = poles**2 / own - slowest**3 / (poles * shared)
        imaginary = at**3 * (slowest**2 - poles**2) / (poles * own * shared)
        return _with_constant(real, imaginary)

    def _y_functions(self, omega: Floats) -> _Functions:
        """1, the lags and the second-order terms, or those less the fastest lag's multiple that takes their 1/s term.

        The second-order terms are n²/D and n s/D with D = s² + 2 ζ n s + n², a pair of them for each of W1's.
        """
        at = omega[:, None]
        natural, damping = self.y_pairs.T
        rest, drag = natural**2 - at**2, 2.0 * damping * natural * at
        size = rest**2 + drag**2
        even = _Functions(natural**2 * rest / size, -(natural**2) * drag / size)
        odd = _Functions(natural * at * drag / size, natural * at * rest / size)
        if relative_degree(self.scaled.performance) <= 1:
            own = self.y_poles**2 + at**2
            lags = _Functions(self.y_poles**2 / own, -self.y_poles * at / own)
        else:
            fastest, poles = self.y_poles[-1], self.y_poles[:-1]
            own, shared = poles**2 + at**2, fastest**2 + at**2
            lags = _Functions(
                poles**2 / own - poles * fastest / shared, at * poles * (poles**2 - fastest**2) / (own * shared)
            )
            # n s/D − (n/p) p/(s + p) = n ((p − 2 ζ n) s − n²)/(D (s + p)); its imaginary part falls off like 1/ω³.
            lowest = (2.0 * damping * natural) ** 2 - natural**2 - fastest**2
            lowest = lowest * at**2 + natural**2 * (fastest**2 + natural**2)
            odd = _Functions(odd.real - natural * fastest / shared, natural * at * lowest / (size * shared))
        parts = (lags, even, odd)
        return _with_constant(np.hstack([p.real for p in parts]), np.hstack([p.imaginary for p in parts]))

    @property
    def _derives_constant(self) -> bool:
        return derives_constant(self.scaled)

    def _at_rest(self, x: Floats, y: Floats) -> float:
        """G_X(0) + G_Y(0)."""
        zero = np.zeros(1)
        return float((self._x_functions(zero).real @ x + self._y_functions(zero).real @ y)[0])

    def _widest_margin(
        self, omega: Floats, r_unit: Floats, p_unit: Floats
    ) -> tuple[Floats, Floats, float, Floats, Floats]:
        """The coefficients with the largest s in |G_Y + g R| ≤ |W1| (R − s r), |G_X − g P| ≤ |W3| (P − s p).

        Returns
        -------
        x, y, s, R, P
        """
        count = omega.size
        w1, w3 = self.scaled.performance_bound(omega), self.scaled.bandwidth_bound(omega)
        functions = self._y_functions(omega)
        minus_y = _Functions(-functions.real, -functions.imaginary)
        force = _Block.of(minus_y, w1, r_unit, self.level)
        measure = _Block.of(self._x_functions(omega), w3, p_unit, self.level)
        widths = (force.columns, measure.columns)
        places = [(0, sum(widths)), (widths[0], sum(widths) + count)]
        unknowns = sum(widths) + 2 * count + 1
        r_rows, p_rows = (
            block.size_rows(*place, unknowns) for block, place in zip((force, measure), places, strict=True)
        )
        cones = [block.cone_rows(*place, unknowns) for block, place in zip((force, measure), places, strict=True)]
        least, most = self._ratios(omega)
        size = np.sqrt(r_unit * p_unit * np.sqrt(least * most))
        r_side, p_low, p_high = (sparse.diags(v / size) for v in (r_unit, least * p_unit, most * p_unit))
        mean = sparse.csr_matrix((r_rows + p_rows).sum(axis=0) / (2 * count))
        last = sparse.csr_matrix(([1.0], ([0], [unknowns - 1])), shape=(1, unknowns))
        matrix = sparse.vstack(
            [p_low @ p_rows - r_side @ r_rows, r_side @ r_rows - p_high @ p_rows, -r_rows, -p_rows, last, *cones, mean]
        )
        right = np.concatenate([np.zeros(2 * count), np.full(2 * count, -_LEAST), [1.0], np.zeros(6 * count), [1.0]])
        kinds = [(Cone.NONNEGATIVE, 4 * count + 1), *[(Cone.SECOND_ORDER, 3)] * (2 * count), (Cone.ZERO, 1)]
        if self._derives_constant:
            zero = np.zeros(1)
            at_rest = np.hstack(
                [
                    functions_at.real @ block.back
                    for functions_at, block in ((self._y_functions(zero), force), (self._x_functions(zero), measure))
                ]
            )
            matrix = sparse.vstack([matrix, _shift(at_rest, 0, unknowns)])
            right = np.append(right, 0.0)
            kinds[-1] = (Cone.ZERO, 2)
        cost = np.zeros(unknowns)
        cost[-1] = -1.0
        answer = solve_cone_program(cost, matrix, right, kinds, tolerance=1e-9)
        if not answer.is_solved:
            raise NumericsError(f"the cone program of the dual ended as {answer.status}")
        y = force.back @ answer.x[: widths[0]]
        x = measure.back @ answer.x[widths[0] : sum(widths)]
        return x, y, float(answer.x[-1]), (r_rows @ answer.x) * r_unit, (p_rows @ answer.x) * p_unit

    def _certificate(self, x: Floats, y: Floats) -> ImpossibilityCertificate:
        scale = 1.0 / abs(x[0]) if x[0] else 1.0
        pairs, lags = self.y_pairs.shape[0], y.size - 2 * self.y_pairs.shape[0]
        rows = zip(self.y_pairs, y[lags : lags + pairs] * scale, y[lags + pairs :] * scale, strict=True)
        return ImpossibilityCertificate(
            self.level,
            tuple(float(pole) for pole in self.x_poles),
            tuple(float(value * scale) for value in x[int(self._derives_constant) :]),
            tuple(float(pole) for pole in self.y_poles),
            tuple(float(value * scale) for value in y[:lags]),
            tuple((float(own[0]), float(own[1]), float(a), float(b)) for own, a, b in rows),
        )


@dataclass(frozen=True, eq=False)
class _Block:
    """One condition |G − g·size·unit| ≤ w (size − s)·unit, in coefficients of orthonormal functions.

    The unknown at a frequency is the defect (Re G − g size unit)/(w unit) where w is below the level, and the size
    itself where w is above it: either way every number is near one, though w spans ten decades.
    """

    real: Floats
    imaginary: Floats
    back: Floats
    weight: Floats
    level: float

    @classmethod
    def of(cls, functions: _Functions, weight: Floats, unit: Floats, level: float) -> _Block:
        large = np.maximum(weight / level, 1.0)
        real = functions.real / (large * unit)[:, None]
        imaginary = functions.imaginary / (weight * unit)[:, None]
        count = weight.size
        q, r = np.linalg.qr(np.concatenate([real, imaginary]) / np.sqrt(count))
        q = q * np.sqrt(count)
        return cls(q[:count], q[count:], np.linalg.inv(r), weight, level)

    @property
    def columns(self) -> int:
        return int(self.real.shape[1])

    def size_rows(self, first: int, free: int, unknowns: int) -> sparse.csr_matrix:
        """The size at each frequency as rows over all unknowns."""
        low = self.weight < self.level
        own = _shift(self.real * np.where(low, 1.0 / self.level, 0.0)[:, None], first, unknowns)
        return sparse.csr_matrix(own + _diagonal(np.where(low, -self.weight / self.level, 1.0), free, unknowns))

    def cone_rows(self, first: int, free: int, unknowns: int) -> sparse.csr_matrix:
        """Three rows a frequency: −(size − s), −Im, −defect."""
        count = self.weight.size
        low = self.weight < self.level
        margin = sparse.csr_matrix(
            (np.ones(count), (np.arange(count), np.full(count, unknowns - 1))), shape=(count, unknowns)
        )
        top = self.size_rows(first, free, unknowns) - margin
        whole = np.where(low, 0.0, np.maximum(self.weight / self.level, 1.0) / self.weight)
        defect = _shift(self.real * whole[:, None], first, unknowns)
        defect = defect + _diagonal(np.where(low, 1.0, -self.level / self.weight), free, unknowns)
        stacked = sparse.csr_matrix(sparse.vstack([-top, -_shift(self.imaginary, first, unknowns), -defect]))
        return sparse.csr_matrix(stacked[(np.arange(3)[None, :] * count + np.arange(count)[:, None]).ravel()])


def _complex_poles(weight: RationalWeight) -> Floats:
    """Natural frequency and damping of each complex pair of poles, (m, 2), of those that lags do not make as well."""
    upper = weight.poles_rad_s[weight.poles_rad_s.imag > 0]
    pairs = np.column_stack([np.abs(upper), -upper.real / np.abs(upper)])
    return np.asarray(pairs[pairs[:, 1] < _MOST_DAMPING])


def _with_constant(real: Floats, imaginary: Floats) -> _Functions:
    ones = np.ones((real.shape[0], 1))
    return _Functions(np.hstack([ones, real]), np.hstack([0.0 * ones, imaginary]))


def _at(functions: _Functions, coefficients: Floats) -> Complexes:
    return np.asarray(functions.real @ coefficients + 1j * (functions.imaginary @ coefficients))


def _interval_bounds(g: Complexes, weight: Floats, level: float) -> tuple[Floats, Floats, Floats]:
    """|G|² over the largest and over the smallest size with |G − level·size| ≤ weight·size, and the relative room."""
    room = weight**2 - level**2 * g.imag**2 / np.maximum(np.abs(g) ** 2, 1e-300)
    root = np.abs(g) * np.sqrt(np.maximum(room, 0.0))
    return level * g.real - root, level * g.real + root, room / weight**2


def _shift(block: Floats, first: int, unknowns: int) -> sparse.csr_matrix:
    rows = block.shape[0]
    after = unknowns - first - block.shape[1]
    before, behind = sparse.csr_matrix((rows, first)), sparse.csr_matrix((rows, after))
    return sparse.csr_matrix(sparse.hstack([before, sparse.csr_matrix(block), behind]))


def _diagonal(values: Floats, first: int, unknowns: int) -> sparse.csr_matrix:
    count = values.size
    return sparse.csr_matrix((values, (np.arange(count), first + np.arange(count))), shape=(count, unknowns))

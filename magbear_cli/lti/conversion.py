"""Between state space and transfer function, for systems with one input and one output."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.lti.balancing import with_balanced_states, with_time_unit
from magbear_cli.lti.connection import series
from magbear_cli.lti.state_space import StateSpace

ZERO = 1e-13  # a sum this small beside its terms is rounding


def from_transfer_function(num: ArrayLike, den: ArrayLike) -> StateSpace:
    """The controllable companion form of num(s)/den(s), its states scaled to comparable size.

    Parameters
    ----------
    num, den : coefficients by descending powers of s; leading zeros are dropped

    Raises
    ------
    NumericsError
        when a coefficient is not finite, den is zero, or num has the higher degree.

    Notes
    -----
    The scaling is by powers of two, so that this is the given function, not the one through its computed roots.
    """
    numerator, denominator = _polynomial(num, "numerator"), _polynomial(den, "denominator")
    n = denominator.size - 1
    if numerator.size > denominator.size:
        raise NumericsError("the transfer function is improper: its numerator has the higher degree")
    padded = np.concatenate([np.zeros(denominator.size - numerator.size), numerator]) / denominator[0]
    monic = denominator / denominator[0]
    d = padded[:1].reshape(1, 1)
    a = np.vstack([-monic[1:][None, :], np.eye(n - 1, n)]) if n else np.zeros((0, 0))
    b = np.eye(n, 1)
    c = (padded[1:] - d[0, 0] * monic[1:]).reshape(1, n)
    return with_balanced_states(StateSpace.of(a, b, c, d))


def from_zeros_poles_gain(zeros: ArrayLike, poles: ArrayLike, gain: float) -> StateSpace:
    """gain·Π(s − zero)/Π(s − pole) as a chain of first- and second-order sections, slow poles first.

    Parameters
    ----------
    zeros, poles : rad/s, complex ones in conjugate pairs; no more zeros than poles
    gain : ratio of the leading coefficients

    Raises
    ------
    NumericsError
        when there are more zeros than poles, or a complex root lacks its conjugate.
    """
    numerators, denominators = _sections(zeros), _sections(poles)
    if np.size(zeros) > np.size(poles):
        raise NumericsError("a proper system has no more zeros than poles")
    system = StateSpace.gain([[gain]])
    # A numerator of degree two needs a section of degree two; a single one takes the first place left.
    for denominator in denominators:
        fitting = [numerator for numerator in numerators if numerator.size <= denominator.size]
        chosen = max(fitting, key=np.size, default=np.ones(1))
        numerators = [numerator for numerator in numerators if numerator is not chosen]
        system = series(system, from_transfer_function(chosen, denominator))
    return with_balanced_states(system)


def transfer_function(system: StateSpace) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(num, den) by descending powers of s, den monic, from the zeros, poles and gain of a one-by-one system."""
    zeros, poles, gain = zeros_poles_gain(system)
    return np.real(gain * np.atleast_1d(np.poly(zeros))), np.real(np.atleast_1d(np.poly(poles)))


def zeros_poles_gain(system: StateSpace) -> tuple[NDArray[np.complex128], NDArray[np.complex128], float]:
    """The zeros and poles in rad/s, and the ratio of the leading coefficients.

    Raises
    ------
    NumericsError
        when the system has more than one input or output.

    Notes
    -----
    While D = 0, y = 0 says that the state along C vanishes; so does its derivative, which is then the output of a
    system with one state less (the structure algorithm: Silverman 1969; Emami-Naeini and Van Dooren 1982). Once
    D ≠ 0 the zeros are the eigenvalues of A − B D⁻¹ C. How often D = 0 is told beforehand by the first of C B, C A B …
    that is not rounding beside the products it is the sum of, which does not depend on the units of the states; D
    counts as rounding where it would mean a zero 1e13 times as fast as all else. The state is eliminated, not rotated
    away: rotations would mix slow states with fast ones and lose their digits.
    """
    if (system.inputs, system.outputs) != (1, 1):
        raise NumericsError("zeros, poles and gain are those of a system with one input and one output")
    omega, poles = _typical_speed(system), system.poles()
    scaled = with_balanced_states(with_time_unit(system, omega))
    direct = float(scaled.d[0, 0])
    degree, leading = _leading_markov(scaled)
    if leading == 0.0:
        return (poles.copy(), poles, direct) if direct != 0.0 else (np.zeros(0, complex), poles, 0.0)
    if direct != 0.0:
        beyond = ZERO * (abs(leading) / abs(direct)) ** (
            1.0 / degree
        )  # how fast D makes the fastest zeros, if it is small
        slower = np.abs(poles).max() / omega
        if beyond > slower and system.order > 1:  # poles beside an integrator may all be slow: look at the zeros too
            slower = max(slower, float(np.abs(_zeros(scaled, degree, leading)).max(initial=0.0)))
        if beyond <= slower or system.order == 1:
            degree, leading = 0, direct
    zeros = _zeros(scaled, degree, leading) * omega
    return np.sort_complex(zeros), poles, leading * omega**degree


def _leading_markov(system: StateSpace) -> tuple[int, float]:
    """The first of C B, C A B … that is not zero and its number from one; zero and 0.0 where all are.

    Where none stands out of its rounding, that which does most.
    """
    c, state = system.c[0], system.b[:, 0]
    size, modulus, unit = np.abs(state), np.abs(system.a), 1.0
    best, degree, leading = 0.0, 0, 0.0
    for number in range(1, system.order + 1):
        value, terms = float(c @ state), float(np.abs(c) @ size)
        if abs(value) > best * terms:
            best, degree, leading = abs(value) / terms, number, value * unit
        if best > ZERO:
            break
        state, size = system.a @ state, modulus @ size
        largest = float(size.max()) or 1.0
        state, size, unit = state / largest, size / largest, unit * largest
    return degree, leading


def _zeros(system: StateSpace, degree: int, leading: float) -> NDArray[np.complex128]:
    """The zeros of a system of known relative degree and leading coefficient; a direct gain counts at degree 0 only."""
    rest, share = system, 1.0
    for _ in range(degree):
        rest, size = _with_output_held(rest)
        share *= size
    # the leading coefficient is known better than what elimination has left of it
    inner = rest.a - rest.b @ rest.c / (leading / share)
    n = inner.shape[0]
    inner = with_balanced_states(StateSpace(inner, np.zeros((n, 1)), np.zeros((1, n)), np.zeros((1, 1)))).a
    return np.linalg.eigvals(inner).astype(complex)


def _with_output_held(system: StateSpace) -> tuple[StateSpace, float]:
    """The system with y = 0, the derivative of y over a size for its output and one state less; and that size.

    The state with the largest share in y gives way, so that no multiplier is above one.
    """
    a, b, c = system.a.copy(), system.b.copy(), system.c[0]
    place = int(np.abs(c).argmax())
    size = float(c[place])
    share = c / size
    a[place], b[place] = share @ a, share @ b
    others = np.arange(c.size) != place
    a = (a - np.outer(a[:, place], share))[:, others]
    rest = StateSpace(a[others], b[others], a[[place]], b[[place]])
    return with_balanced_states(rest), size


def _typical_speed(system: StateSpace) -> float:
    """A typical pole: the geometric mean of the sizes of those that are not zero, in rad/s."""
    sizes = np.abs(system.poles())
    sizes = sizes[sizes > 0]
    return float(np.exp(np.log(sizes).mean())) if sizes.size else 1.0


def _polynomial(coefficients: ArrayLike, name: str) -> NDArray[np.float64]:
    array = np.atleast_1d(np.asarray(coefficients, dtype=float))
    if array.ndim != 1 or not np.isfinite(array).all():
        raise NumericsError(f"the {name} must be a list of finite coefficients")
    trimmed = np.trim_zeros(array, "f")
    if trimmed.size == 0:
        if name == "denominator":
            raise NumericsError("the denominator is zero")
        return np.zeros(1)
    return trimmed


def _sections(roots: ArrayLike) -> list[NDArray[np.float64]]:
    """Monic real polynomials of degree two, and one of degree one if need be, with these roots; slow roots first."""
    array = np.atleast_1d(np.asarray(roots, dtype=complex))
    upper, lower = array[array.imag > 0], array[array.imag < 0]
    matched = upper.size == lower.size and np.allclose(
        np.sort_complex(upper), np.sort_complex(lower.conj()), rtol=1e-8, atol=0.0
    )
    if not matched:
        raise NumericsError("complex zeros and poles must come in conjugate pairs")
    pairs = [np.array([1.0, -2.0 * root.real, abs(root) ** 2]) for root in upper]
    real = sorted(array[array.imag == 0].real, key=abs)
    pairs += [np.poly(real[index : index + 2]) for index in range(0, len(real), 2)]
    return sorted(pairs, key=lambda factor: float(abs(factor[-1])) ** (1.0 / (factor.size - 1)))

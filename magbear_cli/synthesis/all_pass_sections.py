"""A chain of all-pass sections with real or complex poles: orthogonal functions over any stable set of poles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_LEAST_DAMPING = 0.01  # of the pole's size: a function more resonant than this hides between frequencies


@dataclass(frozen=True, eq=False)
class Sections:
    """The poles of a chain: s² + b s + c for each row of ``quadratics``, and s + p for ``lag``, if there is one.

    Each section drives the next through its all-pass function, q(−s)/q(s), so that the states of the whole chain have
    a unit Gramian: its functions are orthogonal on the axis however close or repeated the poles are (Takenaka and
    Malmquist; for pairs of poles Heuberger, Van den Hof and Wahlberg, "Modelling and identification with rational
    orthogonal basis functions", 2005, chapter 2).

    Parameters
    ----------
    quadratics : (k, 2) array of positive numbers (b, c)
    lag : positive, or None
    """

    quadratics: Floats
    lag: float | None = None

    @classmethod
    def of_poles(cls, poles: Complexes) -> Sections:
        """The chain with these poles in the left half-plane, complex ones in conjugate pairs; the slowest first.

        An odd real pole, the one in the middle, is the lag.
        """
        pairs = [(-2.0 * pole.real, abs(pole) ** 2) for pole in poles if pole.imag > 0]
        real = np.sort(-poles[poles.imag == 0].real)
        lag = float(real[real.size // 2]) if real.size % 2 else None
        if lag is not None:
            real = np.delete(real, real.size // 2)
        pairs += [(p + q, p * q) for p, q in zip(real[::2], real[1::2], strict=True)]
        return cls(np.array(sorted(pairs, key=lambda pair: pair[1])).reshape(-1, 2), lag)

    @property
    def order(self) -> int:
        """The number of poles."""
        return 2 * len(self.quadratics) + (self.lag is not None)

    @property
    def logarithms(self) -> Floats:
        """The logarithms of all b, all c and of the lag, which may be moved freely."""
        free = self.quadratics.T.ravel()
        return np.log(free if self.lag is None else np.append(free, self.lag))

    def with_logarithms(self, values: Floats) -> Sections:
        """The chain with these logarithms; damping is held above a small part of the poles' size."""
        pairs = len(self.quadratics)
        moved = np.exp(values)
        c = moved[pairs : 2 * pairs]
        b = np.maximum(moved[:pairs], 2.0 * _LEAST_DAMPING * np.sqrt(c))
        return Sections(np.stack([b, c], axis=1), None if self.lag is None else float(moved[-1]))

    def without_first(self, count: int) -> Sections:
        """The chain that begins after some of the quadratics."""
        return Sections(self.quadratics[count:], self.lag)

    def functions(self, omega_rad_s: Floats) -> Complexes:
        """1 and the chain's functions, each of a size near two, of shape (w, order + 1); ∞ is a legal frequency."""
        finite = np.isfinite(omega_rad_s)
        s = 1j * np.where(finite, omega_rad_s, 0.0)
        passed = np.ones(s.size, dtype=complex)
        columns = [passed]
        for b, c in self.quadratics:
            q = s**2 + b * s + c
            columns += [np.where(finite, 2.0 * b * np.sqrt(c) / q, 0.0) * passed]
            columns += [np.where(finite, 2.0 * b * s / q, 0.0) * passed]
            passed = passed * np.where(finite, (s**2 - b * s + c) / q, 1.0)
        if self.lag is not None:
            columns += [np.where(finite, 2.0 * self.lag / (s + self.lag), 0.0) * passed]
        return np.stack(columns, axis=1)

    def chain(self) -> tuple[Floats, Floats, Floats]:
        """A (n, n) and B (n,) of the chain, and the size (n,) of each function in units of its state.

        A pair is v1' = √c v2, v2' = −√c v1 − b v2 + √(2 b) e and passes e − √(2 b) v2 on, so that A + Aᵀ = −B Bᵀ.
        """
        n = self.order
        a, enter, size, leave = np.zeros((n, n)), np.zeros(n), np.zeros(n), np.zeros(n)
        for index, (b, c) in enumerate(self.quadratics):
            first, second = 2 * index, 2 * index + 1
            root, speed = np.sqrt(2.0 * b), np.sqrt(c)
            a[first, second], a[second, first], a[second, second] = speed, -speed, -b
            a[second, :first] = root * leave[:first]
            enter[second] = size[first] = size[second] = root
            leave[second] = -root
        if self.lag is not None:
            root = np.sqrt(2.0 * self.lag)
            a[-1, :-1], a[-1, -1] = root * leave[:-1], -self.lag
            enter[-1] = size[-1] = root
        return a, enter, size

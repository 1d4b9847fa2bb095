"""The linear part of a loop over a step: exact for any state and any force that is a polynomial, for widths 2^k h.

With x' = A x + b q_0 and q_k' = q_(k+1), the flow of (x, q) over a time t is exp(t G). For a small step it is Taylor's
series, for a step twice as wide its square (scaling and squaring, Higham 2005). What is kept and squared is the excess
E = exp(t G) − I, by 2 E + E E: squaring exp(t G) itself would double the rounding error of slow states each time.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import factorial

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SMALL = 0.7  # of the norm of a step's generator, for Taylor's series
TERMS = 20  # 0.7^20/20! is 3e-22
LAST_TERM = 1e-22


@dataclass(frozen=True, eq=False)
class Propagator:
    """From the state and the forces at the points, over a step of one width; states and forces are rows.

    Outputs at the points followed by the probes, flat: x @ free + forced @ f, of shapes (n, (p·4)) and (p, 4, s).
    State at the end: x @ end_free + f @ end_forced, of shapes (n, n) and (s, n).
    """

    width_s: float
    free: Floats
    forced: Floats
    end_free: Floats
    end_forced: Floats


@dataclass(eq=False)
class Propagation:
    """The propagators of a linear part, each computed once.

    Parameters
    ----------
    a, b, c : (n, n), (n,) and (outputs, n) arrays
    points : (p,) fractions of a step; the first ``stages`` carry the force's polynomial, the last of those is one
    stages : s
    """

    a: Floats
    b: Floats
    c: Floats
    points: Floats
    stages: int
    _known: dict[float, Propagator] = field(default_factory=dict)
    _excesses: dict[float, Floats] = field(default_factory=dict)

    def over(self, width_s: float) -> Propagator:
        """The propagator of a width."""
        if width_s not in self._known:
            self._known[width_s] = self._built(width_s)
        return self._known[width_s]

    def _built(self, width_s: float) -> Propagator:
        order, stages = self.b.size, self.stages
        flows = self._excess(width_s)[:, :order]
        powers = np.arange(stages)
        derivatives = self.points[:stages, None] ** powers / [factorial(k) for k in powers]
        from_values = np.linalg.inv(derivatives)
        free, forced = flows[:, :, :order], flows[:, :, order:] @ from_values
        by_row = (self.c + self.c @ free).reshape(-1, order)
        return Propagator(
            width_s,
            np.ascontiguousarray(by_row.T),
            self.c @ forced,
            np.ascontiguousarray(free[stages - 1].T + np.eye(order)),
            np.ascontiguousarray(forced[stages - 1].T),
        )

    def _excess(self, width_s: float) -> Floats:
        """exp(c h G) − I for every point c, (p, n + s, n + s), the derivatives of the force in units of the width."""
        if width_s not in self._excesses:
            generator = self._generator(width_s)
            size = np.abs(generator[: self.b.size]).sum(axis=1).max()
            if not np.isfinite(size) or (size <= SMALL and width_s / 2.0 not in self._excesses):
                self._excesses[width_s] = self._series(generator, float(size))
            else:  # the same derivatives in units of a step twice as wide, before squaring
                unit = np.append(np.ones(self.b.size), 0.5 ** np.arange(self.stages))
                half = self._excess(width_s / 2.0) * unit / unit[:, None]
                self._excesses[width_s] = 2.0 * half + half @ half
        return self._excesses[width_s]

    def _generator(self, width_s: float) -> Floats:
        order, size = self.b.size, self.b.size + self.stages
        generator = np.zeros((size, size))
        generator[:order, :order] = width_s * self.a
        generator[:order, order] = width_s * self.b
        generator[order:, order:] = np.eye(self.stages, k=1)
        return generator

    def _series(self, generator: Floats, size: float) -> Floats:
        """Taylor's series of exp(c G) − I for every point c; powers of the points are all that differs."""
        terms = next((k for k in range(1, TERMS) if size**k < LAST_TERM * factorial(k)), TERMS)
        count = terms + self.stages  # the derivatives of the force come in one by one
        powers = np.empty((count, *generator.shape))
        powers[0] = generator
        for k in range(1, count):
            np.matmul(generator, powers[k - 1], out=powers[k])
            powers[k] /= k + 1
        by_point = self.points[:, None] ** np.arange(1, count + 1)
        return (by_point @ powers.reshape(count, -1)).reshape(-1, *generator.shape)

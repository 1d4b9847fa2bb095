"""A controller by the poles it gives the nominal loop: K S is affine in the remaining coefficients.

In the scaled problem G = 1/(s² − 1) at the nominal mass. Let f and l be two quadratics, f l = (s² − 1) d2 − n1 with n1
of degree one. Then n1/d2 puts the loop's poles to the zeros of f l, and all stabilising controllers are
K = (n1 + (s² − 1) Q)/(d2 + Q) with Q stable, for which K S = (s² − 1)(n1 + (s² − 1) Q)/(f l). With Q over a chain of
n − 2 poles K has n states, and those poles with the zeros of f l are the n + 2 poles of the loop.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magbear_cli.lti.state_space import StateSpace
from magbear_cli.synthesis.all_pass_sections import Sections

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class SectionController:
    """The controller of the scaled nominal plant with the poles of ``sections`` and Q = q·functions.

    Parameters
    ----------
    sections : two quadratics, f and l, and the chain of Q after them
    q : (order − 3,) array, the coefficients of Q's functions
    """

    sections: Sections
    q: Floats

    def factors(self) -> tuple[Floats, Floats, Floats, Floats]:
        """The polynomials f, l, n1 and d2, by descending powers."""
        (f1, f0), (l1, l0) = self.sections.quadratics[:2]
        f, link = np.array([1.0, f1, f0]), np.array([1.0, l1, l0])
        # f l = s⁴ + a s³ + b s² + c s + d = (s² − 1)(s² + a s + b + 1) + (a + c) s + b + d + 1
        _, a, b, c, d = np.polymul(f, link)
        return f, link, -np.array([a + c, b + d + 1.0]), np.array([1.0, a, b + 1.0])

    def affine_terms(self, omega_rad_s: Floats) -> tuple[Complexes, Complexes]:
        """K S = r0 + B q on the axis: r0 (w,) and B (w, order − 3); ∞ is a legal frequency."""
        finite = np.isfinite(omega_rad_s)
        s = 1j * np.where(finite, omega_rad_s, 1.0)
        f, link, n1, _ = self.factors()
        first = np.where(finite, (s**2 - 1.0) / np.polyval(f, s), 1.0)
        offset = np.where(finite, first * np.polyval(n1, s) / np.polyval(link, s), 0.0)
        gain = first * np.where(finite, (s**2 - 1.0) / np.polyval(link, s), 1.0)
        return offset, gain[:, None] * self.sections.without_first(2).functions(omega_rad_s)

    def control_sensitivity(self, omega_rad_s: Floats) -> Complexes:
        """K S at the nominal mass, (w,)."""
        offset, columns = self.affine_terms(omega_rad_s)
        return offset + columns @ self.q

    def response(self, omega_rad_s: Floats) -> Complexes:
        """K(jω), (w,); at ∞ it is Q(∞)."""
        finite = np.isfinite(omega_rad_s)
        s = 1j * np.where(finite, omega_rad_s, 1.0)
        free = self.sections.without_first(2).functions(omega_rad_s) @ self.q
        _, _, n1, d2 = self.factors()
        quotient = (np.polyval(n1, s) + (s**2 - 1.0) * free) / (np.polyval(d2, s) + free)
        return np.asarray(np.where(finite, quotient, free))

    def controller(self) -> StateSpace:
        """The controller with order − 2 states: an observer, a state feedback, and the chain of Q.

        The observer-based form of the same factors (Zhou, Doyle and Glover, Robust and Optimal Control, 1996,
        chapter 12): A + B F has the characteristic polynomial f, A + L C has l.
        """
        (f1, f0), (l1, l0) = self.sections.quadratics[:2]
        chain, enter, size = self.sections.without_first(2).chain()
        a = np.array([[0.0, 1.0], [1.0, 0.0]])
        b, c = np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]])
        feedback, injection = np.array([[-f0 - 1.0, -f1]]), np.array([[-l1], [-l0 - 1.0]])
        # xhat' = (A + B F + L C) xhat − L y + B v, u = F xhat + v, v = Q (y − C xhat)
        q_c, q_d = (self.q[1:] * size)[None, :], self.q[0]
        observer = a + b @ feedback + injection @ c - q_d * (b @ c)
        state = np.block([[observer, b @ q_c], [-enter[:, None] @ c, chain]])
        driven = np.concatenate([-injection + q_d * b, enter[:, None]])
        return StateSpace.of(state, driven, np.concatenate([feedback - q_d * c, q_c], axis=1), [[q_d]])

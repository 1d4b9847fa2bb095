"""The stable, minimum-phase factor W of a positive definite spectrum W(−s)ᵀ W(s)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cholesky, solve_continuous_are, solve_triangular

from magbear_cli.errors import NumericsError

Matrix = NDArray[np.float64]

_ACCEPTED_RESIDUAL = 1e-8  # of the equation, relative to its largest term


def spectral_factor(a: Matrix, b: Matrix, c: Matrix, r: Matrix) -> tuple[Matrix, Matrix]:
    """C_W and D_W of W = D_W + C_W (s I − A)⁻¹ B with W(−s)ᵀ W(s) = Z(s) + Z(−s)ᵀ, Z = R/2 + C (s I − A)⁻¹ B.

    Parameters
    ----------
    a : (n, n) array, stable
    b : (n, m), c : (m, n) arrays
    r : (m, m) symmetric array

    Raises
    ------
    NumericsError
        when the spectrum is not positive definite at every frequency, ∞ included.

    Notes
    -----
    The positive real lemma (Anderson and Vongpanitlerd 1973): with the stabilising solution Y of
    ÂᵀY + Y Â − Y B R⁻¹ Bᵀ Y − Cᵀ R⁻¹ C = 0, Â = A − B R⁻¹ C, the factor has D_Wᵀ D_W = R, C_W = D_W⁻ᵀ (C + Bᵀ Y);
    its zeros are the eigenvalues of Â − B R⁻¹ Bᵀ Y. Such a Y exists exactly when the spectrum is positive definite.
    """
    try:
        root = np.asarray(cholesky(r, lower=False), dtype=float)  # rootᵀ root = R
        in_r = np.linalg.solve(r, c)
        inner, cost = a - b @ in_r, -c.T @ in_r
        y = np.asarray(solve_continuous_are(inner, b, (cost + cost.T) / 2.0, r), dtype=float)
    except (LinAlgError, ValueError) as error:
        raise NumericsError("the spectrum is not positive definite at every frequency") from error
    gain = np.linalg.solve(r, b.T @ y)
    terms = inner.T @ y, y @ inner, -y @ b @ gain, cost
    residual = float(np.abs(sum(terms)).max(initial=0.0))
    if not residual <= _ACCEPTED_RESIDUAL * max(float(np.abs(term).max(initial=0.0)) for term in terms):
        raise NumericsError(f"the factor of the spectrum is too badly conditioned: its residual is {residual:.1e}")
    if np.linalg.eigvals(inner - b @ gain).real.max(initial=-1.0) >= 0.0:
        raise NumericsError("the factor found for the spectrum is not of minimum phase")
    return np.asarray(solve_triangular(root, c + b.T @ y, trans="T"), dtype=float), root
